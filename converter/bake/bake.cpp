#include "converter/bake/bake.h"

#include <fmt/format.h>

#include <algorithm>

#include "converter/bake/setup.h"
#include "converter/bake/texels.h"
#include "converter/bake/yarn_samples.h"
#include "converter/light/kept_light.h"
#include "converter/light/light_bands.h"
#include "converter/mesh/find_yarns.h"
#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/base/random.h"
#include "format/fabric/json_io.h"

namespace selvedge {
namespace {

// Independent streams of random numbers.
constexpr std::uint64_t stream_views = 1;
std::uint64_t stream_of(PairKind kind) { return 2 + 16 * (static_cast<std::uint64_t>(kind) + 1); }

/// The yarns to store: the yarns of the mesh, or else yarns found in its surface. Heights are the mesh's; a
/// mesh whose surface is not almost all yarn gets no yarns, since close by nothing else is seen.
/// Precondition: validate(mesh) holds.
YarnData stored_yarns(const CellMesh& mesh, BakeReport& report) {
  constexpr double min_fraction = 0.9;
  constexpr double fraction_without_remark = 0.99;
  if (!mesh.yarns.curves.empty()) return mesh.yarns;
  FoundYarns found = find_yarns(mesh);
  YarnData lit = found.yarns;
  lit.station_light.resize(std::size_t{light_values_per_station} * counts_of(lit).stations);
  const bool stored = found.explained_fraction >= min_fraction && validate(lit, V2f(mesh.period)).has_value();
  if (!stored || found.explained_fraction < fraction_without_remark)
    report.remarks.push_back(fmt::format("{:.0f} % of the surface is not round yarn: {}",
                                         100 * (1 - found.explained_fraction),
                                         stored ? "it is missing close by" : "no yarns are stored"));
  return stored ? std::move(found.yarns) : YarnData();
}

/// The yarns with their light, as their file gives them back.
YarnData lit_yarns(const YarnCell& cell, const BakeOptions& o, const SamplesHeader& header,
                   BakeReport& report, bool is_huge = false, const Progress& progress = {}) {
  YarnData yarns = cell.yarns;
  yarns.station_light.assign(std::size_t{light_values_per_station} * counts_of(yarns).stations, 0);
  value_or_throw(validate(yarns, header.period_mm));
  LineLightOptions lines{.both_sides = o.both_sides, .progress = progress};
  if (is_huge) lines.spacing_radii *= 2;
  if (o.has_coarse_light) {
    lines.direction_count = 32;
    lines.spacing_radii = 1;
  }
  const bool is_kept =
      o.similar_yarn != nullptr &&
      relight_near_changes(yarns, header.period_mm, cell.wall_transmission, *o.similar_yarn, lines);
  if (!is_kept && !compute_light_in_bands(yarns, header.period_mm, cell.wall_transmission, lines))
    report.remarks.emplace_back("yarn that absorbs next to nothing: some of its light may be missing");
  auto stored = value_or_throw(yarns_from_values(curve_values(yarns), indirect_values(yarns), header.yarns,
                                                 header.period_mm, yarns.map));
  if (header.both_sides)
    stored.light_through = light_from_values(indirect_values(yarns, true), header.yarns.stations);
  value_or_throw(validate(stored, header.period_mm));
  return stored;
}

/// Samples all views and pairs by view(direction, lights, number, noise) and pair(directions, kind, number,
/// noise), `at_once` of them on several threads; rounds the samples as their file stores them, and reports on
/// them. Progress goes on from `begin`.
template <class View, class Pair>
void sample_all(Baked& baked, const BakeOptions& o, std::size_t at_once, const Progress& progress,
                double begin, const View& view, const Pair& pair) {
  Samples& samples = baked.samples;
  const SamplesHeader& header = samples.header;
  // Work is counted in rays times lights.
  const double work_of_view = 1.0 * header.samples_per_texel * header.light_count();
  double whole = work_of_view * header.view_count();
  for (const auto& pairs : header.pairs) whole += header.truth_samples * static_cast<double>(pairs.size());
  double done = 0;
  const auto in_parallel = [&](std::size_t count, double each, const auto& sample) {
    std::vector<NoiseSum> noise(count);
    for (std::size_t first = 0; first < count; first += at_once) {
      const std::size_t end = std::min(count, first + at_once);
      parallel_for(static_cast<int>(first), static_cast<int>(end), [&](int i) { sample(i, noise[i]); });
      done += each * static_cast<double>(end - first);
      if (progress) progress(begin + (1 - begin) * done / whole);
    }
    NoiseSum sum;
    for (const NoiseSum& one : noise) sum += one;
    return sum;
  };
  const std::vector<V3f> views = cell_directions(header.views, header.both_sides);
  const std::vector<V3f> lights = cell_directions(header.lights, header.both_sides);
  samples.views.resize(views.size());
  const NoiseSum noise = in_parallel(views.size(), work_of_view, [&](int i, NoiseSum& own) {
    samples.views[i] = view(views[i], lights, i, own);
  });
  NoiseSum held_out;
  for (const PairKind kind : all_pair_kinds) {
    PairSamples& set = samples.pairs[index_of(kind)];
    set = {.width = header.width, .height = header.height, .pairs = header.pairs[index_of(kind)]};
    std::vector<PairSamples> pairs(set.pairs.size());
    const NoiseSum of_kind = in_parallel(pairs.size(), header.truth_samples, [&](int i, NoiseSum& own) {
      pairs[i] = pair(set.pairs[i], kind, i, own);
    });
    if (kind == PairKind::held_out) held_out = of_kind;
    const auto add = [](auto& all, const auto& more) { all.insert(all.end(), more.begin(), more.end()); };
    for (const PairSamples& one : pairs) {
      add(set.alpha, one.alpha);
      add(set.alpha_noise, one.alpha_noise);
      add(set.radiance, one.radiance);
      add(set.noise, one.noise);
    }
  }
  BakeReport& report = baked.report;
  value_or_throw(round_to_half(samples));
  nlohmann::json text = provenance_json(header.provenance);
  text["bake"]["noise"] = {{"samples", noise.relative_error()}, {"truth", held_out.relative_error()}};
  samples.header.provenance = text.dump();
  for (const ViewSamples& seen : samples.views)
    for (const float alpha : seen.alpha) report.coverage += static_cast<double>(alpha);
  report.coverage /= static_cast<double>(header.view_count()) * header.texels();
  report.noise = noise.relative_error();
  report.truth_noise = held_out.relative_error();
  report.samples = header.samples_per_texel;
  report.truth_samples = header.truth_samples;
  report.reference_height = static_cast<double>(header.reference_height);
  report.indirect = o.indirect;
}

}  // namespace

Result<Baked> bake(const CellMesh& given, const std::string& name, const BakeOptions& options,
                   const std::string& provenance, const Progress& progress) {
  return catch_failure([&] {
    const Stopwatch watch;
    BakeOptions o = options;
    value_or_throw(check_options(o, name));
    const auto traced = value_or_throw(trace_cell(given, name));
    Baked baked;
    BakeReport& report = baked.report;
    CellMesh mesh = given;
    if (o.stores_yarns) mesh.yarns = stored_yarns(given, report);
    YarnCell cell = yarn_cell_of(mesh);
    cell.thickness = traced.thickness_mm();
    const double plane = plane_height_fraction * cell.thickness;

    Samples& samples = baked.samples;
    SamplesHeader& header = samples.header = samples_header(cell, digest_of(mesh), o, plane, provenance);
    const TexelBaker baker(traced.scene, o.bounces, V2i(o.width, o.height), plane / traced.mm_per_unit);
    if (header.yarns.curves > 0) samples.yarns = lit_yarns(cell, o, header, report);
    // One after the other: rays take all threads for one.
    sample_all(
        baked, o, 1, progress, 0,
        [&](const V3f& view, std::span<const V3f> lights, int v, NoiseSum& noise) {
          ViewSamples seen =
              baker.bake_view(view, lights, o.samples, seed_of(o.seed, stream_views, v), noise);
          if (view.z < 0)
            for (V3f& normal : seen.normal) normal = mirrored(normal);
          return seen;
        },
        [&](const DirectionPair& pair, PairKind kind, int p, NoiseSum& noise) {
          return baker.bake_pair(pair, header.truth_samples, seed_of(o.seed, stream_of(kind), p), noise);
        });
    report.seconds = watch.seconds();
    return baked;
  });
}

Result<Baked> bake(const YarnCell& given, const std::string& name, const BakeOptions& options,
                   const std::string& provenance, const Progress& progress) {
  return catch_failure([&] {
    const Stopwatch watch;
    // So much cloth is hardly seen close by.
    constexpr int many_stations = 1 << 16, fewest = 4;
    const bool is_huge = counts_of(given.yarns).stations > many_stations;
    YarnCell cell = given;
    for (YarnCurve& curve : cell.yarns.curves)
      if (is_huge) curve.stations = std::max(std::min(curve.stations, fewest), curve.stations / 2);
    BakeOptions o = options;
    o.stores_yarns = true;
    o.indirect = IndirectLight::lines;
    o.bounces = unlimited_bounces;
    value_or_throw(check_options(o, name));
    for (int* points : {&o.samples, &o.truth_samples})
      *points = points_per_texel(V2i(o.width, o.height), *points);
    const double plane = plane_height_fraction * cell.thickness;
    Baked baked;
    Samples& samples = baked.samples;
    SamplesHeader& header = samples.header = samples_header(cell, digest_of(cell), o, plane, provenance);
    // Light takes about a fifth of the time of charts of many stitches.
    constexpr double light_part = 0.2;
    const Progress of_light = [&](double fraction) { progress(light_part * fraction); };
    samples.yarns = lit_yarns(cell, o, header, baked.report, is_huge, progress ? of_light : Progress());
    YarnSampler sampler(std::move(samples.yarns), cell, header.reference_height, V2i(o.width, o.height),
                        o.both_sides);
    constexpr std::size_t at_once = 32;
    sample_all(
        baked, o, at_once, progress, light_part,
        [&](const V3f& view, std::span<const V3f> lights, int, NoiseSum& noise) {
          return sampler.sample_view(view, lights, o.samples, noise);
        },
        [&](const DirectionPair& pair, PairKind, int, NoiseSum& noise) {
          return sampler.sample_pair(pair, header.truth_samples, noise);
        });
    if (options.stores_yarns)
      samples.yarns = sampler.take_yarn();
    else
      header.yarns = {};
    baked.report.seconds = watch.seconds();
    return baked;
  });
}

}  // namespace selvedge
