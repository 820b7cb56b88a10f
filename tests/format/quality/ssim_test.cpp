#include "format/quality/ssim.h"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/require.h"

namespace selvedge {
namespace {

template <class Value>
Image picture(int width, int height, int channels, const Value& value) {
  Image image{width, height, channels, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) image.pixels.push_back(static_cast<float>(value(x, y, c)));
    }
  }
  return image;
}

double ssim(const Image& a, const Image& b) {
  const auto result = test::need(structural_similarity(a, b));
  REQUIRE(result.has_value());
  return *result;
}

const auto noise = [](int x, int y, int) { return (x * 37 + y * 91 + x * y * 13) % 256 / 255.0; };

TEST_CASE("a picture is as similar to itself as can be") {
  const Image a = picture(16, 14, 3, noise);
  CHECK(ssim(a, a) == 1);
}

TEST_CASE("the similarity of two even pictures is their luminance's alone") {
  // Equation 6 of the paper; the contrast's factor is C2 / C2.
  const Image a = picture(12, 11, 1, [](int, int, int) { return 0.25; });
  const Image b = picture(12, 11, 1, [](int, int, int) { return 0.75; });
  const double expected = (2 * 0.25 * 0.75 + 1e-4) / (0.25 * 0.25 + 0.75 * 0.75 + 1e-4);
  CHECK(ssim(a, b) == doctest::Approx(expected).epsilon(1e-9));
}

TEST_CASE("the similarity of a picture and another is what the paper's sums over windows give") {
  const auto other = [](int x, int y, int) {
    return (x * 37 + y * 91 + x * y * 13 + (x * x + 3 * y) % 40) % 256 / 255.0;
  };
  // By a program of its own, in JavaScript and double precision: 24 windows, each summed over its 121 pixels.
  // Pixels are stored in single precision.
  CHECK(ssim(picture(16, 14, 1, noise), picture(16, 14, 1, other)) ==
        doctest::Approx(0.20234983425188202).epsilon(1e-6));
}

TEST_CASE("similarity is symmetric, and negative where contrast is turned over") {
  const Image a = picture(16, 14, 1, noise);
  const Image b = picture(16, 14, 1, [](int x, int y, int c) { return 1 - noise(x, y, c); });
  CHECK(ssim(a, b) == doctest::Approx(ssim(b, a)).epsilon(1e-12));
  CHECK(ssim(a, b) < -0.9);
}

TEST_CASE("similarity stays when the pictures are turned on their side, however many rows they have") {
  const auto uneven = [](int x, int y, int) { return (x * x * 7 + y * 29) % 256 / 255.0; };
  const auto turned = [](const auto& value) { return [&](int x, int y, int c) { return value(y, x, c); }; };
  CHECK(ssim(picture(20, 150, 1, noise), picture(20, 150, 1, uneven)) ==
        doctest::Approx(ssim(picture(150, 20, 1, turned(noise)), picture(150, 20, 1, turned(uneven))))
            .epsilon(1e-9));
}

TEST_CASE("similarity is the mean over the colours, whatever alpha is") {
  const auto at = [](double blue, double alpha) {
    return picture(11, 11, 4, [=](int, int, int c) { return c == 3 ? alpha : c == 2 ? blue : 0.5; });
  };
  const double of_blue = (2 * 0.5 * 1 + 1e-4) / (0.25 + 1 + 1e-4);
  CHECK(ssim(at(0.5, 1), at(1, 0)) == doctest::Approx((2 + of_blue) / 3).epsilon(1e-9));
}

TEST_CASE("a picture smaller than a window has no similarity, one of another size is refused") {
  const auto small = test::need(structural_similarity(picture(10, 40, 1, noise), picture(10, 40, 1, noise)));
  CHECK_FALSE(small.has_value());
  CHECK(test::error_of(structural_similarity(picture(12, 12, 1, noise), picture(12, 13, 1, noise))).code ==
        Code::image_mismatch);
}

}  // namespace
}  // namespace selvedge
