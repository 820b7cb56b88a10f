// The held-out directions that settings are compared by: finer than the fabrics, under light that bounces
// without end, and from another seed than theirs.
#pragma once

#include <string>

#include "converter/bake/bake.h"

namespace selvedge {

struct HeldOutOptions {
  int texels = 64;  ///< along both sides
  int pairs = 48;
  int samples = 32;  ///< rays per texel and pair, even
};

/// Bakes them to a samples file. Of `base` the seed, the ground, the plane of the texels and whether the bake
/// is resumable count. `name` stands for the mesh in messages.
Result<PairSamples> bake_held_out(const CellMesh& mesh, const std::string& name,
                                  const HeldOutOptions& options, const BakeOptions& base,
                                  const std::string& output);

/// The pairs of such a file, if it is there, whole, and has those that the options ask for.
std::optional<PairSamples> read_held_out(const std::string& path, const HeldOutOptions& options);

}  // namespace selvedge
