#include "converter/bake/unit_baker.h"

#include <fmt/format.h>

#include <algorithm>

#include "converter/bake/setup.h"
#include "converter/bake/yarn_light.h"
#include "format/base/random.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

// Independent streams of random numbers.
constexpr std::uint64_t stream_views = 1;
constexpr std::uint64_t stream_pairs = 2;

std::uint64_t stream_of(PairKind kind) { return stream_pairs + 16 * (static_cast<std::uint64_t>(kind) + 1); }

std::span<float> floats_of(std::vector<V3f>& vectors) { return {&vectors.data()->x, 3 * vectors.size()}; }

/// What a reader of the file would refuse and OpenEXR does not.
template <class Samples>
Result<void> check_samples(const Samples& samples) {
  const auto refuse = [](const char* place, float value) {
    return fail(Code::samples_not_finite, {}, place, fmt::format("sample is {}", value));
  };
  for (const float alpha : samples.alpha)
    if (!is_opacity(alpha)) return refuse("opacity", alpha);
  for (const V3f& radiance : samples.radiance) {
    for (int c = 0; c < 3; ++c)
      if (!is_radiance(radiance[c])) return refuse("radiance", radiance[c]);
  }
  return {};
}

Planes arrays_of(ViewSamples& s) { return {s.alpha, floats_of(s.normal), floats_of(s.radiance)}; }
Planes arrays_of(PairSamples& s) {
  return {s.alpha, s.alpha_noise, floats_of(s.radiance), floats_of(s.noise)};
}
Planes arrays_of(YarnSamples& s) {
  if (s.through.empty()) return {s.curves, s.indirect};
  return {s.curves, s.indirect, s.through};
}

}  // namespace

std::vector<BakeUnit> units_of(const SamplesHeader& header) {
  std::vector<BakeUnit> units;
  const std::size_t views = header.view_count();
  for (std::size_t v = 0; v < views; ++v) {
    units.push_back({BakeUnit::Kind::view, PairKind::validation, v});
  }
  for (const PairKind kind : all_pair_kinds) {
    for (std::size_t p = 0; p < header.pairs[index_of(kind)].size(); ++p) {
      units.push_back({BakeUnit::Kind::pair, kind, p});
    }
  }
  if (header.yarns.curves > 0) units.push_back({BakeUnit::Kind::yarns, PairKind::validation, 0});
  return units;
}

std::size_t value_count(const SamplesHeader& header, const BakeUnit& unit) {
  const std::size_t texels = header.texels();
  if (unit.kind == BakeUnit::Kind::view) return texels * (4 + 3 * header.light_count());
  if (unit.kind == BakeUnit::Kind::pair) return 8 * texels;
  return curve_value_count(header.yarns) +
         std::size_t{light_values_per_station} * header.yarns.stations * header.sides();
}

UnitSamples blank_samples(const SamplesHeader& header, const BakeUnit& unit) {
  const std::size_t texels = header.texels();
  const auto floats = [](std::size_t count) { return std::vector<float>(count); };
  const auto vectors = [](std::size_t count) { return std::vector<V3f>(count); };
  switch (unit.kind) {
    case BakeUnit::Kind::view:
      return ViewSamples{floats(texels), vectors(texels), vectors(texels * header.light_count())};
    case BakeUnit::Kind::pair:
      return PairSamples{header.width,   header.height,   {header.pairs[index_of(unit.pairs)][unit.index]},
                         floats(texels), vectors(texels), vectors(texels),
                         floats(texels)};
    case BakeUnit::Kind::yarns:
      break;
  }
  const std::size_t light = std::size_t{light_values_per_station} * header.yarns.stations;
  return YarnSamples{floats(curve_value_count(header.yarns)), floats(light),
                     floats(header.both_sides ? light : 0)};
}

Planes planes_of(UnitSamples& samples) {
  return std::visit([](auto& s) { return arrays_of(s); }, samples);
}

Result<void> write_unit(SamplesWriter& writer, const SamplesHeader& header, const BakeUnit& unit,
                        const UnitSamples& samples) {
  if (const auto* view = std::get_if<ViewSamples>(&samples)) {
    if (auto ok = check_samples(*view); !ok) return ok;
    return writer.write_view(*view);
  }
  if (const auto* pair = std::get_if<PairSamples>(&samples)) {
    if (auto ok = check_samples(*pair); !ok) return ok;
    return writer.write_pairs(unit.pairs, *pair);
  }
  const auto& [curves, indirect, through] = std::get<YarnSamples>(samples);
  auto data = yarns_from_values(curves, indirect, header.yarns, header.period_mm);
  if (!data) return tl::unexpected(data.error());
  if (header.both_sides) data->through = light_from_values(through, header.yarns.stations);
  if (auto ok = validate(*data, header.period_mm); !ok) return ok;
  if (counts_of(*data) != header.yarns)
    return fail(Code::samples_malformed, {}, names::part_yarns, "are not those that the header counts");
  return writer.write_yarns(*data);
}

UnitBaker::UnitBaker(const TracedCell& cell, const YarnData& yarns, std::optional<IrradianceCache> cache,
                     const BakeOptions& options, const SamplesHeader& header, double plane_mm)
    : cell_(cell),
      yarns_(yarns),
      options_(options),
      header_(header),
      views_(directions_of(header.views, header.both_sides)),
      lights_(directions_of(header.lights, header.both_sides)),
      cache_(std::move(cache)),
      baker_(cell.scene, cache_ ? &*cache_ : nullptr, options.bounces, V2i(options.width, options.height),
             plane_mm / cell.mm) {}

UnitSamples UnitBaker::bake(const BakeUnit& unit, int samples, NoiseSum& noise) {
  if (unit.kind == BakeUnit::Kind::view) return bake_view(unit.index, samples, noise);
  irradiance_ = {};  // not needed after the views: frees its memory
  if (unit.kind == BakeUnit::Kind::pair) return bake_pair(unit.pairs, unit.index, samples, noise);
  YarnData yarns = yarns_;
  const YarnLightOptions light{options_.yarn_paths, options_.bounces, options_.seed, options_.both_sides};
  trace_yarn_light(cell_, light, cache_ ? &*cache_ : nullptr, yarns);
  return YarnSamples{curve_values(yarns), indirect_values(yarns), indirect_values(yarns, true)};
}

ViewSamples UnitBaker::bake_view(std::size_t index, int samples, NoiseSum& noise) {
  if (cache_ && irradiance_.empty()) irradiance_ = cache_->solve(cell_.scene, lights_, options_.bounces);
  ViewSamples result = baker_.bake_view(views_[index], {lights_, irradiance_}, samples,
                                        seed_of(options_.seed, stream_views, index), noise);
  if (views_[index].z < 0) {
    for (V3f& normal : result.normal) normal = mirrored(normal);
  }
  return result;
}

PairSamples UnitBaker::bake_pair(PairKind kind, std::size_t index, int samples, NoiseSum& noise) {
  const DirectionPair& pair = header_.pairs[index_of(kind)][index];
  LitBy lit{{&pair.light, 1}, {}, false};
  if (cache_) {
    solve_for_pairs(kind, index);
    lit.indirect = pair_irradiance_;
    lit.solved = pair_irradiance_.size() / (3 * static_cast<std::size_t>(cache_->points()));
    lit.first = index - solved_first_;
  }
  return baker_.bake_pair(pair, lit, samples, seed_of(options_.seed, stream_of(kind), index), noise);
}

void UnitBaker::solve_for_pairs(PairKind kind, std::size_t index) {
  constexpr std::size_t at_once = 64;
  const auto& pairs = header_.pairs[index_of(kind)];
  const std::size_t first = index / at_once * at_once;
  if (!pair_irradiance_.empty() && solved_kind_ == kind && solved_first_ == first) return;
  std::vector<V3f> lights;
  for (std::size_t p = first; p < std::min(first + at_once, pairs.size()); ++p)
    lights.push_back(pairs[p].light);
  pair_irradiance_ = cache_->solve(cell_.scene, lights, options_.bounces);
  solved_kind_ = kind;
  solved_first_ = first;
}

}  // namespace selvedge
