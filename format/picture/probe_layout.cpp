#include "format/picture/probe_layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace selvedge {
namespace {

/// Pixels; smaller squares are icons and layers of fabrics.
constexpr int min_ball = 64;

/// A rectangle of the picture, in pixels, and a place in it.
struct ProbePlace {
  V2i low;
  V2i high;
  V2d at;
};

/// The face of a cube that a direction meets, as it lies in a cross.
ProbePlace in_cross(const V3d& d, ProbeLayout layout, int side) {
  // Column and row in the cross; right and down in the face.
  struct Face {
    V3d out;
    V3d right;
    V3d down;
    V2i vertical;
    V2i horizontal;
  };
  static const std::array<Face, 6> faces{{
      {V3d(0, 0, -1), V3d(1, 0, 0), V3d(0, -1, 0), V2i(1, 1), V2i(1, 1)},
      {V3d(-1, 0, 0), V3d(0, 0, -1), V3d(0, -1, 0), V2i(0, 1), V2i(0, 1)},
      {V3d(1, 0, 0), V3d(0, 0, 1), V3d(0, -1, 0), V2i(2, 1), V2i(2, 1)},
      {V3d(0, 1, 0), V3d(1, 0, 0), V3d(0, 0, -1), V2i(1, 0), V2i(1, 0)},
      {V3d(0, -1, 0), V3d(1, 0, 0), V3d(0, 0, 1), V2i(1, 2), V2i(1, 2)},
      {V3d(0, 0, 1), V3d(-1, 0, 0), V3d(0, -1, 0), V2i(1, 3), V2i(3, 1)},
  }};
  const Face& face = *std::ranges::max_element(faces, {}, [&](const Face& f) { return f.out.dot(d); });
  V2d at = V2d(face.right.dot(d), face.down.dot(d)) / face.out.dot(d);
  const bool vertical = layout == ProbeLayout::vertical_cross;
  if (vertical && face.out.z > 0) at = -at;  // upside down
  const V2i low = (vertical ? face.vertical : face.horizontal) * side;
  return {low, low + V2i(side), V2d(low) + (at + V2d(1)) * (0.5 * side)};
}

ProbePlace in_ball(const V3d& d, int side) {
  const double across = std::hypot(d.x, d.y);
  const double radius = std::acos(std::clamp(-d.z, -1.0, 1.0)) / std::numbers::pi;
  const V2d at = across > 0 ? V2d(d.x, -d.y) * (radius / across) : V2d(radius, 0);
  return {V2i(0), V2i(side), (at + V2d(1)) * (0.5 * side)};
}

/// The mean of the four pixels about a place, weighted by their distance; its rectangle goes on at its edges.
void interpolate(const Image& image, const ProbePlace& place, float* pixel) {
  const V2d from = place.at - V2d(0.5);
  const V2i corner(static_cast<int>(std::floor(from.x)), static_cast<int>(std::floor(from.y)));
  for (int k = 0; k < 4; ++k) {
    const int x = corner.x + k % 2;
    const int y = corner.y + k / 2;
    const double weight = (1 - std::abs(from.x - x)) * (1 - std::abs(from.y - y));
    const std::size_t column = std::clamp(x, place.low.x, place.high.x - 1);
    const std::size_t row = std::clamp(y, place.low.y, place.high.y - 1);
    for (int c = 0; c < 4; ++c)
      pixel[c] += static_cast<float>(weight) * image.pixels[4 * (row * image.width + column) + c];
  }
}

}  // namespace

std::optional<ProbeLayout> probe_layout(const V2i& size) {
  if (size.x == 2 * size.y) return ProbeLayout::equirectangular;
  if (4 * size.x == 3 * size.y) return ProbeLayout::vertical_cross;
  if (3 * size.x == 4 * size.y) return ProbeLayout::horizontal_cross;
  if (size.x == size.y && size.x >= min_ball) return ProbeLayout::ball;
  return std::nullopt;
}

int equirectangular_width(ProbeLayout layout, const V2i& size) {
  switch (layout) {
    case ProbeLayout::vertical_cross:
      return 4 * (size.x / 3);
    case ProbeLayout::ball:
      return size.x + size.x % 2;
    default:
      return size.x;
  }
}

Image equirectangular(const Image& probe, ProbeLayout layout) {
  const int width = equirectangular_width(layout, {probe.width, probe.height});
  Image result{width, width / 2, 4, {}};
  result.pixels.resize(std::size_t{4} * width * (width / 2));
  for (int y = 0; y < result.height; ++y) {
    const double polar = (y + 0.5) / result.height * std::numbers::pi;
    for (int x = 0; x < width; ++x) {
      const double azimuth = ((x + 0.5) / width - 0.5) * 2 * std::numbers::pi;
      const V3d d(std::sin(azimuth) * std::sin(polar), std::cos(polar), -std::cos(azimuth) * std::sin(polar));
      const ProbePlace place =
          layout == ProbeLayout::ball
              ? in_ball(d, probe.width)
              : in_cross(d, layout, probe.width / (layout == ProbeLayout::vertical_cross ? 3 : 4));
      interpolate(probe, place, &result.pixels[std::size_t{4} * (std::size_t{1} * y * width + x)]);
    }
  }
  return result;
}

}  // namespace selvedge
