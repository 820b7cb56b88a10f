#include "converter/bake/bake.h"

#include <fmt/format.h>

#include <algorithm>

#include "converter/bake/setup.h"
#include "converter/bake/texels.h"
#include "converter/bake/yarn_light.h"
#include "converter/mesh/find_yarns.h"
#include "format/base/guard.h"
#include "format/base/random.h"
#include "format/fabric/json_parts.h"

namespace selvedge {
namespace {

// Independent streams of random numbers.
constexpr std::uint64_t stream_views = 1;
constexpr std::uint64_t stream_cache = 4;
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
  lit.light.resize(std::size_t{light_values_per_station} * counts_of(lit).stations);
  const bool stored = found.fraction >= min_fraction && validate(lit, V2f(mesh.period)).has_value();
  if (!stored || found.fraction < fraction_without_remark) {
    report.remarks.push_back(fmt::format("{:.0f} % of the surface is not round yarn: {}",
                                         100 * (1 - found.fraction),
                                         stored ? "it is missing close by" : "no yarns are stored"));
  }
  return stored ? std::move(found.yarns) : YarnData();
}

/// The samples of one pair set. Indirect light is computed for many pairs together.
PairSamples bake_pairs(const TexelBaker& baker, IrradianceCache* cache, const TracedCell& cell,
                       const BakeOptions& o, const SamplesHeader& header, PairKind kind,
                       const std::function<void()>& done, NoiseSum& noise) {
  constexpr std::size_t at_once = 64;
  PairSamples result;
  result.width = header.width;
  result.height = header.height;
  result.pairs = header.pairs[index_of(kind)];
  std::vector<float> irradiance;
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  for (std::size_t p = 0; p < result.pairs.size(); ++p) {
    const DirectionPair& pair = result.pairs[p];
    const std::size_t first = p / at_once * at_once;
    LitBy lit{{&pair.light, 1}, {}, false};
    if (cache != nullptr) {
      const std::size_t count = std::min(at_once, result.pairs.size() - first);
      if (p == first) {
        std::vector<V3f> lights;
        for (std::size_t i = 0; i < count; ++i) lights.push_back(result.pairs[first + i].light);
        irradiance = cache->solve(cell.scene, lights, o.bounces);
      }
      lit.indirect = irradiance;
      lit.solved = count;
      lit.first = p - first;
    }
    NoiseSum of_pair;
    const PairSamples one =
        baker.bake_pair(pair, lit, header.truth_samples, seed_of(o.seed, stream_of(kind), p), of_pair);
    noise += of_pair;
    append(result.alpha, one.alpha);
    append(result.alpha_noise, one.alpha_noise);
    append(result.radiance, one.radiance);
    append(result.noise, one.noise);
    done();
  }
  return result;
}

/// The yarns with their light, heights above the lowest point of the cell, as their file gives them back.
YarnData lit_yarns(const TracedCell& cell, YarnData yarns, float lowest, const BakeOptions& o,
                   IrradianceCache* cache, const SamplesHeader& header) {
  for (V3f& node : yarns.nodes) node.z -= lowest;
  trace_yarn_light(cell, {o.yarn_paths, o.bounces, o.seed, o.both_sides}, cache, yarns);
  auto stored = value_or_throw(
      yarns_from_values(curve_values(yarns), indirect_values(yarns), header.yarns, header.period_mm));
  if (header.both_sides)
    stored.through = light_from_values(indirect_values(yarns, true), header.yarns.stations);
  value_or_throw(validate(stored, header.period_mm));
  return stored;
}

double coverage_of(const Samples& samples) {
  double sum = 0;
  for (const ViewSamples& view : samples.views)
    for (const float alpha : view.alpha) sum += static_cast<double>(alpha);
  return sum / (static_cast<double>(samples.header.view_count()) * samples.header.texels());
}

Baked baked_cell(const CellMesh& given, const std::string& name, const BakeOptions& options,
                 const std::string& provenance, const Progress& progress) {
  const Stopwatch watch;
  BakeOptions o = options;
  value_or_throw(check_options(o, name));
  const auto cell = value_or_throw(trace_cell(given, name, o.ground));
  Baked baked;
  BakeReport& report = baked.report;
  CellMesh mesh = given;
  if (o.yarns) mesh.yarns = stored_yarns(given, report);
  const auto plane = value_or_throw(plane_of(mesh, cell, name, o));

  std::optional<IrradianceCache> cache;
  if (o.indirect == IndirectLight::cached) {
    cache = IrradianceCache::build(cell.scene, seed_of(o.seed, stream_cache, 0), o.both_sides);
    if (!cache) {
      o.indirect = IndirectLight::traced;
      report.remarks.push_back(
          fmt::format("the mesh needs more than {} points for cached indirect light: paths are traced, which "
                      "takes longer and is noisier",
                      max_shared_points));
    }
  }
  IrradianceCache* const cached = cache ? &*cache : nullptr;
  Samples& samples = baked.samples;
  SamplesHeader& header = samples.header = samples_header(mesh, o, plane, cell.thickness_mm(), provenance);
  const TexelBaker baker(cell.scene, cached, o.bounces, V2i(o.width, o.height), plane / cell.mm);
  // Work is measured in rays times lights.
  const double view_work = 1.0 * header.samples_per_texel * header.light_count();
  const double pair_work = header.truth_samples;
  double left = view_work * header.view_count();
  for (const auto& pairs : header.pairs) left += pair_work * static_cast<double>(pairs.size());
  const double whole = left;
  const auto done = [&](double work) {
    left -= work;
    if (progress) progress(1 - left / whole);
  };

  const std::vector<V3f> views = directions_of(header.views, header.both_sides);
  const std::vector<V3f> lights = directions_of(header.lights, header.both_sides);
  NoiseSum noise;
  {
    std::vector<float> irradiance;
    if (cached != nullptr) irradiance = cached->solve(cell.scene, lights, o.bounces);
    for (std::size_t v = 0; v < views.size(); ++v) {
      NoiseSum of_view;
      ViewSamples view = baker.bake_view(views[v], {lights, irradiance}, o.samples,
                                         seed_of(o.seed, stream_views, v), of_view);
      noise += of_view;
      if (views[v].z < 0)
        for (V3f& normal : view.normal) normal = mirrored(normal);
      samples.views.push_back(std::move(view));
      done(view_work);
    }
  }
  ByPairKind<NoiseSum> truth_noise;
  for (const PairKind kind : all_pair_kinds) {
    samples.pairs[index_of(kind)] = bake_pairs(
        baker, cached, cell, o, header, kind, [&] { done(pair_work); }, truth_noise[index_of(kind)]);
  }
  const double noise_of_truth = truth_noise[index_of(PairKind::held_out)].relative();
  if (header.yarns.curves > 0) {
    samples.yarns = lit_yarns(cell, mesh.yarns, bounds_of(mesh).min.z, o, cached, header);
  }

  const auto warnings = value_or_throw(round_as_stored(samples));
  for (const Error& warning : warnings) report.remarks.push_back(to_line(warning));
  nlohmann::json text = provenance_json(header.provenance);
  text["bake"]["noise"] = {{"samples", noise.relative()}, {"truth", noise_of_truth}};
  header.provenance = text.dump();
  report.coverage = coverage_of(samples);
  report.noise = noise.relative();
  report.truth_noise = noise_of_truth;
  report.samples = header.samples_per_texel;
  report.truth_samples = header.truth_samples;
  report.reference_height = plane;
  report.indirect = o.indirect;
  report.rays = baker.rays() + (cached != nullptr ? cached->rays() : 0);
  report.seconds = watch.seconds();
  return baked;
}

}  // namespace

Result<Baked> bake(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                   const std::string& provenance, const Progress& progress) {
  return result_of([&] { return baked_cell(mesh, name, options, provenance, progress); });
}

}  // namespace selvedge
