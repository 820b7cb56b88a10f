#include "format/scene/footprint.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "tests/require.h"
#include "tests/viewer/shapes.h"
#include "viewer/gl/context.h"
#include "viewer/gl/glsl.h"
#include "viewer/gl/objects.h"

namespace selvedge {
namespace {

constexpr const char* main_of_test = R"(
layout(binding = 0) uniform sampler2D slopes;
layout(location = 0) uniform float taps;
layout(location = 0) out vec4 result;
void main() {
  vec4 s = texelFetch(slopes, ivec2(gl_FragCoord.xy), 0);
  result = footprint(s.xy, s.zw, taps);
}
)";

/// The GLSL twin over slopes (right.x, right.y, up.x, up.y).
std::vector<V4f> in_shader(const std::vector<V4f>& slopes, int side, float taps) {
  const auto context = test::need(make_osmesa_context());
  REQUIRE(context->make_current());
  const GlFunctions& gl = test::need(load_gl_functions(*context));
  const GLuint program = test::need(make_program(gl, shader_text("", {glsl::frame_vertex}),
                                                 shader_text("", {glsl::footprint, main_of_test})));
  const GLuint input = make_plain_texture(gl, GL_RGBA32F, side, side);
  gl.TextureSubImage2D(input, 0, 0, 0, side, side, GL_RGBA, GL_FLOAT, slopes.data());
  const GLuint output = make_plain_texture(gl, GL_RGBA32F, side, side);
  GLuint framebuffer = 0;
  gl.CreateFramebuffers(1, &framebuffer);
  gl.NamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, output, 0);
  GLuint array = 0;
  GLuint indices = 0;
  gl.CreateVertexArrays(1, &array);
  gl.CreateBuffers(1, &indices);
  constexpr std::array<std::uint32_t, 3> corners{0, 1, 2};
  gl.NamedBufferStorage(indices, sizeof corners, corners.data(), 0);
  gl.VertexArrayElementBuffer(array, indices);
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  gl.Viewport(0, 0, side, side);
  gl.UseProgram(program);
  gl.Uniform1f(0, taps);
  gl.BindTextureUnit(0, input);
  gl.BindVertexArray(array);
  gl.DrawElements(GL_TRIANGLES, 3, GL_UNSIGNED_INT, nullptr);
  std::vector<V4f> result(slopes.size());
  gl.ReadPixels(0, 0, side, side, GL_RGBA, GL_FLOAT, result.data());
  CHECK(gl.GetError() == GL_NO_ERROR);
  return result;
}

TEST_CASE("shaders and processor share one formula of the level") {
  constexpr int side = 64;
  Random random(3);
  const auto number = [&] {
    return static_cast<float>(std::exp(10 * random.uniform() - 5) * (random.uniform() < 0.5 ? -1 : 1));
  };
  std::vector<V4f> slopes;
  for (int i = 0; i < side * side; ++i) slopes.emplace_back(number(), number(), number(), number());
  slopes[0] = V4f(0, 0, 0, 0);
  slopes[1] = V4f(1, 0, 0, 1);
  slopes[2] = V4f(3, 0, 0, 0);
  for (const float taps : {1.0F, 4.0F, 16.0F}) {
    const std::vector<V4f> found = in_shader(slopes, side, taps);
    float level = 0;
    float ratio = 0;
    float axis = 0;
    for (std::size_t i = 0; i < slopes.size(); ++i) {
      const V4f& s = slopes[i];
      const Footprint<float> expected = footprint(TexelSlopes<float>{s.x, s.y, s.z, s.w}, taps);
      // Where both axes are nearly equal the difference of large numbers is left, and either axis is right.
      level = std::max(level, std::abs(found[i].x - expected.level));
      ratio = std::max(ratio, std::abs(found[i].y - expected.ratio) / expected.ratio);
      const float longest = std::exp2(expected.level) * expected.ratio;
      axis = std::max(axis, std::hypot(found[i].z - expected.axis_x, found[i].w - expected.axis_y) / longest);
    }
    CAPTURE(taps);
    // Mesa's logarithm is off by up to 0.001; the axes by rounding.
    CHECK(level < 2e-3F);
    CHECK(ratio < 2e-3F);
    CHECK(axis < 2e-3F);
  }
}

}  // namespace
}  // namespace selvedge
