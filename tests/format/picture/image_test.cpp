#include "format/picture/image.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <filesystem>

#include "format/base/atomic_file.h"
#include "format/picture/display.h"
#include "format/picture/frame.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;
namespace fs = std::filesystem;

namespace {

Image ramp(int width, int height, int channels) {
  Image image{width, height, channels, {}};
  const int count = width * height * channels;
  for (int i = 0; i < count; ++i)
    image.pixels.push_back(static_cast<float>(i) / static_cast<float>(count - 1));
  return image;
}

}  // namespace

TEST_CASE("image: sRGB follows IEC 61966-2-1 and goes there and back") {
  CHECK(srgb_to_linear(0.5F) == doctest::Approx(0.214041).epsilon(1e-5));
  CHECK(linear_to_srgb(0.0031308F) == doctest::Approx(0.04045).epsilon(1e-3));
  for (int i = 0; i < 256; ++i) {
    const float value = static_cast<float>(i) / 255.0F;
    CHECK(linear_to_srgb(srgb_to_linear(value)) == doctest::Approx(value).epsilon(1e-5));
  }
}

TEST_CASE("image: a PNG keeps every stored 8-bit value, transparent pixels included") {
  Image image = ramp(16, 4, 4);
  for (float& value : image.pixels) value = std::round(value * 255.0F) / 255.0F;
  image.pixels[3] = 0.0F;
  const auto bytes = test::need(encode_png(image, Transfer::keep));
  const auto back = test::need(decode_image(bytes, "ramp", Transfer::keep));
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    CHECK(std::abs(back.pixels[i] - image.pixels[i]) < 1e-6F);  // float rounding of n / 255
}

TEST_CASE("image: linear values through an sRGB PNG are off by at most half a code") {
  const Image image = ramp(32, 8, 3);
  const auto bytes = test::need(encode_png(image, Transfer::srgb));
  const auto back = test::need(decode_image(bytes, "ramp", Transfer::srgb));
  for (std::size_t p = 0; p < 256; ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float a = linear_to_srgb(image.pixels[p * 3 + c]);
      const float b = linear_to_srgb(back.pixels[p * 4 + c]);
      CHECK(std::abs(a - b) <= 0.5F / 255.0F + 1e-5F);
    }
    CHECK(back.pixels[p * 4 + 3] == 1.0F);
  }
}

TEST_CASE("image: an EXR keeps floats exactly and is the same each time") {
  const Folder folder;
  Image image = ramp(7, 5, 4);
  image.pixels[0] = 12345.678F;
  image.pixels[1] = -3.0F;
  REQUIRE(write_exr(folder / "a.exr", image));
  REQUIRE(write_exr(folder / "b.exr", image));
  CHECK(*read_file(folder / "a.exr") == *read_file(folder / "b.exr"));
  const auto back = test::need(read_image(folder / "a.exr"));
  CHECK(back.pixels == image.pixels);
}

TEST_CASE("image: halved pictures have the means of the linear pixels under theirs") {
  const Image image = ramp(13, 70, 4);  // more rows than are read at once
  const auto bytes = test::need(encode_png(image, Transfer::srgb));
  const auto whole = test::need(decode_image(bytes, "ramp"));
  for (const int halvings : {0, 1, 2, 3, 9}) {
    const std::vector<Image> levels =
        test::need(decode_levels(bytes, "ramp", Transfer::srgb, {}, std::array{0, halvings}));
    CHECK(levels.front().pixels == whole.pixels);
    const Image& halved = levels.back();
    REQUIRE(halved.width == level_size(13, halvings));
    REQUIRE(halved.height == level_size(70, halvings));
    std::vector<double> sums(halved.pixels.size());
    std::vector<int> counts(halved.pixels.size());
    for (int y = 0; y < whole.height; ++y) {
      for (int x = 0; x < whole.width; ++x) {
        const int at = y * halved.height / whole.height * halved.width + x * halved.width / whole.width;
        for (int c = 0; c < 4; ++c) {
          sums[4 * at + c] += static_cast<double>(whole.pixels[(y * whole.width + x) * 4 + c]);
          ++counts[4 * at + c];
        }
      }
    }
    for (std::size_t i = 0; i < sums.size(); ++i)
      CHECK(static_cast<double>(halved.pixels[i]) == doctest::Approx(sums[i] / counts[i]));
  }
}

TEST_CASE("image: what cannot be read is an error and leaves nothing behind") {
  const Folder folder;
  CHECK(read_image(folder / "none.png").error().code == Code::file_missing);
  const auto bytes = test::need(encode_png(ramp(32, 32, 4)));
  // Not more of the PNG: OpenImageIO 2.4 leaks a few bytes when libpng gives up, and the sanitizer reports.
  CHECK(decode_image({bytes.data(), 8}, "short").error().code == Code::image_unreadable);
  REQUIRE(write_exr(folder / "whole.exr", ramp(32, 32, 4)));
  const std::string exr = *read_file(folder / "whole.exr");
  fs::remove(folder / "whole.exr");
  const std::vector<std::uint8_t> no_texture(exr.begin(), exr.end());
  CHECK(decode_image(no_texture, "an.png").error().code == Code::image_unreadable);
  CHECK(decode_image({}, "empty").error().code == Code::image_unreadable);
  CHECK(decode_image(bytes, "big", Transfer::srgb, {.side = 16}).error().code == Code::file_too_large);
  CHECK(write_png(folder / "absent/a.png", ramp(2, 2, 3)).error().code == Code::file_unwritable);
  CHECK(write_png(folder / "bad.png", Image{2, 2, 3, {1, 2}}).error().code == Code::image_unwritable);
  CHECK(fs::is_empty(folder.path()));
}

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
