#include "converter/bake/bake.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "converter/bake/texels.h"
#include "converter/make/make.h"
#include "converter/make/recolour.h"
#include "converter/stitch/find_cell.h"
#include "format/base/parallel.h"
#include "format/quality/compare.h"
#include "tests/converter/bake_cells.h"
#include "tests/converter/load_cell.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

constexpr double pi = std::numbers::pi;

BakeOptions small_bake() {
  return {.width = 8,
          .height = 4,
          .views = 16,
          .lights = 64,
          .samples = 9,
          .validation_pairs = 2,
          .held_out_pairs = 4,
          .truth_samples = 16};
}

struct Seen {
  SamplesHeader header;
  SampleLevel level;
  PairSamples held_out;
};

Seen bake_mesh(const CellMesh& mesh, const BakeOptions& options) {
  SideSamples front = side_samples(test::need(bake(mesh, "test", options)).samples, Side::front);
  return {std::move(front.header), std::move(front.level),
          std::move(front.pairs[index_of(PairKind::held_out)])};
}

BakeOptions both_sides() {
  BakeOptions options = small_bake();
  options.width = 4;
  options.samples = 64;
  options.both_sides = true;
  options.validation_pairs = options.held_out_pairs = 0;
  return options;
}

Samples baked(const CellMesh& mesh, const BakeOptions& options) {
  return test::need(bake(mesh, "test", options)).samples;
}

YarnCell cell_of(const std::string& stitch, const StitchSettings& settings) {
  CellOptions options;
  options.settings = settings;
  options.form = StitchForm::yarn;
  return test::need(find_cell(stitch, options)).yarn.value();
}

}  // namespace

TEST_CASE("a Lambert plane's samples are albedo / pi times the cosine, whatever its size") {
  for (const float period : {1e-3F, 1.0F, 5.0F, 1e3F}) {
    const Seen b = bake_mesh(floor_of(period, 1, 0.6F), small_bake());
    const std::vector<V3f> lights = cell_directions(b.header.lights);
    for (const float alpha : b.level.alpha) CHECK(alpha == 1);
    for (const V3f& n : b.level.normal_sum) CHECK(n.z == doctest::Approx(16));
    for (std::size_t i = 0; i < b.level.radiance.size(); ++i) {
      const double expected = 0.6 / pi * static_cast<double>(lights[i % lights.size()].z);
      // Samples are stored in half precision: 2^-11 relative.
      CHECK(std::abs(static_cast<double>(b.level.radiance[i].x) - expected) <= expected / 1024);
      CHECK(std::abs(static_cast<double>(b.level.radiance[i].y) - expected / 2) <= expected / 1024);
    }
    for (std::size_t i = 0; i < b.held_out.radiance.size(); ++i) {
      const V3f& light = b.held_out.pairs[i / 32].light;
      CHECK(std::abs(b.held_out.radiance[i].x - 0.6 / pi * static_cast<double>(light.z)) <= 1e-3);
    }
  }
}

TEST_CASE("a mesh is lit the same at any height and a million cells away, to the bit") {
  const Seen here = bake_mesh(fence(1, 0.5F, 0.6F, 0.3F), small_bake());
  // Half a millimetre is exact beside these.
  for (const V3f& away : {V3f(0, 0, 1e3F), V3f(0, 0, -65536), V3f(1e6F, 0, 0), V3f(3, -1e6F, 1e6F)}) {
    CellMesh mesh = fence(1, 0.5F, 0.6F, 0.3F);
    for (V3f& p : mesh.positions) p += away;
    const Seen there = bake_mesh(mesh, small_bake());
    CHECK(there.level.alpha == here.level.alpha);
    CHECK(there.level.radiance == here.level.radiance);
  }
}

TEST_CASE("a mesh is lit the same at any size") {
  const Seen unit = bake_mesh(fence(1, 0.5F, 0.6F, 0.3F), small_bake());
  for (const double size : {0x1.0p-20, 0x1.0p20, 1e-6, 1e6}) {
    CellMesh mesh = fence(1, 0.5F, 0.6F, 0.3F);
    mesh.period *= size;
    for (V3f& p : mesh.positions) p = V3f(V3d(p) * size);
    const Seen scaled = bake_mesh(mesh, small_bake());
    CHECK(static_cast<double>(scaled.header.period_mm.x) == doctest::Approx(size));
    CHECK(static_cast<double>(scaled.header.reference_height) == doctest::Approx(0.45 * size));
    const bool exact = std::log2(size) == std::round(std::log2(size));
    double difference = 0;
    double sum = 0;
    for (std::size_t i = 0; i < unit.level.radiance.size(); ++i) {
      difference += static_cast<double>((scaled.level.radiance[i] - unit.level.radiance[i]).length2());
      sum += static_cast<double>(unit.level.radiance[i].length2());
    }
    // Powers of two round nothing; others round the vertices' last bits, which moves a ray in thousands over
    // an edge.
    CHECK(std::sqrt(difference / sum) <= (exact ? 0 : 1e-2));
  }
}

TEST_CASE("the plane of the texels lies a tenth of the thickness below the top") {
  // Floor at 0 and a wall of height 0.5.
  CHECK(bake_mesh(fence(1, 0.5F, 0.6F, 0.3F), small_bake()).header.reference_height == 0.45F);
}

TEST_CASE("vertices that no triangle uses and whole periods of distance change nothing") {
  const CellMesh plain = floor_of(2, 1, 0.6F);
  CellMesh odd = plain;
  for (V3f& p : odd.positions) p += V3f(2000, -400, 0);
  odd.positions.emplace_back(50.0F, 0.0F, 3.0F);
  odd.normals.emplace_back(0.0F, 0.0F, 1.0F);
  odd.albedo.emplace_back(0.5F, 0.5F, 0.5F);
  const Seen a = bake_mesh(plain, small_bake());
  const Seen b = bake_mesh(odd, small_bake());
  CHECK(a.header.thickness_mm == b.header.thickness_mm);
  CHECK(a.level.alpha == b.level.alpha);
  CHECK(a.level.radiance == b.level.radiance);
}

TEST_CASE("holes are where there is no yarn, and radiance is not multiplied by opacity") {
  BakeOptions o = small_bake();
  o.views = 1;  // straight from above
  const Seen b = bake_mesh(floor_of(4, 0.5F + 1.0F / 16, 1.0F), o);
  const std::vector<V3f> lights = cell_directions(b.header.lights);
  for (std::size_t texel = 0; texel < 32; ++texel) {
    const std::size_t x = texel % 8;
    // Texel 4 is covered by half; 9 spread points tell that to within 1 of them.
    const double expected = x < 4 ? 1 : x == 4 ? 0.5 : 0;
    CHECK(std::abs(static_cast<double>(b.level.alpha[texel]) - expected) <= (x == 4 ? 1.0 / 9 + 1e-6 : 0));
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const double radiance = x <= 4 ? static_cast<double>(lights[l].z) / pi : 0;
      CHECK(static_cast<double>(b.level.radiance[texel * lights.size() + l].x) ==
            doctest::Approx(radiance).epsilon(1e-3));
    }
  }
}

TEST_CASE("a fence casts its shadow over as many neighbours as the light is low") {
  // Seen from above a point of the floor at distance d from the next wall towards the light is dark exactly
  // where the light's ray passes that wall below its top: d * lz / |lx| < height.
  constexpr double period = 2;
  BakeOptions o = small_bake();
  o.views = 1;
  o.bounces = 0;
  for (const double height : {0.5, 3.0}) {
    const Seen b = bake_mesh(fence(2, static_cast<float>(height), 1, 0), o);
    const std::vector<V3f> lights = cell_directions(b.header.lights);
    int checked = 0;
    for (std::size_t x = 0; x < 8; ++x) {
      for (std::size_t l = 0; l < lights.size(); ++l) {
        const double run = std::abs(static_cast<double>(lights[l].x));
        const auto dark = [&](double at) {
          const double d = lights[l].x > 0 ? period - at : at;
          return run > 1e-9 && d * static_cast<double>(lights[l].z) / run < height;
        };
        const bool from = dark(period * static_cast<double>(x) / 8 + 1e-6);
        const bool to = dark(period * static_cast<double>(x + 1) / 8 - 1e-6);
        if (from != to) continue;  // the shadow's edge lies within the texel
        const double expected = from ? 0 : static_cast<double>(lights[l].z) / pi;
        CHECK(static_cast<double>(b.level.radiance[x * lights.size() + l].x) ==
              doctest::Approx(expected).epsilon(1e-3));
        ++checked;
      }
    }
    CHECK(checked > 400);
  }
}

TEST_CASE("the same seed gives the same bytes for any number of threads, another seed other bytes") {
  const Folder folder;
  const CellMesh mesh = fence(2, 1, 0.5F, 0.8F);
  BakeOptions o = small_bake();
  const auto bake_to = [&](int threads, const char* name) {
    set_thread_limit(threads);
    test::need(write_samples(folder / name, test::need(bake(mesh, "test", o)).samples));
  };
  bake_to(1, "1.exr");
  bake_to(2, "2.exr");
  o.seed = 2;
  bake_to(0, "3.exr");
  CHECK(test::bytes_of(folder / "1.exr") == test::bytes_of(folder / "2.exr"));
  CHECK(test::bytes_of(folder / "1.exr") != test::bytes_of(folder / "3.exr"));
}

TEST_CASE("a large mesh that reaches beyond its cell is lit as one within it") {
  // Walls of many triangles, of which the ray tracer has little more than the cell.
  CellMesh mesh = fence(1, 0.05F, 0.9F, 0.9F);
  while (mesh.triangles.size() < 100000) {
    std::vector<V3i> finer;
    std::map<std::pair<int, int>, int> middles;
    for (const V3i& t : mesh.triangles) {
      V3i middle;
      for (int k = 0; k < 3; ++k) {
        const int next = t[(k + 1) % 3];
        const auto [edge, fresh] = middles.try_emplace(std::minmax(t[k], next), mesh.positions.size());
        middle[k] = edge->second;
        if (!fresh) continue;
        mesh.positions.push_back((mesh.positions[t[k]] + mesh.positions[next]) * 0.5F);
        mesh.normals.push_back(mesh.normals[t[k]]);
        mesh.albedo.push_back(mesh.albedo[t[k]]);
      }
      for (int k = 0; k < 3; ++k) finer.emplace_back(t[k], middle[k], middle[(k + 2) % 3]);
      finer.push_back(middle);
    }
    mesh.triangles = finer;
  }
  const V3f light = V3f(0.5F, 0.25F, 1).normalized();
  const auto radiance = [&](const CellMesh& cell) {
    const RayScene scene = test::need(RayScene::create(cell, "test"));
    NoiseSum ignored;
    const TexelBaker baker(scene, 2, {1, 1}, 0);
    return static_cast<double>(
        baker.bake_view({0, 0, 1}, {&light, 1}, 1 << 14, 1, ignored).radiance.front().x);
  };
  const double within = radiance(mesh);
  for (V3f& p : mesh.positions) p += V3f(0.4F, 0.7F, 0);
  CHECK(radiance(mesh) == doctest::Approx(within).epsilon(0.01));
}

TEST_CASE("bad input is refused before any light is traced") {
  BakeOptions o = small_bake();
  CellMesh mesh = floor_of(1, 1, 1);
  Code expected = Code::option_out_of_range;
  SUBCASE("zero texels") { o.width = 0; }
  SUBCASE("no views") { o.views = 0; }
  SUBCASE("no samples") { o.samples = 0; }
  SUBCASE("bounces below unlimited") { o.bounces = -2; }
  SUBCASE("an empty mesh") {
    mesh.triangles.clear();
    expected = Code::mesh_empty;
  }
  SUBCASE("triangles without area") {
    for (V3f& p : mesh.positions) p.y = p.x;
    expected = Code::mesh_empty;
  }
  SUBCASE("NaN in a vertex") {
    mesh.positions[2].y = std::nanf("");
    expected = Code::mesh_not_finite;
  }
  SUBCASE("a mesh far wider than its period") {
    mesh.period = V2d(0.01, 0.01);
    expected = Code::mesh_invalid;
  }
  CHECK(test::error_of(bake(mesh, "test", o)).code == expected);
}

TEST_CASE("yarns that a mesh does not know are found, and a surface that is no yarn is remarked") {
  BakeOptions o = small_bake();
  o.stores_yarns = true;
  o.validation_pairs = o.held_out_pairs = 1;
  CellMesh mesh = test::need(load_cell("plain-weave"));
  mesh.yarns = {};
  Baked baked = test::need(bake(mesh, "weave", o));
  CHECK(baked.report.remarks.empty());
  CHECK(baked.samples.header.yarns.curves == 4);

  baked = test::need(bake(fence(5, 3, 0.5F, 0.5F), "fence", o));
  REQUIRE(baked.report.remarks.size() == 1);
  CHECK(baked.report.remarks.front() == "100 % of the surface is not round yarn: no yarns are stored");
  CHECK(baked.samples.header.yarns.curves == 0);
}

TEST_CASE("the back of a Lambert plane is lit as its front, and nothing comes through") {
  const Samples samples = baked(floor_of(1, 1, 0.6F), both_sides());
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
  BakeOptions o = both_sides();
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
