// Held-out pairs that compare settings: finer than the fabrics, with unlimited bounces, and of another seed.
#pragma once

#include <string>

#include "converter/bake/bake.h"

namespace selvedge {

struct HeldOutOptions {
  int texels = 64;  ///< along both sides
  int pairs = 48;
  int samples = 32;  ///< rays per texel and pair, even
};

/// Reads them from a samples file; bakes it where it is not there, not whole, or has other pairs. Of `base`
/// the seed, the ground, the plane of the texels and whether the bake is resumable count. `name` stands for
/// the mesh in messages.
Result<PairSamples> ensure_held_out(const CellMesh& mesh, const std::string& name,
                                    const HeldOutOptions& options, const BakeOptions& base,
                                    const std::string& path);

}  // namespace selvedge
