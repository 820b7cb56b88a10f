#include "converter/stitch/textile.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "converter/stitch/fibres.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/guard.h"
#include "format/cells/splat.h"

namespace selvedge {
namespace {

/// Rays along either side of a repeat.
constexpr int rays = 192;

/// Fraction of the covered area that rises above the plates of a thickness gauge, into their bearing.
constexpr double bearing = 0.25;

YarnData curves_of(const StitchPattern& pattern) {
  YarnData data = value_or_throw(yarn_curves_of(pattern));
  data.station_light.resize(std::size_t{light_values_per_station} * counts_of(data).stations);
  value_or_throw(validate(data, V2f(pattern.period_mm)));
  return data;
}

/// Heights of the yarn, mm, where rays from above meet it.
std::vector<float> heights_seen(const Yarns& yarns) {
  const CellYarn cell(yarns, 0, {});
  DepthGrid seen;
  seen.resize({.repeat_samples = {rays, rays}}, false);
  splat(cell, cell.pieces(0), {}, seen);
  std::vector<float> heights;
  for (int y = 0; y < rays; ++y) {
    const auto row = seen.z.begin() + static_cast<std::ptrdiff_t>(y) * seen.stride;
    std::copy_if(row, row + rays, std::back_inserter(heights), [](float z) { return z > no_depth; });
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
  return catch_failure([&] {
    TextileNumbers numbers;
    double weight = 0;
    double length = 0;
    double roots = 0;
    for (const Yarn& yarn : pattern.yarns) {
      const double tex = tex_of(yarn.radius_mm, yarn.fibre_kind, yarn.packing);
      const double own = polygon_length(yarn.segments);
      numbers.tex.push_back(tex);
      weight += tex * own;
      roots += std::sqrt(tex) * own;
      length += own;
    }
    numbers.weight_g_per_m2 = weight / (pattern.period_mm.x * pattern.period_mm.y);
    if (stitches > 0) numbers.tightness = roots / length * 10 * stitches / length;
    YarnData data = curves_of(pattern);
    numbers.cover_fraction_with_hairs = cover_of(heights_seen({data, V2f(pattern.period_mm)}));
    for (YarnCurve& curve : data.curves) curve.hairs = {};
    const Yarns yarns(std::move(data), V2f(pattern.period_mm));
    const std::vector<float> heights = heights_seen(yarns);
    numbers.thickness_mm =
        plate_height(heights) + plate_height(heights_seen({turned_over(yarns, 0), yarns.period()}));
    numbers.cover_fraction = cover_of(heights);
    return numbers;
  });
}

}  // namespace selvedge
