// Yarn as a closed polyline, which relaxation (yarn_relax.h) moves.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
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

struct Nearest {
  double s, t;  ///< along either piece, 0 to 1
};

/// Nearest points of two straight pieces, the first starting `between` from the second.
inline Nearest nearest_of(const V3d& between, const V3d& along_a, const V3d& along_b) {
  const double aa = std::max(along_a.length2(), 1e-300);
  const double bb = std::max(along_b.length2(), 1e-300);
  const double ab = along_a.dot(along_b);
  const double ca = along_a.dot(between);
  const double cb = along_b.dot(between);
  const double parallel = aa * bb - ab * ab;
  double s = parallel > 1e-9 * aa * bb ? std::clamp((ab * cb - ca * bb) / parallel, 0.0, 1.0) : 0.5;
  double t = (ab * s + cb) / bb;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((ab * t - ca) / aa, 0.0, 1.0);
  }
  return {s, t};
}

/// Passes this fraction of the strains of soft sections on to either neighbour, and takes `recovery` back.
void diffuse_strains(std::span<Imath::M33d> strains, double spread, double recovery);

/// Keeps a strain across its piece, without trace and within bounds; returns half the width of the section,
/// in radii.
double set_squeeze(Imath::M33d& strain, const V3d& along, V3d& squeeze);

/// Points at equal distances along each of so many parts of a chain with as many points each, linear between
/// the old ones.
std::vector<V3d> resampled(const RelaxChain& chain, std::size_t count, std::size_t parts);

/// One implicit step of a closed chain under tension and bending, `time` in squared radii: the inverse of
/// 1 + pull u + bend u^2, where -u takes second differences, by the Cholesky factor of the endless chain.
void smooth(RelaxChain& chain, double time, double bending);

inline constexpr std::uint32_t no_image = ~std::uint32_t{0};
/// Gives the values of each kind their mean; vectors also with the ones of its mirror image, where x is -x.
template <class Value>
void average_by_kind(std::span<const std::uint32_t> kind_of, std::span<const std::uint32_t> images,
                     std::vector<Value>& values);

}  // namespace selvedge
