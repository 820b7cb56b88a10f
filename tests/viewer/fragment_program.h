// Runs fragment shaders on Mesa's software rasteriser, to hold GLSL to its twins in C++.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tests/require.h"
#include "viewer/gl/context.h"
#include "viewer/gl/glsl.h"
#include "viewer/gl/objects.h"

namespace selvedge::test {

/// A current context and its functions.
struct Graphics {
  explicit Graphics(std::unique_ptr<GraphicsContext> own) : context(std::move(own)) {
    REQUIRE(context->make_current());
    gl = need(load_gl_functions(*context));
  }
  std::unique_ptr<GraphicsContext> context;
  GlFunctions gl;
};

/// Output of the shader at location 0 for each pixel of a frame; `first` and `second` are the storage
/// buffers at bindings 0 and 1.
template <class A, class B>
std::vector<V4f> run_fragments(const GlFunctions& gl, const std::string& fragment, const V2i& size,
                               const std::vector<A>& first, const std::vector<B>& second) {
  GlObjects objects(gl);
  const GLuint program = need(objects.program(shader_text("", {glsl::frame_vertex}), fragment));
  const std::array target{objects.plain_texture(GL_RGBA32F, size.x, size.y)};
  gl.BindFramebuffer(GL_FRAMEBUFFER, need(objects.framebuffer(target)));
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, objects.buffer(first));
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, objects.buffer(second));
  gl.BindVertexArray(objects.vertex_array());
  gl.Viewport(0, 0, size.x, size.y);
  gl.UseProgram(program);
  gl.DrawArrays(GL_TRIANGLES, 0, 3);
  std::vector<V4f> result(static_cast<std::size_t>(size.x * size.y));
  gl.ReadPixels(0, 0, size.x, size.y, GL_RGBA, GL_FLOAT, result.data());
  REQUIRE(check_errors(gl, "test"));
  return result;
}

}  // namespace selvedge::test
