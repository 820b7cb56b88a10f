// From linear light to display values: exposure, tone curve, background, sRGB.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "format/picture/frame.h"

namespace selvedge {

/// What becomes of exposed colours c, which know no upper limit.
enum class ToneCurve {
  none,      ///< c, clipped at 1
  reinhard,  ///< c / (1 + Y), Y the luminance: Reinhard, Stark, Shirley and Ferwerda 2002, equation 3
  aces,      ///< c (2.51 c + 0.03) / (c (2.43 c + 0.59) + 0.14) per channel, clipped: Narkowicz 2016, a fit
             ///< to the ACES reference rendering
};

/// As on the command line, in the order of the enumeration.
inline constexpr std::array<std::string_view, 3> tone_curve_names{"none", "reinhard", "aces"};

/// The curve of a colour that is not premultiplied, linear sRGB; not clipped by `none` and
/// `reinhard`.
V3f tone_mapped(ToneCurve curve, const V3f& colour);

struct DisplayOptions {
  float exposure = 1;  ///< factor on radiance
  ToneCurve tone = ToneCurve::none;
  std::optional<V3f> background;  ///< linear, as it shall be shown: neither exposed nor tone mapped
};

/// The defaults of pictures, and the display in which swatches are compared: white that
/// faces a light of irradiance 1 becomes 1, over a dark grey.
DisplayOptions default_display();

/// Linear display values. Over the background if there is one, else with the opacity kept and the colour not
/// premultiplied. Values above 1 are left to be clipped.
Image to_display_image(const Frame& frame, const DisplayOptions& options);

/// The same as bytes for a screen: sRGB-encoded red, green and blue, and 255. Without a background: over
/// black. On all cores.
void to_display_bytes(const Frame& frame, const DisplayOptions& options, std::vector<std::uint8_t>& bytes);

}  // namespace selvedge
