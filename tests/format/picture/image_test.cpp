#include "format/picture/image.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <filesystem>

#include "format/base/atomic_file.h"
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
