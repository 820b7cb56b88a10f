// Flat sections of a stitch's yarns (format/fabric/yarn_section.h).
#pragma once

#include <cmath>

#include "converter/stitch/pattern.h"
#include "format/fabric/yarn_section.h"

namespace selvedge {

inline bool is_round(const Yarn& yarn) { return yarn.flattening == 1 && yarn.squeezes.empty(); }

/// Squeeze of the yarn's section at t of a segment. Precondition: a valid yarn.
V3d squeeze_at(const Yarn& yarn, std::size_t segment, double t);

struct YarnSection {
  double radius = 0;  ///< mm, of the round one with its area
  V3d squeeze{0, 0, 0};
};

/// How far a section reaches in a unit direction, mm: the reach of the ellipsoid whose widest
/// section it is.
inline double support_of(const YarnSection& section, const V3d& direction) {
  return section_extent(round_section_radius(section.radius, section.squeeze), section.squeeze, direction);
}

/// The unit direction from b to a in which there is most room between them, or least overlap, a lying
/// `apart` (not 0) from b: apart.direction less both supports is their distance.
V3d separating_direction(const V3d& apart, const YarnSection& a, const YarnSection& b, int steps = 4);

/// Half the width of the round section with its area, mm, at a place along a chain of this length, mm.
inline double radius_with_swells(const Yarn& yarn, double along, double length) {
  return yarn.radius_mm * strand_swell(yarn.swells, along / length * yarn.passes, thickness_noise_byte);
}

/// Half the width and half the thickness, mm, where the yarn lies level.
inline double half_width_of(const Yarn& yarn) { return yarn.radius_mm / std::sqrt(yarn.flattening); }
inline double half_thickness_of(const Yarn& yarn) { return yarn.radius_mm * std::sqrt(yarn.flattening); }

/// Half the thickness of the thinnest yarn, mm.
double min_half_thickness(const StitchPattern& pattern);

}  // namespace selvedge
