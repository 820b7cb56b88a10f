// Explicit fibres: each a line through its ply. They are the truth that the surfaces of plies stand for.
#pragma once

#include "converter/mesh/cell_mesh.h"
#include "converter/stitch/pattern.h"

namespace selvedge {

/// Round fibres as lines of points. Those of yarns end where they begin again, whole periods on; they may
/// leave the cell.
struct Fibres {
  V2d period{1, 1};           ///< mm
  std::vector<V3f> points;    ///< mm, fibre by fibre
  std::vector<int> first;     ///< of each fibre, its first point; then the number of points
  std::vector<float> radius;  ///< of each, mm
  std::vector<int> yarn;      ///< of each, index into yarns
  std::vector<Yarn> yarns;    ///< the plies, without their segments
  int count() const { return static_cast<int>(yarn.size()); }
};

struct FibreLayout {
  /// Fibres a ply; 0: as many as fill it, by their diameter. With another number they are thicker or thinner.
  int each_ply = 0;
  /// Share of a ply's section that is fibre. Yarns are spun to between 0.4 and 0.6.
  double packing = 0.5;
};

constexpr int max_fibres_each_ply = 2000;
/// Limit of memory.
constexpr int max_fibre_points = 1 << 23;

/// The fibres of a stitch, and the hairs of `mesh`, which is made of it. Fibres are spread evenly over the
/// section of each ply; they turn about it by its twist, sway against each other by about their distance, and
/// swell with it; they may run through each other. The same pattern gives the same fibres. Refuses
/// (option_out_of_range, "--fibres") more than max_fibres_each_ply, and (mesh_invalid) more than
/// max_fibre_points. Precondition: a valid pattern.
Result<Fibres> lay_fibres(const StitchPattern& pattern, const CellMesh& mesh, const FibreLayout& layout = {});

}  // namespace selvedge
