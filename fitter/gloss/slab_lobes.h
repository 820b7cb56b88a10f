// Lobes in slabs, fitted by turns with the tables: kinds of texels, and for each its frame, diffuse term and
// lobes (gloss.h).
#pragma once

#include <vector>

#include "fitter/gloss/gloss.h"
#include "format/samples/samples.h"

namespace selvedge {

struct SlabLobeOptions {
  int lobes = 1;   ///< 1 and more
  int kinds = 8;   ///< of texels, at most
  int turns = 5;   ///< at most
  int steps = 10;  ///< of a search in a turn, at most
};

struct SlabLobeFit {
  SlabGloss gloss;
  /// Relative L2 errors of the training samples with tables of one function of the view: that of the cosine
  /// alone, then after every turn; strictly falling.
  std::vector<double> errors;
};

/// Texels are of a kind whose mean normals are alike and whose gloss lies along the same direction; then
/// every texel moves to the kind whose g explains it best. A turn that does not lower the error is taken back
/// and ends the search. Deterministic for any number of threads; finite whatever the samples.
SlabLobeFit fit_slab_lobes(const SampleLevel& samples, const SlabRays& rays, std::size_t entries,
                           const DirectionGrid& views, const DirectionGrid& lights,
                           const SlabLobeOptions& options);

}  // namespace selvedge
