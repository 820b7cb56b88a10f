// Creates and owns OpenGL objects: programs, buffers, textures, framebuffers.
#pragma once

#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "format/base/vec.h"
#include "format/picture/image.h"
#include "format/scene/scene.h"
#include "viewer/gl/functions.h"

namespace selvedge {

/// A shader of GLSL 4.50: `definitions` (lines that begin with #define), then the parts in their order
/// (glsl.h).
std::string shader_text(const std::string& definitions, std::initializer_list<const char*> parts);

/// Throws GRAPHICS_UNAVAILABLE if OpenGL has reported errors since the last call.
void check_errors(const GlFunctions& gl, const char* place);

/// A texture with one level and no filter, as a render target or for texelFetch.
GLuint make_plain_texture(const GlFunctions& gl, GLenum format, int width, int height);

/// A linear RGBA picture with all its mip levels, repeating, trilinear. Precondition: four channels.
GLuint make_colour_texture(const GlFunctions& gl, const Image& image);

/// Adds an attribute of the vertices to an array: `components` floats at `offset` bytes from the buffer's
/// begin, `stride` bytes apart.
void add_attribute(const GlFunctions& gl, GLuint array, GLuint location, GLuint buffer, GLint components,
                   std::size_t offset, std::size_t stride);

/// OpenGL objects that are deleted together. The context must be current whenever a function of this class is
/// called, the destructor included. Throws GRAPHICS_UNAVAILABLE for what OpenGL refuses.
class GlObjects {
 public:
  explicit GlObjects(const GlFunctions& gl) : gl_(gl) {}
  ~GlObjects() { clear(); }
  GlObjects& operator=(GlObjects&&) = delete;
  void clear();

  GLuint program(const std::string& vertex, const std::string& fragment);
  /// `data` may be null. The buffer has at least 16 bytes, one vec4 of a shader's array.
  GLuint buffer(std::size_t bytes, const void* data, GLbitfield flags = 0);
  template <class T>
  GLuint buffer(const std::vector<T>& values) {
    return buffer(values.size() * sizeof(T), values.data());
  }
  GLuint vertex_array() {
    gl_.CreateVertexArrays(1, &arrays_.emplace_back());
    return arrays_.back();
  }
  GLuint plain_texture(GLenum format, int width, int height);
  /// A sampler of pictures with mip levels; `nearest`: without a filter where they are enlarged.
  GLuint sampler(Wrap u, Wrap v, bool nearest);
  /// A framebuffer with these render targets; colour k is output k.
  GLuint framebuffer(std::span<const GLuint> colours, GLenum depth_attachment, GLuint depth);

 private:
  const GlFunctions& gl_;
  std::vector<GLuint> programs_;
  std::vector<GLuint> buffers_;
  std::vector<GLuint> arrays_;
  std::vector<GLuint> textures_;
  std::vector<GLuint> samplers_;
  std::vector<GLuint> framebuffers_;
};

}  // namespace selvedge
