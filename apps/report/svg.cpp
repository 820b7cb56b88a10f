#include "apps/report/svg.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "format/base/printable.h"

namespace selvedge {
namespace {

/// A coordinate to a hundredth of a pixel, without zeros at its end.
std::string number(double value) { return fmt::format("{:g}", std::round(value * 100) / 100); }

}  // namespace

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : printable(as_utf8(text))) {
    const char* entity = c == '&'   ? "&amp;"
                         : c == '<' ? "&lt;"
                         : c == '>' ? "&gt;"
                         : c == '"' ? "&quot;"
                                    : "";
    result += *entity == '\0' ? std::string(1, c) : entity;
  }
  return result;
}

std::string base64(std::span<const std::uint8_t> bytes) {
  static constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t j = 0; j < 3; ++j) bits = bits << 8 | (j < count ? bytes[i + j] : 0U);
    for (std::size_t j = 0; j < 4; ++j) text += j <= count ? digits[bits >> (18 - 6 * j) & 63] : '=';
  }
  return text;
}

std::string png_address(std::span<const std::uint8_t> bytes) {
  return "data:image/png;base64," + base64(bytes);
}

void Svg::box(const V2d& corner, const V2d& size, const char* fill) {
  shapes_ += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"/>\n",
                         number(corner.x), number(corner.y), number(size.x), number(size.y), fill);
}

void Svg::line(const std::vector<V2d>& points, double width, const char* colour) {
  std::string list;
  for (const V2d& p : points)
    list += fmt::format("{}{},{}", list.empty() ? "" : " ", number(p.x), number(p.y));
  shapes_ += fmt::format(
      "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\" "
      "stroke-linejoin=\"round\"/>\n",
      list, colour, number(width));
}

void Svg::disc(const V2d& centre, double radius, const char* fill) {
  shapes_ += fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{}\"/>\n", number(centre.x),
                         number(centre.y), number(radius), fill);
}

void Svg::text(const V2d& at, const std::string& words, double size, const char* colour, Anchor anchor,
               bool bold) {
  constexpr std::array anchors{"start", "middle", "end"};
  shapes_ +=
      fmt::format("<text x=\"{}\" y=\"{}\" font-size=\"{}\" text-anchor=\"{}\"{} fill=\"{}\">{}</text>\n",
                  number(at.x), number(at.y), number(size), anchors[static_cast<std::size_t>(anchor)],
                  bold ? " font-weight=\"bold\"" : "", colour, escaped(words));
}

Result<void> Svg::picture(const V2d& corner, const Image& image, const std::string& title) {
  const auto png = encode_png(image);
  if (!png) return tl::unexpected(png.error());
  box(corner - V2d(1, 1), V2d(image.width + 2, image.height + 2), hairline);
  shapes_ += fmt::format(
      "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" style=\"image-rendering:pixelated\" "
      "href=\"{}\"><title>{}</title></image>\n",
      number(corner.x), number(corner.y), image.width, image.height, png_address(*png), escaped(title));
  return {};
}

std::string Svg::file(int width, int height, const std::string& title) const {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"'DejaVu Sans', Verdana, sans-serif\">\n<title>{2}</title>\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n{3}</svg>\n",
      width, height, escaped(title), shapes_);
}

}  // namespace selvedge
