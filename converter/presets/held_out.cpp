#include "converter/presets/held_out.h"

#include "converter/bake/setup.h"

namespace selvedge {

Result<PairSamples> ensure_held_out(const CellMesh& mesh, const std::string& name,
                                    const HeldOutOptions& options, const BakeOptions& base,
                                    const std::string& path) {
  const auto read = [&]() -> Result<PairSamples> {
    auto reader = SamplesReader::open(path);
    if (!reader) return tl::unexpected(reader.error());
    if (reader->header().width != options.texels || reader->header().height != options.texels) return {};
    return reader->read_pairs(PairKind::held_out);
  };
  if (auto there = read(); there && static_cast<int>(there->pairs.size()) == options.pairs) return there;
  BakeOptions bake_options;
  bake_options.width = bake_options.height = options.texels;
  bake_options.views = bake_options.lights = bake_options.samples = 1;
  bake_options.bounces = unlimited_bounces;
  bake_options.validation_pairs = bake_options.rim_pairs = 0;
  bake_options.held_out_pairs = options.pairs;
  bake_options.truth_samples = options.samples;
  bake_options.seed = mix(base.seed) >> 1;
  bake_options.ground = base.ground;
  bake_options.reference = base.reference;
  bake_options.resumable = base.resumable;
  if (const auto baked = bake(mesh, name, bake_options, "{}", path); !baked)
    return tl::unexpected(baked.error());
  return read();
}

}  // namespace selvedge
