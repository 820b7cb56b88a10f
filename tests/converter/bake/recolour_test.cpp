#include "converter/make/recolour.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "converter/make/make.h"
#include "converter/stitch/find_cell.h"
#include "format/quality/compare.h"
#include "tests/require.h"

namespace selvedge {
namespace {

YarnCell cell_of(const std::string& stitch, const StitchSettings& settings) {
  CellOptions options;
  options.settings = settings;
  options.needs_stitch_mesh = false;
  return test::need(find_cell(stitch, options)).yarn.value();
}

}  // namespace

TEST_CASE("a fabric in other colours is nearly what a make of them is") {
  struct Case {
    std::string stitch;
    StitchSettings before, after;
    std::string quality;
    bool both_sides;
  };
  const Case cases[] = {
      {"plain-knit",
       {{"colour", {0.216, 0.216, 0.216}}},
       {{"colour", {0.011, 0.023, 0.067}}},
       "standard",
       false},
      {"plain-knit", {{"colour", {0.216, 0.216, 0.216}}}, {{"colour", {0.94, 0.94, 0.94}}}, "standard", true},
      {"plain-knit", {{"colour", {0.216, 0.216, 0.216}}}, {{"colour", {1, 0, 0}}}, "draft", false},
      {"two-colour", {}, {{"second_albedo", {0.53, 0.03, 0.014}}}, "standard", false}};
  for (const Case& c : cases) {
    CAPTURE(c.stitch);
    CAPTURE(c.after.begin()->second.front());
    MakeOptions options = quality_named(c.quality);
    options.bake.both_sides = c.both_sides;
    const YarnCell before = cell_of(c.stitch, c.before);
    const YarnCell after = cell_of(c.stitch, c.after);
    const auto made = [&](const YarnCell& cell, Samples* kept) {
      Baked baked = test::need(bake(cell, c.stitch, options.bake));
      Fabric fabric = test::need(fit_fabric(baked.samples, options)).fabric;
      if (kept != nullptr) *kept = std::move(baked.samples);
      return fabric;
    };
    Samples samples;
    const Fabric base = made(before, nullptr);
    const Fabric exact = made(after, &samples);
    REQUIRE(differs_only_in_colour(base, after));
    const Fabric recoloured = recolour(base, after);
    CHECK(recoloured.accuracy == "{}");
    const PairSamples held_out = side_pairs(samples.pairs[index_of(PairKind::held_out)], Side::front);
    const Comparison by_make = test::need(compare(exact, held_out, PairKind::held_out));
    const Comparison by_colour = test::need(compare(recoloured, held_out, PairKind::held_out));
    for (std::size_t k = 0; k < by_make.levels.size(); ++k) {
      CAPTURE(k);
      const double bias = by_colour.levels[k].relative_bias;
      CHECK(std::min(std::abs(bias), std::abs(bias - by_make.levels[k].relative_bias)) < 0.03);
      CHECK(by_colour.levels[k].psnr > std::min(by_make.levels[k].psnr - 8, 33.0));
    }
    const auto yarn = [&](const Fabric& fabric) {
      return compare_yarn(fabric, held_out, by_make.peak).levels;
    };
    CHECK(yarn(recoloured).front().psnr == doctest::Approx(yarn(exact).front().psnr).epsilon(0.01));
  }
}

TEST_CASE("cloth in other colours has the same yarn") {
  MakeOptions options = quality_named("draft");
  const Fabric fabric =
      test::need(fit_fabric(test::need(bake(cell_of("plain-knit", {}), "", options.bake)).samples, options))
          .fabric;
  CHECK(differs_only_in_colour(fabric, cell_of("plain-knit", {{"colour", {0.1, 0.2, 0.3}}})));
  CHECK_FALSE(differs_only_in_colour(fabric, cell_of("plain-knit", {{"wale_mm", {5.1}}})));
  CHECK_FALSE(differs_only_in_colour(fabric, cell_of("purl", {})));
  Fabric without = fabric;
  without.levels.front().set_yarns(nullptr);
  CHECK_FALSE(differs_only_in_colour(without, cell_of("plain-knit", {})));
}

}  // namespace selvedge
