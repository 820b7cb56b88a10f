// A round cloth over a round table.
#pragma once

#include "samples/assembly.h"

namespace selvedge::samples {

struct TableclothOptions {
  double table_radius = 0.45;  ///< metres
  double table_height = 0.72;
  double overhang = 0.29;  ///< metres of cloth beyond the table's edge
  int rings = 75;          ///< of the cloth's mesh; 3 rings^2 vertices
  int folds = 13;
  int drape_steps = 500;
};

/// The cloth (material "tablecloth", patch 0) and the table (material "wood", patch 1), metres, y up, the
/// table's foot on y = 0. The cloth's texture coordinates are its flat plane, one unit per metre, u along +x
/// and v along +z where it lies on the table.
Assembly make_tablecloth(const TableclothOptions& options = {});

}  // namespace selvedge::samples
