#include "apps/selvedge-view/screen_texture.h"

#include "viewer/gl/objects.h"

namespace selvedge {

void ScreenTexture::load(int width, int height, const void* rgba) {
  if (width != width_ || height != height_) {
    gl_.DeleteTextures(1, &texture_);
    texture_ = make_plain_texture(gl_, GL_RGBA8, width, height);
    gl_.TextureParameteri(texture_, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl_.TextureParameteri(texture_, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl_.TextureParameteri(texture_, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    width_ = width;
    height_ = height;
  }
  gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl_.TextureSubImage2D(texture_, 0, 0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
}

}  // namespace selvedge
