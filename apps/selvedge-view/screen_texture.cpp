#include "apps/selvedge-view/screen_texture.h"

#include "format/picture/image.h"
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

Result<void> write_window(const GlFunctions& gl, const V2i& size, const std::string& path) {
  std::vector<std::uint8_t> bytes(size.x * size.y * 4);
  gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
  gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl.PixelStorei(GL_PACK_ROW_LENGTH, 0);
  gl.NamedFramebufferReadBuffer(0, GL_BACK);
  gl.ReadPixels(0, 0, size.x, size.y, GL_RGBA, GL_UNSIGNED_BYTE, bytes.data());
  Image image{size.x, size.y, 3, {}};
  for (int y = size.y - 1; y >= 0; --y) {
    for (int x = 0; x < size.x; ++x) {
      const std::size_t from = (y * size.x + x) * 4;
      for (std::size_t c = 0; c < 3; ++c) image.pixels.push_back(static_cast<float>(bytes[from + c]) / 255);
    }
  }
  return write_png(path, image, Transfer::keep);
}

}  // namespace selvedge
