#include "format/scene/footprint.h"

#include <doctest/doctest.h>

#include <cmath>

#include "format/base/random.h"
#include "tests/viewer/fragment_program.h"

namespace selvedge {
namespace {

constexpr int side = 64;

/// The GLSL twin over slopes (right.x, right.y, up.x, up.y).
std::vector<V4f> in_shader(const std::vector<V4f>& slopes) {
  const test::Graphics graphics(test::need(make_osmesa_context()));
  const std::string fragment = shader_text("", {glsl::footprint, R"(
layout(std430, binding = 0) readonly buffer Slopes { vec4 slopes[]; };
layout(location = 0) out vec4 result;
void main() {
  vec4 s = slopes[64u * uint(gl_FragCoord.y) + uint(gl_FragCoord.x)];
  float size = pixel_size(s.xy, s.zw);
  PixelBox box = pixel_box(s.xy, s.zw, size);
  result = vec4(size, texel_share(box, vec2(0.3, -0.4)), texel_share(box, vec2(-1.2, 0.9)), box.reach.x);
}
)"});
  return test::run_fragments(graphics.gl, fragment, {side, side}, slopes, slopes);
}

TEST_CASE("shaders and processor share one formula of a pixel's texels") {
  Random random(3);
  const auto number = [&] {
    return static_cast<float>(std::exp(10 * random.uniform() - 5) * (random.uniform() < 0.5 ? -1 : 1));
  };
  std::vector<V4f> slopes;
  for (int i = 0; i < side * side; ++i) slopes.emplace_back(number(), number(), number(), number());
  slopes[0] = V4f(0, 0, 0, 0);
  slopes[1] = V4f(1, 0, 0, 1);
  slopes[2] = V4f(3, 0, 0, 0);
  const std::vector<V4f> found = in_shader(slopes);
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
