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

/// Bakes the pairs to a samples file. Only seed, ground, reference plane and `resumable` of `base` are used.
/// `name` stands for the mesh in messages.
Result<PairSamples> bake_held_out(const CellMesh& mesh, const std::string& name,
                                  const HeldOutOptions& options, const BakeOptions& base,
                                  const std::string& output);

/// The pairs of a samples file, if it exists, is complete, and matches the options.
std::optional<PairSamples> read_held_out(const std::string& path, const HeldOutOptions& options);

}  // namespace selvedge
