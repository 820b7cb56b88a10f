#include "converter/bake/for_plan.h"

#include <doctest/doctest.h>

#include <cmath>

#include "converter/stitch/find_cell.h"
#include "format/samples/pool.h"
#include "tests/converter/load_cell.h"
#include "tests/format/files.h"
#include "tests/require.h"

namespace selvedge {
namespace {

/// Texels of 0.25 x 0.2 mm at level 0.
const V2d period(8, 6.4);
constexpr double bias = -0.5;

TexelDemand demand_for(double level) { return {0.25 * std::exp2(level - bias), HUGE_VAL, bias}; }

TEST_CASE("a cell is baked at the coarsest level that is fine enough, with a quarter of the rays") {
  BakeOptions whole;
  whole.samples = 8;
  whole.truth_samples = 64;
  const BakeOptions second = bake_for(demand_for(2.74), period, whole, false);
  CHECK(V2i(second.width, second.height) == V2i(8, 8));
  REQUIRE(second.whole);
  CHECK(*second.whole == WholeFabric{V2i(32, 32), 2});
  CHECK(second.samples == 32);
  CHECK(second.truth_samples == 128);
  CHECK(second.held_out_pairs == whole.held_out_pairs);
  CHECK(second.validation_pairs == 0);
  CHECK(second.rim_pairs == 0);
  CHECK(bake_for(demand_for(2.74), period, whole, true).validation_pairs == whole.validation_pairs);
  // Up to three quarters of the way to the next level both count. A level that is just enough by its figures
  // might not be by its digits.
  CHECK(bake_for(demand_for(2.75), period, whole, false).whole->level == 2);
  CHECK(bake_for(demand_for(2.76), period, whole, false).whole->level == 3);
  CHECK_FALSE(bake_for(demand_for(0.74), period, whole, false).whole.has_value());
  CHECK(bake_for(demand_for(0.74), period, whole, false).samples == 8);
  // Beyond the coarsest level, and where nothing is seen.
  for (const TexelDemand& far : {demand_for(20), TexelDemand{HUGE_VAL, 0, bias}}) {
    const BakeOptions last = bake_for(far, period, whole, false);
    CHECK(V2i(last.width, last.height) == V2i(1, 1));
    CHECK(last.whole->level == 5);
  }
  // Sizes that do not halve.
  whole.width = 9;
  whole.height = 64;
  const BakeOptions odd =
      bake_for(TexelDemand{1e-3 + 8.0 / 9 * 8 / std::exp2(bias), HUGE_VAL, bias}, period, whole, false);
  REQUIRE(odd.whole);
  CHECK(is_level_of(*odd.whole, odd.width, odd.height));
  CHECK(V2i(odd.width, odd.height) == V2i(level_size(9, odd.whole->level), level_size(64, odd.whole->level)));
}

TEST_CASE("as many levels are fitted as are asked for") {
  SamplesHeader header;
  header.width = header.height = 8;
  header.period_mm = V2f(period);
  header.whole = WholeFabric{V2i(32, 32), 2};
  TexelDemand demand = demand_for(2.74);
  CHECK(levels_needed(demand, header) == 4);
  // Level 3.3 of texels of 0.2 mm: levels 2, 3 and 4.
  demand.max_mm = 0.2 * std::exp2(3.3 - bias);
  CHECK(levels_needed(demand, header) == 3);
  demand.max_mm = demand.min_mm;
  CHECK(levels_needed(demand, header) >= 2);
  header.whole.reset();
  CHECK(levels_needed(TexelDemand{0, HUGE_VAL, bias}, header) == 4);
}

TEST_CASE("what a coarser level sees is what the finer texels see together") {
  const test::Folder folder;
  const auto cell = test::need(find_cell("plain-knit", {{}, {}, of_tubes()}));
  BakeOptions options;
  options.width = options.height = 16;
  options.views = 9;
  options.lights = 9;
  options.samples = 64;
  options.validation_pairs = options.held_out_pairs = options.rim_pairs = 0;
  const auto level_of = [&](const BakeOptions& o, const char* name) {
    const std::string path = folder / name;
    test::need(bake(cell.mesh, "knit", o, "{}", path));
    auto reader = test::need(SamplesReader::open(path));
    CHECK(reader.header().whole == o.whole);
    return test::need(reader.read_level());
  };
  const SampleLevel pooled = pool(pool(level_of(options, "fine.exr")));
  BakeOptions coarse = options;
  coarse.whole = WholeFabric{V2i(16, 16), 2};
  coarse.width = coarse.height = 4;
  coarse.samples = 1024;
  const SampleLevel direct = level_of(coarse, "coarse.exr");
  REQUIRE(direct.alpha.size() == pooled.alpha.size());
  double error2 = 0;
  double signal2 = 0;
  double difference = 0;
  for (std::size_t i = 0; i < pooled.alpha.size(); ++i) {
    CHECK(std::abs(direct.alpha[i] - pooled.alpha[i]) < 0.02F);
    for (std::size_t l = 0; l < 9; ++l) {
      const V3d a = V3d(direct.radiance[i * 9 + l]) * static_cast<double>(direct.alpha[i]);
      const V3d b = V3d(pooled.radiance[i * 9 + l]) * static_cast<double>(pooled.alpha[i]);
      error2 += (a - b).length2();
      signal2 += b.length2();
      difference += (a - b).x + (a - b).y + (a - b).z;
    }
  }
  // 1,024 rays a texel leave about 0.3 % (docs/bake.md: 1.2 % with 64).
  MESSAGE("relative difference " << std::sqrt(error2 / signal2));
  CHECK(std::sqrt(error2 / signal2) < 0.006);
  // And no bias: the mean difference is smaller still.
  CHECK(std::abs(difference) / static_cast<double>(pooled.alpha.size() * 27) <
        0.002 * std::sqrt(signal2 / static_cast<double>(pooled.alpha.size() * 27)));
  double worst = 0;
  for (std::size_t t = 0; t < pooled.normal.size(); ++t) {
    const V3d a = V3d(direct.normal[t]).normalized();
    const V3d b = V3d(pooled.normal[t]).normalized();
    worst = std::max(worst, (a - b).length());
  }
  CHECK(worst < 0.02);
}

}  // namespace
}  // namespace selvedge
