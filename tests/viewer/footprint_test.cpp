#include "format/fabric/footprint.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "format/base/random.h"

namespace selvedge {
namespace {

/// The shares of the texels around a pixel at `centre`, [row][column] of a grid of `side` texels; sum 1.
std::vector<double> shares(const TexelSlopes& slopes, const V2d& centre, int side) {
  const PixelBox box = pixel_box(slopes, pixel_size(slopes));
  std::vector<double> result;
  double sum = 0;
  for (int i = 0; i < side * side; ++i) {
    const V2f away(V2d(i % side + 0.5, i / side + 0.5) - centre);
    CHECK((texel_share(box, away) == 0 || std::abs(away.x) < box.reach.x));
    CHECK((texel_share(box, away) == 0 || std::abs(away.y) < box.reach.y));
    result.push_back(static_cast<double>(texel_share(box, away)));
    sum += result.back();
  }
  for (double& share : result) share /= sum;
  return result;
}

TEST_CASE("the shares of texels are their areas under a pixel that lies as they do") {
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    const V2d size(1 + 2.2 * random.uniform(), 1 + 2.2 * random.uniform());
    const V2d centre(8 + random.uniform(), 8 + random.uniform());
    const auto found = shares({V2f(V2d(size.x, 0)), V2f(V2d(0, -size.y))}, centre, 16);
    const auto overlap = [](double first, double middle, double width) {
      return std::max(std::min(first + 1, middle + width / 2) - std::max(first, middle - width / 2), 0.0);
    };
    for (int k = 0; k < 256; ++k) {
      CHECK(found[k] == doctest::Approx(overlap(k % 16, centre.x, size.x) *
                                        overlap(k / 16, centre.y, size.y) / (size.x * size.y))
                            .epsilon(1e-4));
    }
  }
}

TEST_CASE("under a turned pixel a few per cent of the area go to a texel beside the right one") {
  Random random(5);
  double sum = 0;
  double worst = 0;
  constexpr int pixels = 300;
  for (int i = 0; i < pixels; ++i) {
    const double angle = 2 * 3.14159265 * random.uniform();
    const double wide = 1.4 + 1.4 * random.uniform();
    const double high = wide * (0.5 + 0.5 * random.uniform());
    const V2d right = wide * V2d(std::cos(angle), std::sin(angle));
    const V2d up = high * V2d(-std::sin(angle), std::cos(angle));
    const V2d centre(8 + random.uniform(), 8 + random.uniform());
    const std::vector<double> found = shares({V2f(right), V2f(up)}, centre, 16);
    std::vector<double> area(256);
    constexpr int points = 100;
    for (int k = 0; k < points * points; ++k) {
      const V2d at =
          centre + right * ((k % points + 0.5) / points - 0.5) + up * ((k / points + 0.5) / points - 0.5);
      area[static_cast<int>(at.y) * 16 + static_cast<int>(at.x)] += 1.0 / (points * points);
    }
    double wrong = 0;
    for (int k = 0; k < 256; ++k) wrong += std::abs(area[k] - found[k]) / 2;
    sum += wrong;
    worst = std::max(worst, wrong);
  }
  MESSAGE("on the average " << sum / pixels << ", at most " << worst);
  CHECK(sum / pixels < 0.06);
  CHECK(worst < 0.15);
}

TEST_CASE("what a pixel's coordinates do not tell is level 0") {
  CHECK(std::log2(pixel_size(TexelSlopes{{0, 0}, {0, 0}})) < 0);
  const PixelBox box = pixel_box(TexelSlopes{{0, 0}, {0, 0}}, 1e-12F);
  CHECK(texel_share(box, {0, 0}) == 1);
}

TEST_CASE("pixels smaller than a texel show the texels around, by their distance") {
  const PixelBox box = pixel_box(TexelSlopes{{0.01F, 0}, {0, 0.01F}}, 0.01F);
  for (const V2f& away : {V2f(0.2F, -0.7F), V2f(0, 0), V2f(-0.9F, 0.4F), V2f(1.1F, 0)}) {
    const float expected = std::max(1 - std::abs(away.x), 0.0F) * std::max(1 - std::abs(away.y), 0.0F);
    CHECK(texel_share(box, away) == doctest::Approx(expected));
  }
}

}  // namespace
}  // namespace selvedge
