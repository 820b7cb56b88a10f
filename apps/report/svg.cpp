#include <fmt/format.h>

#include <array>
#include <cmath>

#include "apps/report/drawing.h"
#include "apps/report/markup.h"

namespace selvedge {
namespace {

std::string hex(const Rgb& colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", colour.r, colour.g, colour.b);
}

/// A coordinate to a hundredth of a pixel, without zeros at its end.
std::string number(double value) { return fmt::format("{:g}", std::round(value * 100) / 100); }

Result<std::string> element(const DrawnBox& box) {
  return fmt::format(R"(<rect x="{}" y="{}" width="{}" height="{}" fill="{}"/>)", number(box.corner.x),
                     number(box.corner.y), number(box.size.x), number(box.size.y), hex(box.fill));
}

Result<std::string> element(const DrawnLine& line) {
  std::string points;
  for (const V2d& p : line.points)
    points += fmt::format("{}{},{}", points.empty() ? "" : " ", number(p.x), number(p.y));
  return fmt::format(
      R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="{}" stroke-linecap="round" stroke-linejoin="round"/>)",
      points, hex(line.colour), number(line.width));
}

Result<std::string> element(const DrawnDisc& disc) {
  return fmt::format(R"(<circle cx="{}" cy="{}" r="{}" fill="{}"/>)", number(disc.centre.x),
                     number(disc.centre.y), number(disc.radius), hex(disc.fill));
}

Result<std::string> element(const DrawnText& text) {
  constexpr std::array anchors{"start", "middle", "end"};
  return fmt::format(R"(<text x="{}" y="{}" font-size="{}" text-anchor="{}"{} fill="{}">{}</text>)",
                     number(text.baseline.x), number(text.baseline.y), number(text.size),
                     anchors[static_cast<std::size_t>(text.anchor)],
                     text.bold ? R"( font-weight="bold")" : "", hex(text.colour), escaped(text.text));
}

Result<std::string> element(const DrawnPicture& picture) {
  const auto png = encode_png(picture.image);
  if (!png) return tl::unexpected(png.error());
  return fmt::format(
      R"(<image x="{}" y="{}" width="{}" height="{}" style="image-rendering:pixelated" href="data:image/png;base64,{}"><title>{}</title></image>)",
      picture.corner.x, picture.corner.y, picture.image.width, picture.image.height, base64(*png),
      escaped(picture.title));
}

}  // namespace

Result<std::string> svg_of(const Drawing& drawing) {
  std::string text = fmt::format(
      R"(<svg xmlns="http://www.w3.org/2000/svg" width="{0}" height="{1}" viewBox="0 0 {0} {1}" font-family="'DejaVu Sans', Verdana, sans-serif">
<title>{2}</title>
<rect width="{0}" height="{1}" fill="{3}"/>
)",
      drawing.width, drawing.height, escaped(drawing.title), hex(drawing.paper));
  for (const Drawn& shape : drawing.shapes) {
    const auto drawn = std::visit([](const auto& s) { return element(s); }, shape);
    if (!drawn) return tl::unexpected(drawn.error());
    text += *drawn + '\n';
  }
  return text + "</svg>\n";
}

}  // namespace selvedge
