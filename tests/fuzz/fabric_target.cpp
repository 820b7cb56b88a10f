// Bytes -> read_fabric, check_fabric, and the evaluation of what they let pass.
#include <cmath>

#include "format/check/fabric.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "tests/fuzz/target.h"

using namespace selvedge;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Small, so that an execution is short; the code of the checks is the same.
  const FabricLimits limits{
      .texels_per_side = 32, .directions = 64, .lobes = 4, .functions = 8, .products = 8};
  const std::span<const std::uint8_t> bytes(data, size);
  const Result<Fabric> fabric = read_fabric(bytes, "input", limits);
  const Issues issues = check_fabric(bytes, "input", limits).issues;
  fuzz::require(fabric.has_value() != has_error(issues), "reader and checker judge alike");
  if (!fabric) return 0;
  constexpr int max_stitches = 4096;
  const auto& yarns = fabric->levels.front().yarns();
  const V2i stitches = yarns ? yarns->data().map.size : V2i(0, 0);
  const bool is_small = std::int64_t{1} * stitches.x * stitches.y <= max_stitches;
  const auto evaluate_all = [&](const Fabric& stored) {
    const Fabric seen = is_small ? arranged(stored) : stored;
    if (stitches.x > 0) evaluate(seen, -1, {0.3, 0.7}, {0, 0.6F, 0.8F}, {0.6F, 0, 0.8F});
    for (int k = 0; k < static_cast<int>(seen.levels.size()); ++k) {
      const FabricLevel& level = seen.levels[k];
      for (const float z : {0.8F, -0.8F}) {
        const Shading s = evaluate(seen, k, level.width - 1, level.height - 1, {0, 0.6F, z}, {0.6F, 0, 0.8F});
        fuzz::require(s.alpha >= 0 && s.alpha <= 1, "alpha is in [0, 1]");
        for (int c = 0; c < 3; ++c)
          fuzz::require(s.radiance[c] >= 0 && std::isfinite(s.radiance[c]),
                        "radiance is finite and not negative");
      }
    }
  };
  evaluate_all(*fabric);
  if (fabric->find_side(Side::back) != nullptr) evaluate_all(turned_over(*fabric));
  return 0;
}
