// Pictures to and from a window.
#pragma once

#include <string>

#include "format/base/error.h"
#include "format/base/vec.h"
#include "viewer/gl/functions.h"

namespace selvedge {

class ScreenTexture {
 public:
  /// The context of `gl` must be current whenever a function is called, the destructor included.
  explicit ScreenTexture(const GlFunctions& gl) : gl_(gl) {}
  ~ScreenTexture() { gl_.DeleteTextures(1, &texture_); }
  ScreenTexture& operator=(ScreenTexture&&) = delete;

  /// `rgba`: 4 bytes per pixel, top row first. The texture is filtered linearly when magnified.
  void load(int width, int height, const void* rgba);
  /// 0 before the first load.
  GLuint name() const { return texture_; }

 private:
  const GlFunctions& gl_;
  GLuint texture_ = 0;
  int width_ = 0;
  int height_ = 0;
};

/// Writes what the window shows, before its buffers are swapped, as PNG.
Result<void> write_window(const GlFunctions& gl, const V2i& size, const std::string& path);

}  // namespace selvedge
