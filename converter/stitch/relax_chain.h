// Yarn as a closed polyline, which relaxation (yarn_relax.h) moves.
#pragma once

#include <vector>

#include "converter/stitch/pattern.h"

namespace selvedge {

/// A yarn as a polyline. Point `size` is point 0 moved by `way`.
struct RelaxChain {
  std::vector<V3d> points;
  V3d period_offset;
  V3d across{0, 0, 0};      ///< unit, in the plane, perpendicular to `period_offset`; zero for a ring
  double drawn_offset = 0;  ///< its drawn position along `across`
  bool is_soft = false;
  double radius = 0;
  double flattening = 1;
  double log_flattening = 0;        ///< logarithm of its flattening
  double half_width = 0;            ///< half the width of its section, mm
  double half_thickness = 0;        ///< and half the thickness
  std::vector<double> half_widths;  ///< half the width by piece, mm
  /// Logarithms of stretches across soft yarn, by piece, without trace; and squeezes.
  std::vector<Imath::M33d> strains;
  std::vector<V3d> squeezes;
  std::size_t first_index = 0;  ///< index of its first point among the points of all chains
  double spacing = 0;           ///< of its points, mm, within a factor of two of each
  double length() const {
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) sum += (next_point(i) - points[i]).length();
    return sum;
  }
  V3d next_point(std::size_t i) const {
    return i + 1 < points.size() ? points[i + 1] : points[0] + period_offset;
  }
};

/// exp(x) for |x| < 1, to 1e-8, of the same bits everywhere.
inline double exp_of(double x) {
  double power = (2048 + x) / (2048 - x);
  for (int i = 0; i < 10; ++i) power *= power;
  return power;
}

/// Points at equal distances along a chain, linear between the old ones.
std::vector<V3d> resampled(const RelaxChain& chain, std::size_t count);

/// One implicit step of a closed chain under tension and bending, `time` in squared radii: the inverse of
/// 1 + pull u + bend u^2, where -u takes second differences, by the Cholesky factor of the endless chain.
void smooth(RelaxChain& chain, double time, double bending);

}  // namespace selvedge
