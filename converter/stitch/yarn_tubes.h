// The surface of yarns one by one, in place of their implicit surface: for repeats with so many yarns that
// Marching Cubes would take minutes.
#pragma once

#include "converter/stitch/implicit_surface.h"
#include "converter/stitch/marching_cubes.h"

namespace selvedge {

struct YarnTubes {
  MarchedSurface surface;                     ///< reaches beyond the cell where yarns do
  std::vector<SurfaceSample> vertex_samples;  ///< per vertex, at distance 0
};

/// Closed tubes of about 100 triangles a width of yarn, `is_coarse`: a fifth; they enter each other where
/// yarns overlap. Precondition: validate(pattern) holds.
YarnTubes tubes_of(const StitchPattern& pattern, bool is_coarse = false);

}  // namespace selvedge
