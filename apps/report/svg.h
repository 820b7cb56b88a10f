// A drawing as SVG text.
//
// Units are pixels, x to the right, y downwards. Colours are CSS's. Later shapes cover earlier ones. The same
// drawing gives the same bytes.
#pragma once

#include <string>
#include <vector>

#include "format/base/vec.h"
#include "format/picture/image.h"

namespace selvedge {

// Vermilion, blue and bluish green of Okabe and Ito's palette, which colour-blind eyes tell apart.
inline constexpr const char* vermilion = "#d55e00";
inline constexpr const char* blue = "#0072b2";
inline constexpr const char* green = "#009e73";
inline constexpr const char* ink = "#1b1f24";
inline constexpr const char* muted = "#626b76";
inline constexpr const char* hairline = "#d0d5dc";
inline constexpr const char* panel = "#f6f7f9";

/// Text within an element or an attribute in double quotes. Bytes that are not UTF-8 and control characters
/// are replaced as on a terminal.
std::string escaped(const std::string& text);

std::string base64(std::span<const std::uint8_t> bytes);

/// The bytes of a PNG as the address of a picture that contains it.
std::string png_address(std::span<const std::uint8_t> bytes);

class Svg {
 public:
  enum class Anchor { start, middle, end };

  void box(const V2d& corner, const V2d& size, const char* fill);
  /// From point to point, with round ends.
  void line(const std::vector<V2d>& points, double width, const char* colour);
  void disc(const V2d& centre, double radius, const char* fill);
  /// `at`: where the anchor of the text stands on its baseline.
  void text(const V2d& at, const std::string& words, double size, const char* colour,
            Anchor anchor = Anchor::start, bool bold = false);
  /// Pixel for pixel, with a hairline around it. `image`: three channels, linear. Errors of encode_png().
  Result<void> picture(const V2d& corner, const Image& image, const std::string& title);

  /// The whole file.
  std::string file(int width, int height, const std::string& title) const;

 private:
  std::string shapes_;
};

}  // namespace selvedge
