// Charts: the panels of a quad surface, cut out, laid flat and turned to the grain.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "format/scene/flatten.h"
#include "samples/assembly.h"
#include "samples/surface.h"

namespace selvedge::samples {

/// A panel cut out of a surface.
struct Chart {
  Panel panel;
  std::vector<int> points;                ///< per vertex of the panel, the vertex of the surface
  std::vector<std::array<int, 4>> quads;  ///< vertices of the panel
  std::vector<V2d> plane;                 ///< per vertex, metres; u to the right, v up, until `turn_to_grain`
};

/// Cuts out the quads with one of `labels`. Vertices for which `cut` is true get a second vertex for the
/// quads labelled `beyond`, so that a tube becomes a disc. Quads become two triangles each, over the shorter
/// diagonal. `plane` stays empty.
Chart cut_out(const QuadSurface& surface, const std::set<int>& labels, int beyond,
              const std::function<bool(int)>& cut);

/// Puts the positions of the surface into the panel once more (after draping).
void move_to(Chart& chart, const std::vector<V3d>& positions);

/// Turns the plane such that the wales follow `down` (metres, garment's frame) in the mean over the area,
/// moves its middle to u = `middle_u` and its upper end to v = 0, and lets v grow downwards (glTF).
void turn_to_grain(Chart& chart, const V3d& down, double middle_u);

Patch patch_of(const Chart& chart, const std::string& material);

}  // namespace selvedge::samples
