// The PNG of a drawing. Lines, boxes and discs are covered exactly enough by their distance to a pixel's
// centre; OpenImageIO sets the texts.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string_view>
#include <type_traits>

#include "apps/report/drawing.h"
#include "format/picture/openimageio.h"

namespace selvedge {
namespace {

/// The folders of DejaVu on Debian, Fedora and Arch.
constexpr std::array font_folders{"/usr/share/fonts/truetype/dejavu", "/usr/share/fonts/dejavu-sans-fonts",
                                  "/usr/share/fonts/TTF"};

/// OpenImageIO would look in places of its own and take another font.
Result<std::string> font_file(bool bold) {
  const char* name = bold ? "DejaVuSans-Bold.ttf" : "DejaVuSans.ttf";
  for (const char* folder : font_folders) {
    std::string path = fmt::format("{}/{}", folder, name);
    std::error_code error;
    if (std::filesystem::exists(path, error)) return path;
  }
  return fail(Code::image_unwritable, {}, {},
              fmt::format("there is no font {} in {}; Debian's package is fonts-dejavu-core", name,
                          fmt::join(font_folders, ", ")));
}

/// The pixels, encoded as in the file: texts and edges are blended as screens do it.
class Canvas {
 public:
  Canvas(int width, int height, const OpenImageIo& library)
      : library_(library), image_{width, height, 3, std::vector<float>(std::size_t{3} * width * height)} {}

  void draw(const DrawnBox& box) {
    const V2d end = box.corner + box.size;
    cover(box.corner, end, box.fill, [&](double x, double y) {
      const double across = std::min(x + 0.5, end.x) - std::max(x - 0.5, box.corner.x);
      const double down = std::min(y + 0.5, end.y) - std::max(y - 0.5, box.corner.y);
      return std::max(across, 0.0) * std::max(down, 0.0);
    });
  }

  void draw(const DrawnLine& line) {
    if (line.points.empty()) return;
    V2d low = line.points.front();
    V2d high = low;
    for (const V2d& p : line.points) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    const double half = line.width / 2;
    const V2d margin(half + 1, half + 1);
    // The nearest of all pieces: where they meet, nothing is covered twice.
    cover(low - margin, high + margin, line.colour, [&](double x, double y) {
      double nearest = (V2d(x, y) - line.points.front()).length();
      for (std::size_t i = 1; i < line.points.size(); ++i) {
        nearest = std::min(nearest, distance(line.points[i - 1], line.points[i], {x, y}));
      }
      return std::min(half - nearest + 0.5, line.width);
    });
  }

  void draw(const DrawnDisc& disc) {
    const V2d reach(disc.radius + 1, disc.radius + 1);
    cover(disc.centre - reach, disc.centre + reach, disc.fill,
          [&](double x, double y) { return disc.radius - (V2d(x, y) - disc.centre).length() + 0.5; });
  }

  void draw(const DrawnPicture& picture) {
    const Image& image = picture.image;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const float* from = &image.pixels[3 * static_cast<std::size_t>(y * image.width + x)];
        float* to = pixel(picture.corner.x + x, picture.corner.y + y);
        for (int c = 0; c < 3; ++c) to[c] = linear_to_srgb(std::clamp(from[c], 0.0F, 1.0F));
      }
    }
  }

  Result<void> draw(const DrawnText& text) {
    const auto font = font_file(text.bold);
    if (!font) return tl::unexpected(font.error());
    const auto size = static_cast<int>(std::lround(text.size));
    // OpenImageIO 2.4 loses all but six bits of a character beyond ASCII. Degrees are drawn here instead, and
    // nothing else of the kind is set.
    constexpr std::string_view degree = "°";
    std::vector<std::string> pieces(1);
    for (std::size_t i = 0; i < text.text.size(); ++i) {
      if (text.text.compare(i, degree.size(), degree) == 0) {
        pieces.emplace_back();
        i += degree.size() - 1;
      } else {
        const auto byte = static_cast<unsigned char>(text.text[i]);
        if (byte >= 0x20 && byte < 0x7F) pieces.back() += text.text[i];
        if (byte >= 0xC0) pieces.back() += '?';  // once for each character
      }
    }
    const double degree_advance = 0.5 * text.size;
    std::vector<double> widths;
    double width = degree_advance * static_cast<double>(pieces.size() - 1);
    for (const std::string& piece : pieces) {
      widths.push_back(piece.empty() ? 0 : advance(piece, size, *font));
      width += widths.back();
    }
    double x = text.baseline.x;
    if (text.anchor == DrawnText::Anchor::middle) x -= width / 2;
    if (text.anchor == DrawnText::Anchor::end) x -= width;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (auto ok = set(pieces[i], {x, text.baseline.y}, size, *font, text.colour); !ok) return ok;
      x += widths[i];
      if (i + 1 == pieces.size()) break;
      ring({x + degree_advance / 2, text.baseline.y - 0.6 * text.size}, 0.12 * text.size, text.colour);
      x += degree_advance;
    }
    return {};
  }

  const Image& image() const { return image_; }

 private:
  static std::array<float, 3> encoded(const Rgb& colour) {
    return {static_cast<float>(colour.r) / 255, static_cast<float>(colour.g) / 255,
            static_cast<float>(colour.b) / 255};
  }

  float* pixel(int x, int y) { return &image_.pixels[std::size_t{3} * (y * image_.width + x)]; }

  /// Width of a text, spaces at its ends included: OpenImageIO measures what is inked.
  double advance(const std::string& text, int size, const std::string& font) const {
    return library_.text_width("|" + text + "|", size, font) - library_.text_width("||", size, font);
  }

  Result<void> set(const std::string& text, const V2d& at, int size, const std::string& font,
                   const Rgb& colour) {
    if (text.empty()) return {};
    return library_.draw_text(image_, static_cast<int>(std::lround(at.x)),
                              static_cast<int>(std::lround(at.y)), text, size, font, encoded(colour));
  }

  void ring(const V2d& centre, double radius, const Rgb& colour) {
    DrawnLine line{{}, std::max(1.0, radius * 0.7), colour};
    constexpr int corners = 16;
    for (int i = 0; i <= corners; ++i) {
      const double angle = 2 * std::numbers::pi * i / corners;
      line.points.push_back(centre + V2d(std::cos(angle), std::sin(angle)) * radius);
    }
    draw(line);
  }

  static double distance(const V2d& a, const V2d& b, const V2d& p) {
    const V2d along = b - a;
    const double length2 = along.length2();
    const double t = length2 > 0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0.0;
    return (p - a - along * t).length();
  }

  /// Lays a colour over the pixels between two corners, as much as `coverage` says of a pixel's centre.
  template <class Coverage>
  void cover(const V2d& low, const V2d& high, const Rgb& colour, const Coverage& coverage) {
    const std::array<float, 3> over = encoded(colour);
    const int left = std::max(0, static_cast<int>(std::floor(low.x)));
    const int top = std::max(0, static_cast<int>(std::floor(low.y)));
    const int right = std::min(image_.width, static_cast<int>(std::ceil(high.x)));
    const int bottom = std::min(image_.height, static_cast<int>(std::ceil(high.y)));
    for (int y = top; y < bottom; ++y) {
      for (int x = left; x < right; ++x) {
        const auto share = static_cast<float>(std::clamp(coverage(x + 0.5, y + 0.5), 0.0, 1.0));
        if (share == 0) continue;
        float* under = pixel(x, y);
        for (std::size_t c = 0; c < 3; ++c) under[c] += share * (over[c] - under[c]);
      }
    }
  }

  const OpenImageIo& library_;
  Image image_;
};

}  // namespace

Result<std::vector<std::uint8_t>> png_of(const Drawing& drawing) {
  const auto library = load_openimageio(Code::image_unwritable);
  if (!library) return tl::unexpected(library.error());
  Canvas canvas(drawing.width, drawing.height, **library);
  canvas.draw(DrawnBox{{0, 0}, V2d(V2i(drawing.width, drawing.height)), drawing.paper});
  for (const Drawn& shape : drawing.shapes) {
    const auto drawn = std::visit(
        [&](const auto& s) -> Result<void> {
          if constexpr (std::is_same_v<decltype(s), const DrawnText&>) return canvas.draw(s);
          canvas.draw(s);
          return {};
        },
        shape);
    if (!drawn) return tl::unexpected(drawn.error());
  }
  return encode_png(canvas.image(), Transfer::keep);
}

}  // namespace selvedge
