// A drawing of boxes, lines, discs, texts and pictures, and its two writers: SVG and PNG show the same.
//
// Units are pixels of the PNG, x to the right, y downwards. Colours are sRGB as a screen takes them.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"
#include "format/picture/image.h"

namespace selvedge {

struct Rgb {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;
  bool operator==(const Rgb&) const = default;
};

struct DrawnBox {
  V2d corner;  ///< top left
  V2d size;
  Rgb fill;
};

/// From point to point, with round ends.
struct DrawnLine {
  std::vector<V2d> points;
  double width = 1;
  Rgb colour;
};

struct DrawnDisc {
  V2d centre;
  double radius = 1;
  Rgb fill;
};

struct DrawnText {
  enum class Anchor { start, middle, end };
  V2d baseline;  ///< where `anchor` of the text stands
  std::string text;
  double size = 13;
  Rgb colour;
  Anchor anchor = Anchor::start;
  bool bold = false;
};

/// Pixel for pixel: viewers of SVG differ in how they enlarge.
struct DrawnPicture {
  V2i corner;
  Image image;  ///< three channels, linear; 1 is white
  std::string title;
};

using Drawn = std::variant<DrawnBox, DrawnLine, DrawnDisc, DrawnText, DrawnPicture>;

/// Later shapes cover earlier ones.
struct Drawing {
  int width = 0;
  int height = 0;
  std::string title;
  Rgb paper{255, 255, 255};
  std::vector<Drawn> shapes;
};

/// One file, its pictures within. The same drawing, the same bytes.
Result<std::string> svg_of(const Drawing& drawing);

/// An 8-bit PNG. Texts need the fonts DejaVu Sans and DejaVu Sans Bold, in which SVG viewers show them too
/// where they have them; IMAGE_UNWRITABLE where they are not found. The same drawing and fonts, the same
/// bytes.
Result<std::vector<std::uint8_t>> png_of(const Drawing& drawing);

}  // namespace selvedge
