// The refit of lobes and view tables to samples at scattered pairs of directions, as a laboratory takes them.
#pragma once

#include "fitter/fit.h"

namespace selvedge {

/// Refits lobes and view tables of all levels to `measured`, whose pairs may lie anywhere. The fabric holds
/// the fit to grids that were interpolated between these pairs, with this number of lights; the search begins
/// there, and entries of tables that the pairs leave open stay near it. Texels with fewer pairs than unknowns
/// (parameters and entries of the table of a channel), or with more than 300 unknowns, stay as they are. The
/// radiance scale of the fabric is 1. The result does not depend on the number of threads, and is finite.
/// Memory: 16 bytes a pair and texel.
void refit_to_pairs(Fabric& fabric, const PairSamples& measured, int lights, const FitOptions& options);

}  // namespace selvedge
