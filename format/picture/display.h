// The display transform, from linear light to display values: exposure, tone curve, background, sRGB.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "format/picture/frame.h"

namespace selvedge {

/// Maps exposed colours c, which have no upper limit, to display values.
enum class ToneCurve {
  none,     ///< c, clipped at 1
  neutral,  ///< Khronos PBR Neutral (2024): hues stay, and colours below 0.8 but for 0.04 of the surface's
            ///< reflection
  agx,      ///< AgX (Sobotka 2022) as Blender's default look and three.js have it: bright colours turn white
};

/// Names on the command line, in the order of the enumeration.
inline constexpr std::array<std::string_view, 3> tone_curve_names{"none", "neutral", "agx"};

/// Applies the curve to a linear sRGB colour that is not premultiplied; `none` does not clip.
V3f tone_map(ToneCurve curve, const V3f& colour);

struct DisplayOptions {
  float exposure = 1;  ///< factor on radiance
  ToneCurve tone_curve = ToneCurve::none;
  std::optional<V3f> background;  ///< linear display values: neither exposed nor tone mapped
};

/// The default of pictures, in which swatches are also compared: white that faces a light of irradiance 1
/// becomes 1; the background is dark grey.
DisplayOptions default_display();
/// The default in an environment: saturated colours stay, before a light backdrop.
DisplayOptions environment_display();

/// Linear display value of a pixel over the background, or without one over black; not clipped.
V3f display_colour(const V4f& pixel, const DisplayOptions& options);

/// Linear display values: three channels over the background, or without one four channels, not
/// premultiplied. Values above 1 are not clipped.
Image to_display_image(const Frame& frame, const DisplayOptions& options);

/// Display values as bytes for a screen: sRGB-encoded red, green and blue, and 255. Without a background:
/// over black. On all cores.
void to_display_bytes(const Frame& frame, const DisplayOptions& options, std::vector<std::uint8_t>& bytes);

}  // namespace selvedge
