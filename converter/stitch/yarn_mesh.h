// Stage "mesh": stitch pattern -> triangle mesh of one cell: tubes around Bézier skeletons (Daubert et al.
// 2001, section 4, polygonise the same surface by Marching Cubes).
#pragma once

#include "converter/mesh/cell_mesh.h"
#include "converter/mesh/yarn_chain.h"
#include "converter/stitch/pattern.h"

namespace selvedge {

/// Whether the surface alone has whole yarns in place of so many plies, and fewer sides.
bool hides_plies(const StitchPattern& pattern);

/// The surface of the yarns or plies of one cell: closed tubes, whose vertices lie on it. They reach beyond
/// the cell where yarns do, the last ring being a copy of the first in another cell, and enter each other
/// where yarns overlap. If any yarn is glossy, fibres follow the yarn or ply, turned by its twist; if any has
/// fibres, hairs or irregularity, vertices have their places on yarns, and hairs stand off it. z is the
/// pattern's. `has_yarns` false: without CellMesh::yarns, places and hairs. Refuses an invalid pattern, and
/// what lay_plies() does.
Result<CellMesh> mesh_stitch(const StitchPattern& pattern, bool has_yarns = true);

/// The yarns alone, with their strands and hairs. Refuses what mesh_stitch() does.
Result<YarnCell> yarn_cell_of(const StitchPattern& pattern);
/// Gives a cell's curves, and their walls, the colours of the pattern's yarns; false: it has other curves.
bool set_colours(const StitchPattern& pattern, YarnCell& cell);

/// The yarns as a fabric file holds them: curves, nodes and counts of stations (append_chain()); no light
/// yet. Heights are the pattern's own. Yarns of several plies are one curve, or one a ply where the plies
/// turn more often than a file can say or pass a bend so close that they stand still. Refuses patterns as
/// lay_plies() does. Precondition: a valid pattern.
/// Chains of many nodes lie farther from their yarns, as a viewer's memory grows with them; plies that a
/// file has no room for get fewer pieces.
Result<YarnData> yarn_curves_of(const StitchPattern& pattern, const YarnChainOptions& options = {});

/// Hairs that the yarn's hairiness asks for.
double expected_hairs(const Yarn& yarn);
/// Takes away hairs that a file has no room for, roughly more; returns the fraction that is kept. Throws
/// Failure.
double cut_hairs(StitchPattern& pattern, bool is_rough = false);

}  // namespace selvedge
