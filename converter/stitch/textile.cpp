#include "converter/stitch/textile.h"

#include <cmath>

#include "converter/stitch/fibres.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/guard.h"

namespace selvedge {
namespace {

/// Rays along either side of a repeat.
constexpr int rays = 192;

double cover_of(const StitchPattern& pattern, bool hairs) {
  StitchPattern seen = pattern;
  for (Yarn& yarn : seen.yarns) yarn.hairiness = hairs ? yarn.hairiness : 0;
  YarnData data = value_or_throw(yarn_curves_of(seen));
  data.light.resize(std::size_t{light_values_per_station} * counts_of(data).stations);
  value_or_throw(validate(data, V2f(pattern.period_mm)));
  const Yarns yarns(std::move(data), V2f(pattern.period_mm));
  double covered = 0;
  for (int y = 0; y < rays; ++y) {
    for (int x = 0; x < rays; ++x) {
      if (yarns.trace(V2d((x + 0.5) / rays, (y + 0.5) / rays), 0, V3f(0, 0, 1))) ++covered;
    }
  }
  return covered / (rays * rays);
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
    numbers.cover = cover_of(pattern, false);
    numbers.cover_hairs = cover_of(pattern, true);
    return numbers;
  });
}

}  // namespace selvedge
