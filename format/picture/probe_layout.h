// Pictures of all directions in other layouts than glTF viewers have: crosses of six cube faces and light
// probes.
#pragma once

#include <optional>

#include "format/base/vec.h"
#include "format/picture/image.h"

namespace selvedge {

enum class ProbeLayout {
  equirectangular,  ///< twice as wide as high
  /// Three faces wide and four high: from the top down +y, -z with -x and +x beside it, -y, and +z, upside
  /// down as the cross folds.
  vertical_cross,
  /// Four faces wide and three high: -x, -z, +x and +z in the middle row, +y above and -y below -z.
  horizontal_cross,
  /// A disc in a square, Debevec's light probe: -z in the middle, angles from it in proportion to radii, +z
  /// at the rim.
  ball,
};

/// By the ratio of its sides; nothing for another.
std::optional<ProbeLayout> probe_layout(const V2i& size);

/// Width of the equirectangular picture, twice its height, whose pixels are about as fine.
int equirectangular_width(ProbeLayout layout, const V2i& size);

/// RGBA, interpolated, as environment.h lays it out. Precondition: `probe` is RGBA in this layout.
Image equirectangular(const Image& probe, ProbeLayout layout);

}  // namespace selvedge
