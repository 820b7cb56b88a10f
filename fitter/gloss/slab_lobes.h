// Gloss of slabs (gloss.h), fitted alternately with the tables: kinds of texels, and the frame, diffuse term
// and lobes of each kind.
#pragma once

#include <vector>

#include "fitter/gloss/gloss.h"
#include "format/samples/samples.h"

namespace selvedge {

struct SlabLobeOptions {
  int lobes = 1;       ///< at least 1
  int max_kinds = 8;   ///< of texels
  int max_turns = 5;   ///< alternations between tables and gloss
  int max_steps = 10;  ///< of a search in a turn
};

struct SlabLobeFit {
  SlabGloss gloss;
  /// Relative L2 errors on the training samples with tables of one function of the view: with the cosine
  /// alone, then after every turn; strictly falling.
  std::vector<double> errors;
};

/// Kinds begin as clusters of texels by mean normal and direction of fibres; later turns move each texel to
/// the kind that fits it best. A turn that does not lower the error is undone and ends the search. Does not
/// depend on the number of threads; finite for any samples.
SlabLobeFit fit_slab_lobes(const SampleLevel& samples, const SlabRays& rays, std::size_t entries,
                           const DirectionGrid& views, const DirectionGrid& lights,
                           const SlabLobeOptions& options);

}  // namespace selvedge
