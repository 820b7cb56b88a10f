#include "format/picture/frame.h"

#include <doctest/doctest.h>

namespace selvedge {
namespace {

TEST_CASE("the box filter averages premultiplied values and turns the rows over") {
  Frame frame{2, 2, std::vector<V4f>(4)};
  // A picture of 4 x 4, bottom row first; pixel (x, y) holds x + 10 y in red and 1 or 0 in opacity.
  std::vector<V4f> large;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)
      large.emplace_back(static_cast<float>(x + 10 * y), 0.0F, 0.0F, x == 0 ? 1.0F : 0.0F);
  box_filter(large, 0, 2, frame);
  CHECK(frame.pixels[2] == V4f(5.5F, 0, 0, 0.5F));
  CHECK(frame.pixels[3] == V4f(7.5F, 0, 0, 0));
  CHECK(frame.pixels[0] == V4f(25.5F, 0, 0, 0.5F));
}

TEST_CASE("rows beyond the top of the frame are left out") {
  Frame frame{1, 3, std::vector<V4f>(3, V4f(0, 0, 0, 0))};
  const std::vector<V4f> rows{V4f(1, 1, 1, 1), V4f(2, 2, 2, 1)};
  box_filter(rows, 2, 1, frame);
  CHECK(frame.pixels[0] == V4f(1, 1, 1, 1));
  CHECK(frame.pixels[1] == V4f(0, 0, 0, 0));
}

TEST_CASE("EXR pixels are the frame as it is") {
  const Frame frame{1, 1, {V4f(0.5F, 2, 0, 0.25F)}};
  CHECK(to_linear_image(frame).pixels == std::vector<float>{0.5F, 2, 0, 0.25F});
}

}  // namespace
}  // namespace selvedge
