// The light that reaches yarn by way of other yarn, as a fabric file holds it (format/fabric/yarns.h), from
// global lines (yarn_lines.h).
//
// Patches exchange diffuse light in the measure of the lines that pass between them; light from the sky
// leaves the first surface by its lustre. Light is a linear function of what falls in: one solve for the nine
// functions of light that are stored replaces one for each lamp.
#pragma once

#include <functional>
#include <span>

#include "format/base/progress.h"
#include "format/fabric/yarns.h"

namespace selvedge {

/// Direction `index` of `count`, evenly over the upper half of the sphere by its area: a spiral of golden
/// angles.
V3f spiral_direction(int index, int count);

struct LineLightOptions {
  bool both_sides = false;     ///< YarnData::light_through, too
  int direction_count = 64;    ///< of lines, over the upper half of the sphere; each is followed both ways
  float spacing_radii = 0.5F;  ///< of lines, in radii of the thinnest ply
  Progress progress{};
  /// Whether lines follow the yarn at a point, mm; empty: they do everywhere. Stations elsewhere get no
  /// light.
  std::function<bool(const V3f&)> is_followed{};
};

/// Gives the curves their indirect light, and all light from below if that is wanted. Heights are above the
/// cell's lowest point. `through`: of each curve, the fraction of matt light that goes through the wall of
/// a ply (YarnCell). Values are whole multiples of a power of two a curve and colour. Returns whether the
/// light has settled: at albedos next to 1 it may still be short by more than a thousandth. The same for any
/// number of threads. Precondition: validate() holds of the curves and nodes.
bool compute_yarn_light(YarnData& data, const V2f& period, std::span<const V3f> through,
                        const LineLightOptions& options = {});

}  // namespace selvedge
