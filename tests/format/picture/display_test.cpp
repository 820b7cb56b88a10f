#include "format/picture/display.h"

#include <doctest/doctest.h>

#include <cmath>

namespace selvedge {
namespace {

TEST_CASE("a background shows through by what opacity leaves") {
  const Frame frame{1, 1, {V4f(0.25F, 0.5F, 0, 0.75F)}};
  const Image image = to_display_image(frame, {2, ToneCurve::none, V3f(0.4F, 0.4F, 0.8F)});
  CHECK(image.channels == 3);
  CHECK(image.pixels[0] == doctest::Approx(0.25 * 2 + 0.25 * 0.4));
  CHECK(image.pixels[1] == doctest::Approx(0.5 * 2 + 0.25 * 0.4));
  CHECK(image.pixels[2] == doctest::Approx(0.25 * 0.8));
}

TEST_CASE("without background colour is divided by opacity, and empty pixels stay finite") {
  const Frame frame{2, 1, {V4f(0.25F, 0.5F, 0, 0.5F), V4f(0, 0, 0, 0)}};
  const Image image = to_display_image(frame, {2, ToneCurve::none, std::nullopt});
  CHECK(image.pixels == std::vector<float>{1, 2, 0, 0.5F, 0, 0, 0, 0});
}

TEST_CASE("Khronos PBR Neutral leaves colours below 0.8 but for 0.04, and keeps hues above") {
  const auto neutral = [](const V3f& c) { return tone_map(ToneCurve::neutral, c); };
  CHECK(neutral(V3f(0)) == V3f(0));
  CHECK(neutral(V3f(0.04F)).x == doctest::Approx(6.25 * 0.0016));
  CHECK(neutral(V3f(0.7F, 0.5F, 0.1F)).y == doctest::Approx(0.46));
  CHECK(neutral(V3f(1e6F)).x == doctest::Approx(1));
  // Saturated red: 1.96 is shown as 1 - 0.24^2 / 1.44, and greys by what it loses.
  const V3f red = neutral(V3f(2, 0.04F + 0.1F, 0.04F + 0.1F));
  const double shown = 1 - 0.24 * 0.24 / (1.96 + 0.24 - 0.76);
  const double grey = 1 - 1 / (0.15 * (1.96 - shown) + 1);
  CHECK(red.x == doctest::Approx(shown));
  CHECK(red.y == doctest::Approx(0.1 * shown / 1.96 * (1 - grey) + shown * grey));
}

TEST_CASE("the AgX curve has the values of three.js 0.187") {
  const std::vector<std::pair<V3f, V3f>> cases{{{0, 0, 0}, {0, 0, 0}},
                                               {{0.18F, 0.18F, 0.18F}, {0.21455F, 0.2145F, 0.2145F}},
                                               {{1, 1, 1}, {0.59022F, 0.59014F, 0.5901F}},
                                               {{0.8F, 0.1F, 0.05F}, {0.60762F, 0.17716F, 0.11252F}},
                                               {{0.02F, 0.05F, 0.6F}, {0.04086F, 0.13643F, 0.54842F}},
                                               {{4, 3, 0.2F}, {0.88044F, 0.80697F, 0.51724F}},
                                               {{40, 2, 40}, {1, 0.9551F, 1}},
                                               {{1e4F, 1e4F, 1e4F}, {0.99698F, 0.99688F, 0.99678F}}};
  for (const auto& [colour, wanted] : cases)
    CHECK((tone_map(ToneCurve::agx, colour) - wanted).length() < 1e-4F);
}

TEST_CASE("a tone curve leaves the background and the opacity alone") {
  const Frame frame{2, 1, {V4f(0, 0, 0, 0), V4f(1.5F, 1.5F, 1.5F, 0.5F)}};
  for (const ToneCurve tone_curve : {ToneCurve::none, ToneCurve::neutral, ToneCurve::agx}) {
    const Image image = to_display_image(frame, {1, tone_curve, V3f(0.9F)});
    CHECK(image.pixels[0] == 0.9F);
    const float cloth = tone_map(tone_curve, V3f(3)).x;
    CHECK(image.pixels[3] == doctest::Approx(0.5 * cloth + 0.5 * 0.9));
    CHECK(to_display_image(frame, {1, tone_curve, std::nullopt}).pixels[7] == 0.5F);
  }
}

TEST_CASE("bytes for a screen are within one step of sRGB") {
  Frame frame{1000, 2, {}};
  for (int i = 0; i < 2000; ++i) {
    const float x = static_cast<float>(i) / 1600;
    frame.pixels.emplace_back(x, x * x, std::nanf(""), 1.0F);
  }
  const DisplayOptions options{1, ToneCurve::none, V3f(0.2F)};
  std::vector<std::uint8_t> bytes;
  to_display_bytes(frame, options, bytes);
  REQUIRE(bytes.size() == 8000);
  double worst = 0;
  for (std::size_t i = 0; i < 2000; ++i) {
    for (unsigned c = 0; c < 2; ++c) {
      const double exact =
          255 * static_cast<double>(linear_to_srgb(std::min(frame.pixels[i][static_cast<int>(c)], 1.0F)));
      worst = std::max(worst, std::abs(exact - bytes[4 * i + c]));
    }
    CHECK(bytes[4 * i + 2] == 0);
    CHECK(bytes[4 * i + 3] == 255);
  }
  // Half a step of rounding, and 12.92 * 255 / 65536 / 2 of the table.
  CHECK(worst <= 0.5 + 0.03);
}

}  // namespace
}  // namespace selvedge
