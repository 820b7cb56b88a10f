#include "converter/bake/bake.h"
#include "converter/light/light_bands.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "converter/make/pack_yarn.h"
#include "converter/stitch/find_cell.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/atomic_file.h"
#include "format/fabric/file.h"
#include "format/samples/samples.h"
#include "tests/converter/load_cell.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

/// The mean of alpha f, in all colours, and of alpha over a repeat; what the yarn says and what the bake
/// says.
struct Means {
  double yarn = 0, baked = 0;
  double yarn_alpha = 0, baked_alpha = 0;
};

struct BakedYarn {
  SamplesHeader header;
  PairSamples pairs;
  YarnData yarns;
};

CellMesh mesh_of(const std::string& stitch, const StitchSettings& settings) {
  const auto found = need(find_stitch(stitch, of_tubes(settings)));
  return need(mesh_stitch(found.pattern));
}

BakedYarn bake_mesh(const CellMesh& mesh, int bounces = unlimited_bounces) {
  BakeOptions options{.width = 8,
                      .height = 8,
                      .views = 4,
                      .lights = 4,
                      .samples = 1,
                      .bounces = bounces,
                      .validation_pairs = 1,
                      .held_out_pairs = 24,
                      .truth_samples = 128,
                      .stores_yarns = true};
  Samples samples = need(bake(mesh, "stitch", options)).samples;
  BakedYarn baked{samples.header, std::move(samples.pairs[index_of(PairKind::held_out)]),
                  std::move(samples.yarns)};
  CHECK(counts_of(baked.yarns) == baked.header.yarns);
  for (std::size_t c = 0; c < mesh.yarns.curves.size(); ++c)
    CHECK(baked.yarns.curves[c] == mesh.yarns.curves[c]);
  const float low = bounds_of(mesh).min.z;
  for (std::size_t n = 0; n < mesh.yarns.nodes.size(); ++n)
    CHECK(baked.yarns.nodes[n] == mesh.yarns.nodes[n] - V3f(0, 0, low));
  return baked;
}

Means means_of(const BakedYarn& baked, const Yarns& yarns, std::size_t pair) {
  const DirectionPair& directions = baked.pairs.pairs[pair];
  const int texels = baked.header.texels();
  Means means;
  for (int t = 0; t < texels; ++t) {
    const std::size_t i = pair * texels + t;
    const V3f& f = baked.pairs.radiance[i];
    means.baked += static_cast<double>(baked.pairs.alpha[i] * (f.x + f.y + f.z)) / texels;
    means.baked_alpha += static_cast<double>(baked.pairs.alpha[i]) / texels;
  }
  constexpr int side = 48;
  for (int i = 0; i < side * side; ++i) {
    const V2d uv((i % side + 0.5) / side, (i / side + 0.5) / side);
    const Shading s = yarns.shade(uv, baked.header.reference_height, directions.light, directions.view);
    means.yarn += static_cast<double>(s.alpha * (s.radiance.x + s.radiance.y + s.radiance.z)) / (side * side);
    means.yarn_alpha += static_cast<double>(s.alpha) / (side * side);
  }
  return means;
}

/// Fraction of even light from all around that the cloth sends to each view, with its holes filled by that
/// light.
std::vector<double> seen_in_furnace(const YarnCell& cell) {
  BakeOptions o{.width = 8,
                .height = 8,
                .views = 16,
                .lights = 256,
                .samples = 36,
                .both_sides = true,
                .validation_pairs = 0,
                .held_out_pairs = 0};
  const Samples samples = need(bake(cell, "furnace", o)).samples;
  const std::vector<V3f> lights = cell_directions(samples.header.lights, true);
  const std::size_t texels = samples.header.texels();
  std::vector<double> seen;
  for (const ViewSamples& view : samples.views) {
    double sum = 0;
    for (std::size_t i = 0; i < view.radiance.size(); ++i)
      sum += static_cast<double>(view.alpha[i % texels] * view.radiance[i].x) * 4 * std::numbers::pi /
             static_cast<double>(lights.size());
    for (const float alpha : view.alpha) sum += 1 - static_cast<double>(alpha);
    seen.push_back(sum / static_cast<double>(texels));
  }
  return seen;
}

StitchPattern tubes(const std::string& stitch, float albedo, double transmission) {
  StitchPattern pattern = need(find_stitch(stitch, of_tubes())).pattern;
  for (Yarn& yarn : pattern.yarns) {
    yarn.albedo = V3f(albedo);
    yarn.gloss = {};
    yarn.transmission = transmission;
  }
  return pattern;
}

constexpr int waves = 40;
constexpr int nodes_per_wave = 12;
constexpr int stations_per_wave = 30;
const V2f period(waves, 2);

/// A squashed yarn along x that rises and falls, with light from either side that changes with its height and
/// with the angle.
YarnData wave(int count = waves) {
  YarnData data;
  YarnCurve curve;
  curve.nodes = count * nodes_per_wave;
  curve.stations = count * stations_per_wave;
  curve.repeat_offset = {1, 0};
  curve.radius = 0.2F;
  curve.gloss.lustre = 0.5F;
  data.curves = {curve};
  const auto phase = [](int place, int places) {
    return 2 * std::numbers::pi_v<float> * static_cast<float>(place) / static_cast<float>(places);
  };
  for (int i = 0; i < curve.nodes; ++i) {
    data.nodes.emplace_back(period.x * static_cast<float>(i) / static_cast<float>(curve.nodes), 1,
                            0.3F + 0.1F * std::sin(phase(i, nodes_per_wave)));
    // The flattest that validate() takes, of either sign.
    const V3f flattest = V3f(0.1F, 0.2F, 1).normalized() * std::sqrt(1 - min_flattening) * 0.9999F;
    data.curves[0].squeezes.push_back(i % 3 == 0 ? flattest : -flattest);
  }
  for (auto* light : {&data.station_light, &data.light_through})
    for (int s = 0; s < curve.stations; ++s)
      for (int i = 0; i < light_values_per_station; ++i)
        light->push_back(0.02F + 0.01F * std::sin(phase(s, stations_per_wave) + static_cast<float>(i % 27)) /
                                     static_cast<float>(1 + i / 27));
  return data;
}

Fabric fabric_of(const YarnData& data) {
  Fabric fabric = test::random_fabric(8, 8, {2, 2}, 1, 5);
  fabric.period_mm = period;
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(data, period));
  return fabric;
}

}  // namespace

TEST_CASE(
    "yarn is as bright and as dense as the samples of its stitch, opaque, translucent, flat and of plies") {
  const StitchSettings translucent{{"transmission", {0.6}}};
  const StitchSettings plies{{"plies", {3}}};
  const StitchSettings flat{{"flattening", {0.7}}};
  for (const auto& [name, settings] :
       {std::pair("plain-knit", StitchSettings()), std::pair("plain-weave", StitchSettings()),
        std::pair("plain-knit", translucent), std::pair("plain-knit", plies), std::pair("twill", flat)}) {
    const std::string stitch = name;
    CAPTURE(stitch);
    const BakedYarn baked = bake_mesh(mesh_of(stitch, settings));
    const Yarns yarns(baked.yarns, baked.header.period_mm);
    double error = 0;
    double sum = 0;
    for (std::size_t p = 0; p < baked.pairs.pairs.size(); ++p) {
      const Means m = means_of(baked, yarns, p);
      error += std::pow(m.yarn - m.baked, 2);
      sum += std::pow(m.baked, 2);
      CHECK(std::abs(m.yarn_alpha - m.baked_alpha) < 0.01);
    }
    // 0.6, 0.8, 0.9, 1.5 (plies) and 0.6 % (flat).
    CHECK(std::sqrt(error / sum) < 0.02);
  }
}

TEST_CASE("the moments tell by which view light of other yarn leaves yarn with lustre") {
  const StitchSettings silky{{"warp_lustre", {0.8}}, {"weft_lustre", {0.8}}};
  const CellMesh mesh = mesh_of("satin", silky);
  const BakedYarn baked = bake_mesh(mesh);
  const BakedYarn direct = bake_mesh(mesh, 0);
  YarnData without = baked.yarns;
  for (std::size_t i = 0; i < without.station_light.size(); ++i)
    if (i % light_values_per_station >= transfer_values_per_station) without.station_light[i] = 0;
  const V2f period = baked.header.period_mm;
  const auto yarns_of = [&](const YarnData& data) { return Yarns(data, baked.header.period_mm); };
  YarnData dark = without;
  std::ranges::fill(dark.station_light, 0.0F);
  const std::array versions{yarns_of(dark), yarns_of(without), yarns_of(baked.yarns)};
  const std::size_t texels = baked.header.texels();
  double product = 0;
  double squares = 0;
  for (std::size_t i = 0; i < baked.pairs.radiance.size(); ++i) {
    const auto& [light, view] = baked.pairs.pairs[i / texels];
    constexpr int side = 6;
    std::array<double, 3> f{};
    for (int k = 0; k < side * side; ++k) {
      const V2d texel(static_cast<double>(i % texels % 8), static_cast<double>(i % texels / 8));
      const V2d uv = (texel + V2d((k % side + 0.5) / side, (k / side + 0.5) / side)) / 8;
      for (std::size_t n = 0; n < f.size(); ++n) {
        const Shading s = versions[n].shade(uv, baked.header.reference_height, light, view);
        f[n] += static_cast<double>(s.radiance.y) / (side * side);
      }
    }
    const double traced =
        static_cast<double>(baked.pairs.alpha[i] * (baked.pairs.radiance[i] - direct.pairs.radiance[i]).y);
    product += (f[2] - f[1]) * (traced - (f[1] - f[0]));
    squares += (f[2] - f[1]) * (f[2] - f[1]);
  }
  // The change that they make is the change that the truth has, whatever its noise.
  CHECK(product / squares == doctest::Approx(1).epsilon(0.2));
}

TEST_CASE("a yarn that lies alone has no light but its own") {
  StitchPattern pattern;
  pattern.name = "alone";
  pattern.period_mm = {4, 40};
  Yarn yarn{.radius_mm = 0.5, .segments = {{V3d(0, 2, 0), V3d(1, 2, 0), V3d(3, 2, 0), V3d(4, 2, 0)}}};
  pattern.yarns = {yarn};
  YarnCell cell = need(yarn_cell_of(pattern));
  YarnData& data = cell.yarns;
  CHECK(compute_yarn_light(data, {4, 40}, cell.wall_transmission));
  // Copies 40 mm away fill 1/80 of what either flank sees: 0.002 of albedo 0.5 twice.
  const Yarns yarns(data, {4, 40});
  YarnPoint point;
  for (int i = 0; i < 64; ++i) {
    const float angle = static_cast<float>(i) * 0.1F;
    point.angle_cosine = std::cos(angle);
    point.angle_sine = std::sin(angle);
    const LightTransfer transfer = yarns.transfer_at(point);
    for (const V3f& light : cell_directions({4, 4})) CHECK(indirect_light(transfer, light).x < 0.003F);
  }
}

TEST_CASE("cloth that is lit in bands of rows has the light of the whole") {
  constexpr int rows = 40;
  StitchPattern pattern;
  pattern.name = "rows";
  pattern.period_mm = {4, 1.1 * rows};
  for (int i = 0; i < rows; ++i) {
    const double y = 1.1 * i;
    const double z = 0.2 * (i % 3);
    pattern.yarns.push_back({.radius_mm = 0.5,
                             .albedo = V3f(i % 2 == 0 ? 0.8F : 0.3F, 0.5F, 0.1F),
                             .segments = {{V3d(0, y, z), V3d(1, y, z), V3d(3, y, z), V3d(4, y, z)}}});
  }
  const YarnCell cell = need(yarn_cell_of(pattern));
  const V2f period(cell.period);
  YarnData whole = cell.yarns;
  YarnData banded = cell.yarns;
  const LineLightOptions options{.both_sides = true, .spacing_radii = 0.1F};
  CHECK(compute_yarn_light(whole, period, cell.wall_transmission, options));
  const int stations = counts_of(whole).stations;
  CHECK(compute_light_in_bands(banded, period, cell.wall_transmission, options, stations / 2));
  // The mean around a row, of light from above: rows have two colours and three heights.
  constexpr int kinds = 6;
  for (const auto& light : {&YarnData::station_light, &YarnData::light_through}) {
    CHECK(banded.*light != whole.*light);
    const auto basis = light_basis(V3f(0, 0, 1));
    const auto mean_of = [&](const YarnData& data, int first, int step) {
      float sum = 0;
      for (int s = 0; s < stations; ++s)
        for (int k = 0; k < yarn_light_function_count && s * rows / stations % step == first; ++k)
          sum += (data.*light)[std::size_t{light_values_per_station} * s + 3 * k] * basis[k];
      return sum * static_cast<float>(step) / static_cast<float>(stations);
    };
    for (int kind = 0; kind < kinds; ++kind) {
      const float expected = mean_of(whole, kind, kinds);
      CHECK(expected > 0.003F);
      CHECK(std::abs(mean_of(banded, kind, kinds) - expected) < 0.08F * expected);
    }
  }
}

TEST_CASE("white yarn is white in a white furnace, from both sides, opaque and translucent") {
  for (const auto& [name, transmission] :
       {std::pair("plain-weave", 0.0), {"plain-knit", 0.5}, {"satin", 1.0}}) {
    const std::string stitch = name;
    CAPTURE(stitch);
    CAPTURE(transmission);
    const auto seen = seen_in_furnace(need(yarn_cell_of(tubes(stitch, 1, transmission))));
    double mean = 0;
    // Neighbouring views in pairs: one alone has a quarter of a percent of the noise of its lines.
    for (std::size_t i = 0; i < seen.size(); i += 2) {
      const double value = (seen[i] + seen[i + 1]) / 2;
      mean += 2 * value / static_cast<double>(seen.size());
      CHECK(std::abs(value - 1) < 0.025);
    }
    CHECK(std::abs(mean - 1) < 0.012);
  }
}

TEST_CASE("yarn's light is finite and loses or settles, at the extremes") {
  StitchPattern thin = tubes("plain-weave", 0.5F, 0);
  thin.yarns.front().radius_mm /= 20;
  StitchPattern inside = tubes("plain-weave", 0.5F, 0.5);
  inside.yarns.push_back(inside.yarns.front());  // lies in itself
  StitchPattern many = need(find_stitch("plain-weave", {{"warp_plies", {8}}, {"weft_plies", {8}}})).pattern;
  StitchPattern tiny = tubes("twill", 0.5F, 0.5);
  for (auto& [what, pattern] :
       std::vector<std::pair<const char*, StitchPattern>>{{"thin", thin},
                                                          {"inside", inside},
                                                          {"eight plies", many},
                                                          {"black", tubes("twill", 0, 0.5)},
                                                          {"bright", tubes("rib", 0.999F, 0.01)},
                                                          {"clear", tubes("lace", 0.999F, 1)}}) {
    const std::string which = what;
    CAPTURE(which);
    YarnCell cell = need(yarn_cell_of(pattern));
    CHECK(compute_yarn_light(cell.yarns, V2f(cell.period), cell.wall_transmission, {true}));
    need(validate(cell.yarns, V2f(cell.period)));
    // No place sends more than falls on it from all around, but for the error of its nine functions.
    const Yarns yarns(cell.yarns, V2f(cell.period));
    const std::vector<V3f> lights = cell_directions(nearly_square_grid(64));
    for (int c = 0; c < static_cast<int>(cell.yarns.curves.size()); ++c) {
      for (const StationPoint& place : points_around_station(yarns, c, 0, 16)) {
        float even = 0;
        for (const auto* light : {&cell.yarns.station_light, &cell.yarns.light_through}) {
          const float* values = &(*light)[yarns.geometry().first_station[c] * light_values_per_station];
          LightTransfer transfer{};
          for (const float a : place.functions)
            for (float& value : transfer) value += a * *values++;
          for (const V3f& from : lights)
            even += indirect_light(transfer, from).x * 2 * std::numbers::pi_v<float> / 64;
        }
        CHECK(even < 1.15F);
      }
    }
  }
}

TEST_CASE("packed yarn is what it was to rounding; yarn of a few stitches stays as it is") {
  const YarnData given = wave();
  const YarnData packed = packed_if_large(given);
  REQUIRE(packed.packing.step > 0);
  REQUIRE(validate(packed, period));
  CHECK(packed.packing.function_count() < 8);  // of waves that repeat
  for (std::size_t i = 0; i < given.nodes.size(); ++i) {
    CHECK((packed.nodes[i] - given.nodes[i]).length() <= 0.2F / 64);
    const V3f& squeeze = given.curves[0].squeezes[i];
    const V3f& now = packed.curves[0].squeezes[i];
    CHECK(std::min((now - squeeze).length(), (now + squeeze).length()) < 0.06F);
  }
  double error = 0;
  double sum = 0;
  for (const auto& [before, after] : {std::pair(&given.station_light, &packed.station_light),
                                      std::pair(&given.light_through, &packed.light_through)}) {
    REQUIRE(before->size() == after->size());
    for (std::size_t i = 0; i < before->size(); ++i) {
      error += std::pow((*after)[i] - (*before)[i], 2.0);
      sum += std::pow((*before)[i], 2.0);
    }
  }
  CHECK(error < 0.01 * sum);
  const YarnData few = wave(8);
  CHECK(packed_if_large(few) == few);
}

TEST_CASE("a fabric of packed yarn is of version 5, a fifth as large, and read as it was written") {
  const test::Folder folder;
  const auto written = [&](const YarnData& data, const char* name) {
    test::need(write_fabric(folder / name, fabric_of(data), {half_precision_layers}));
    return test::need(read_file(folder / name));
  };
  const YarnData packed = packed_if_large(wave());
  const std::string plain = written(wave(), "4.exr");
  const std::string text = written(packed, "5.exr");
  CHECK(plain.find("\"version\":[4,0]") != std::string::npos);
  CHECK(text.find("\"version\":[5,0]") != std::string::npos);
  CHECK(5 * text.size() < plain.size());
  YarnData read = test::need(read_fabric(folder / "5.exr")).levels.front().yarns()->data();
  // Light that comes through is a side's, which this fabric has not.
  read.light_through = packed.light_through;
  read.packing.factors_through = packed.packing.factors_through;
  CHECK(read == packed);
}
