#include "format/picture/display.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/base/parallel.h"

namespace selvedge {
namespace {

constexpr int table_size = 1 << 16;

/// sRGB bytes of (i + 0.5) / table_size. They differ from exact ones only next to a value where bytes change.
const std::vector<std::uint8_t>& srgb_table() {
  static const std::vector<std::uint8_t> table = [] {
    std::vector<std::uint8_t> result(table_size);
    for (int i = 0; i < table_size; ++i) {
      const float linear = (static_cast<float>(i) + 0.5F) / table_size;
      result[i] = static_cast<std::uint8_t>(std::lround(255 * linear_to_srgb(linear)));
    }
    return result;
  }();
  return table;
}

/// Logarithms of colours in primaries of Rec. 2020 that are moved inwards, a curve over 16.5 stops about mid
/// grey, and back; matrices act on rows. The curve is the polynomial of B. Wrensch, "Minimal AgX" (2023).
V3f agx(const V3f& colour) {
  const Imath::M33f to_2020(0.6274F, 0.0691F, 0.0164F, 0.3293F, 0.9195F, 0.088F, 0.0433F, 0.0113F, 0.8956F);
  const Imath::M33f from_2020(1.6605F, -0.1246F, -0.0182F, -0.5876F, 1.1329F, -0.1006F, -0.0728F, -0.0083F,
                              1.1187F);
  const Imath::M33f inwards(0.856627F, 0.137319F, 0.111898F, 0.0951212F, 0.761242F, 0.0767994F, 0.0482516F,
                            0.101439F, 0.811302F);
  const Imath::M33f outwards(1.1271F, -0.14133F, -0.14133F, -0.110607F, 1.157824F, -0.110607F, -0.0164939F,
                             -0.0164939F, 1.251936F);
  constexpr float min_stop = -12.47393F;
  constexpr float stops = 16.5F;
  V3f c = colour * to_2020 * inwards;
  for (int i = 0; i < 3; ++i) {
    const float x = std::clamp((std::log2(std::max(c[i], 1e-10F)) - min_stop) / stops, 0.0F, 1.0F);
    c[i] =
        -0.00232F + x * (0.1191F + x * (0.4298F + x * (-6.868F + x * (31.96F + x * (-40.14F + x * 15.5F)))));
  }
  c = c * outwards;
  for (int i = 0; i < 3; ++i) c[i] = std::pow(std::max(c[i], 0.0F), 2.2F);
  c = c * from_2020;
  for (int i = 0; i < 3; ++i) c[i] = std::clamp(c[i], 0.0F, 1.0F);
  return c;
}

}  // namespace

V3f tone_map(ToneCurve curve, const V3f& colour) {
  switch (curve) {
    case ToneCurve::none:
      break;
    case ToneCurve::neutral: {
      constexpr float start = 0.8F - 0.04F;
      constexpr float desaturation = 0.15F;
      const float least = std::max(0.0F, std::min({colour.x, colour.y, colour.z}));
      const V3f base = colour - V3f(least < 0.08F ? least - 6.25F * least * least : 0.04F);
      const float peak = std::max({base.x, base.y, base.z});
      if (peak < start) return base;
      const float d = 1 - start;
      const float shown = 1 - d * d / (peak + d - start);
      const float grey = 1 - 1 / (desaturation * (peak - shown) + 1);
      return base * (shown / peak) * (1 - grey) + V3f(shown * grey);
    }
    case ToneCurve::agx:
      return agx(colour);
  }
  return colour;
}

DisplayOptions default_display() { return {std::numbers::pi_v<float>, ToneCurve::none, V3f(0.18F)}; }
DisplayOptions environment_display() { return {1, ToneCurve::neutral, V3f(0.8F)}; }

V3f display_colour(const V4f& pixel, const DisplayOptions& options) {
  V3f colour = V3f(pixel.x, pixel.y, pixel.z) * options.exposure;  // times opacity
  if (options.tone_curve != ToneCurve::none && pixel.w > 0)
    colour = tone_map(options.tone_curve, colour / pixel.w) * pixel.w;
  return colour + options.background.value_or(V3f(0, 0, 0)) * (1 - pixel.w);
}

Image to_display_image(const Frame& frame, const DisplayOptions& options) {
  Image image{frame.width, frame.height, options.background ? 3 : 4, {}};
  image.pixels.reserve(frame.pixels.size() * image.channels);
  for (const V4f& p : frame.pixels) {
    V3f colour = display_colour(p, options);
    if (!options.background && p.w > 0) colour /= p.w;
    image.pixels.insert(image.pixels.end(), {colour.x, colour.y, colour.z});
    if (!options.background) image.pixels.push_back(p.w);
  }
  return image;
}

void to_display_bytes(const Frame& frame, const DisplayOptions& options, std::vector<std::uint8_t>& bytes) {
  const std::vector<std::uint8_t>& table = srgb_table();
  const std::size_t width = frame.width;
  bytes.resize(frame.pixels.size() * 4);
  parallel_for(0, frame.height, [&](int y) {
    for (std::size_t i = y * width; i < (y + 1) * width; ++i) {
      const V3f colour = display_colour(frame.pixels[i], options);
      for (int c = 0; c < 3; ++c) {
        const float clipped = colour[c] > 0 ? std::min(colour[c], 1.0F) : 0.0F;  // NaN becomes 0
        bytes[4 * i + c] = table[std::min(static_cast<int>(clipped * table_size), table_size - 1)];
      }
      bytes[4 * i + 3] = 255;
    }
  });
}

}  // namespace selvedge
