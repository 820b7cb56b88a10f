#include "converter/measured/repeats.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "format/base/random.h"

namespace selvedge {
namespace {

/// A picture of four channels; row 0 is on top.
Image picture_of(const V2i& size, const std::function<double(int x, int y)>& value) {
  Image picture{size.x, size.y, 4, {}};
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      const auto v = static_cast<float>(value(x, y));
      for (const float channel : {v, v / 2, 0.0F, 1.0F}) picture.pixels.push_back(channel);
    }
  }
  return picture;
}

TEST_CASE("the period is found to a twentieth of a pixel under noise, not a part of it and not a multiple") {
  const V2d period(17.37, 12.81);
  std::array<Image, 4> pictures;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    Random random(3, i);
    pictures[i] = luminance_of(picture_of({90, 70}, [&](int x, int y) {
      const double a = 2 * std::numbers::pi * x / period.x;
      const double b = 2 * std::numbers::pi * y / period.y;
      // Two bumps a period, not quite alike.
      return 1 + std::sin(2 * a) + 0.5 * std::sin(a) + 0.7 * std::cos(b + a) + 0.4 * (random.uniform() - 0.5);
    }));
  }
  CHECK(std::abs(find_period(pictures, 0).value_or(0) - period.x) < 0.05);
  CHECK(std::abs(find_period(pictures, 1).value_or(0) - period.y) < 0.05);
  // Noise alone, and nothing at all.
  for (const double amplitude : {1.0, 0.0}) {
    Random random(5);
    const std::array<Image, 1> none{
        luminance_of(picture_of({90, 70}, [&](int, int) { return 1 + amplitude * random.uniform(); }))};
    CHECK_FALSE(find_period(none, 0).has_value());
    CHECK_FALSE(find_period(none, 1).has_value());
  }
}

TEST_CASE("texels are means of what they cover of all repeats, from the lower left corner") {
  const RepeatAverage average({12, 8}, {6, 4}, {3, 2});
  const RepeatAverage::Cell cell =
      average.average(picture_of({12, 8}, [](int x, int y) { return x % 6 + 10 * ((7 - y) % 4); }));
  REQUIRE(cell.values.size() == 6);
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 3; ++i) {
      const double expected = 2 * i + 0.5 + 10 * (2 * j + 0.5);
      CHECK(cell.values[j * 3 + i].x == doctest::Approx(expected));
      CHECK(cell.values[j * 3 + i].y == doctest::Approx(expected / 2));
    }
  }
  CHECK(cell.variance == doctest::Approx(0));
  CHECK(average.repeats() == V2d(2, 2));
  // Parts of pixels: a ramp has its value at the centre of every texel, whatever the period.
  const RepeatAverage uneven({12, 8}, {12, 8}, {5, 7});
  const auto ramp = uneven.average(picture_of({12, 8}, [](int x, int) { return x + 0.5; }));
  for (int i = 1; i < 4; ++i) CHECK(ramp.values[i].x == doctest::Approx((i + 0.5) * 12 / 5).epsilon(0.02));
}

TEST_CASE("holes do not count for radiance, and are opacity") {
  const auto open = [](int x, int) { return x % 4 == 0 ? 0.0 : 1.0; };
  const RepeatAverage average({16, 8}, {8, 8}, {4, 1}, picture_of({16, 8}, open));
  const auto cell =
      average.average(picture_of({16, 8}, [&](int x, int y) { return open(x, y) > 0 ? 3 : 77; }));
  const std::vector<float> alpha = average.alpha();
  for (int i = 0; i < 4; ++i) {
    CHECK(cell.values[i].x == doctest::Approx(3));
    CHECK(alpha[i] == doctest::Approx(i % 2 == 0 ? 0.5 : 1));
  }
  const RepeatAverage nothing({16, 8}, {8, 8}, {4, 1}, picture_of({16, 8}, [](int, int) { return 0; }));
  CHECK(nothing.average(picture_of({16, 8}, open)).values[2] == V3f(0, 0, 0));
  CHECK(nothing.alpha()[2] == 0);
}

}  // namespace
}  // namespace selvedge
