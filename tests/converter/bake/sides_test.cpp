// Bakes of both sides of the cloth, held to closed forms and to reciprocity.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/bake/bake.h"
#include "tests/converter/bake_cells.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

constexpr double pi = std::numbers::pi;

BakeOptions small_bake() {
  return {.width = 4,
          .height = 4,
          .views = 16,
          .lights = 64,
          .samples = 64,
          .both_sides = true,
          .validation_pairs = 0,
          .held_out_pairs = 0,
          .truth_samples = 16};
}

Samples baked(const CellMesh& mesh, const BakeOptions& options) {
  return test::need(bake(mesh, "test", options)).samples;
}

}  // namespace

TEST_CASE("the back of a Lambert plane is lit as its front, and nothing comes through") {
  const Samples samples = baked(floor_of(1, 1, 0.6F), small_bake());
  const std::vector<V3f> lights = cell_directions(samples.header.lights);
  for (const Side side : all_sides) {
    const SampleLevel level = side_samples(samples, side).level;
    for (const float alpha : level.alpha) CHECK(alpha == 1);
    for (const V3f& n : level.normal_sum) CHECK(n.z == doctest::Approx(16));
    for (std::size_t i = 0; i < level.radiance.size(); ++i) {
      const double cosine = is_transmission(side) ? 0 : static_cast<double>(lights[i % lights.size()].z);
      CHECK(std::abs(static_cast<double>(level.radiance[i].x) - 0.6 / pi * cosine) <= 3e-4);
    }
  }
}

TEST_CASE("cell means are reciprocal on every side") {
  // alpha(v) f(l, v) |v_z| = alpha(l) f(v, l) |l_z|; within four standard errors of the difference.
  const V3f a = V3f(0.3F, 0.2F, 0.8F).normalized();
  const V3f b = V3f(-0.5F, 0.4F, 0.6F).normalized();
  ByPairKind<std::vector<DirectionPair>> pairs;
  for (const V3f& l : {a, mirrored(a)}) {
    for (const V3f& v : {b, mirrored(b)}) {
      pairs[1].push_back({l, v});
      pairs[1].push_back({v, l});
    }
  }
  BakeOptions o = small_bake();
  o.pairs = pairs;
  o.truth_samples = 4096;
  o.bounces = unlimited_bounces;
  CellMesh mesh = test::need(load_cell("plain-knit"));
  mesh.gloss.clear();
  const Samples samples = baked(mesh, o);
  // Mean and squared standard error of alpha f |v_z| of each pair, by its directions on the sphere.
  struct Mean {
    DirectionPair pair;
    double value = 0;
    double error2 = 0;
  };
  std::vector<Mean> means;
  for (const Side side : all_sides) {
    const PairSamples read = side_pairs(samples.pairs[index_of(PairKind::held_out)], side);
    REQUIRE(read.pairs.size() == 2);
    const std::size_t texels = read.alpha.size() / 2;
    for (std::size_t p = 0; p < 2; ++p) {
      Mean mean{read.pairs[p], 0, 0};
      const auto z = static_cast<double>(mean.pair.view.z);
      for (std::size_t t = p * texels; t < (p + 1) * texels; ++t) {
        mean.value +=
            static_cast<double>(read.alpha[t] * read.radiance[t].x) * z / static_cast<double>(texels);
        mean.error2 += std::pow(static_cast<double>(read.noise[t].x) * z / static_cast<double>(texels), 2);
      }
      if (is_view_behind(side)) mean.pair.view = mirrored(mean.pair.view);
      if (is_view_behind(side) != is_transmission(side)) mean.pair.light = mirrored(mean.pair.light);
      means.push_back(mean);
    }
  }
  int compared = 0;
  for (const Mean& one : means) {
    for (const Mean& other : means) {
      if (one.pair.light != other.pair.view || one.pair.view != other.pair.light) continue;
      ++compared;
      CAPTURE(one.pair.light.z);
      CAPTURE(one.pair.view.z);
      CHECK(std::abs(one.value - other.value) <= 4 * std::sqrt(one.error2 + other.error2) + 1e-3 * one.value);
    }
  }
  CHECK(compared == 8);
}
