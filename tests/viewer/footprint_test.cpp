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
layout(location = 0) out vec4 result;
void main() {
  vec4 s = texelFetch(slopes, ivec2(gl_FragCoord.xy), 0);
  float size = pixel_size(s.xy, s.zw);
  PixelBox box = pixel_box(s.xy, s.zw, size);
  result = vec4(size, texel_share(box, vec2(0.3, -0.4)), texel_share(box, vec2(-1.2, 0.9)), box.reach.x);
}
)";

/// The GLSL twin over slopes (right.x, right.y, up.x, up.y).
std::vector<V4f> in_shader(const std::vector<V4f>& slopes, int side) {
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
  gl.BindTextureUnit(0, input);
  gl.BindVertexArray(array);
  gl.DrawElements(GL_TRIANGLES, 3, GL_UNSIGNED_INT, nullptr);
  std::vector<V4f> result(slopes.size());
  gl.ReadPixels(0, 0, side, side, GL_RGBA, GL_FLOAT, result.data());
  CHECK(gl.GetError() == GL_NO_ERROR);
  return result;
}

TEST_CASE("shaders and processor share one formula of a pixel's texels") {
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
  const std::vector<V4f> found = in_shader(slopes, side);
  int different = 0;
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    const V4f& s = slopes[i];
    const TexelSlopes<float> of{s.x, s.y, s.z, s.w};
    const float size = pixel_size(of);
    const PixelBox<float> box = pixel_box(of, size);
    CHECK(found[i].x == doctest::Approx(size).epsilon(1e-4));
    const V4f expected(size, texel_share(box, 0.3F, -0.4F), texel_share(box, -1.2F, 0.9F), box.reach_x);
    bool good = true;
    for (int c = 1; c < 4; ++c) good &= std::abs(found[i][c] - expected[c]) < 1e-3F;
    different += good ? 0 : 1;
  }
  // Where a parallelogram is just thin enough to become a strip, rounding decides.
  CHECK(different <= 2);
}

}  // namespace
}  // namespace selvedge
