#include "converter/stitch/textile.h"

#include <algorithm>
#include <cmath>

#include "converter/stitch/fibres.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/guard.h"

namespace selvedge {
namespace {

/// Rays along either side of a repeat.
constexpr int rays = 192;

/// Fraction of the covered area that rises above the plates of a thickness gauge, into their bearing.
constexpr double bearing = 0.25;

Yarns traceable(StitchPattern pattern, bool hairs) {
  for (Yarn& yarn : pattern.yarns) yarn.hairiness = hairs ? yarn.hairiness : 0;
  YarnData data = value_or_throw(yarn_curves_of(pattern));
  data.light.resize(std::size_t{light_values_per_station} * counts_of(data).stations);
  value_or_throw(validate(data, V2f(pattern.period_mm)));
  return {std::move(data), V2f(pattern.period_mm)};
}

/// Heights of the yarn, mm, where rays from above meet it.
std::vector<float> heights_seen(const Yarns& yarns) {
  std::vector<float> heights;
  for (int y = 0; y < rays; ++y) {
    for (int x = 0; x < rays; ++x) {
      const auto hit = yarns.trace(V2d((x + 0.5) / rays, (y + 0.5) / rays), 0, V3f(0, 0, 1));
      if (hit) heights.push_back(yarns.inside().segments[hit->segment].start.z + hit->from_start.z);
    }
  }
  return heights;
}

double cover_of(const std::vector<float>& heights) {
  return static_cast<double>(heights.size()) / (rays * rays);
}

double plate_height(std::vector<float> heights) {
  const auto plate =
      heights.begin() + static_cast<std::ptrdiff_t>((1 - bearing) * static_cast<double>(heights.size()));
  std::nth_element(heights.begin(), plate, heights.end());
  return *plate;
}

}  // namespace

Result<TextileNumbers> textile_numbers(const StitchPattern& pattern, int stitches) {
  return result_of([&] {
    TextileNumbers numbers;
    double weight = 0;
    double length = 0;
    double roots = 0;
    for (const Yarn& yarn : pattern.yarns) {
      const double tex = tex_of(yarn.radius_mm, yarn.fibre, yarn.packing);
      double own = 0;
      for (const BezierSegment& segment : yarn.segments) own += polygon_length(segment);
      numbers.tex.push_back(tex);
      weight += tex * own;
      roots += std::sqrt(tex) * own;
      length += own;
    }
    numbers.weight = weight / (pattern.period_mm.x * pattern.period_mm.y);
    if (stitches > 0) numbers.tightness = roots / length * 10 * stitches / length;
    const Yarns yarns = traceable(pattern, false);
    const std::vector<float> heights = heights_seen(yarns);
    const Yarns turned(turned_over(yarns, 0), yarns.period());
    numbers.thickness_mm = plate_height(heights) + plate_height(heights_seen(turned));
    numbers.cover = cover_of(heights);
    numbers.cover_hairs = cover_of(heights_seen(traceable(pattern, true)));
    return numbers;
  });
}

}  // namespace selvedge
