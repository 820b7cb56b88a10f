#include "converter/bake/setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/base/digest.h"
#include "format/base/random.h"
#include "format/exr/exr.h"
#include "format/fabric/fabric.h"
#include "format/fabric/json_io.h"

namespace selvedge {
namespace {

constexpr std::uint64_t stream_directions = 3;

template <class T>
void add(const std::vector<T>& values, Digest& digest) {
  digest.update(values.data(), values.size() * sizeof(T));
}

/// Adds pairs of the other sides, a third as many for each: every third one, mirrored.
void add_pairs_of_sides(SamplesHeader& header) {
  for (auto& pairs : header.pairs) {
    const std::size_t count = pairs.size();
    for (const Side side : other_sides) {
      for (std::size_t p = index_of(side) - 1; p < count; p += other_sides.size()) {
        DirectionPair pair = pairs[p];
        if (is_view_behind(side)) pair.view = mirrored(pair.view);
        if (is_view_behind(side) != is_transmission(side)) pair.light = mirrored(pair.light);
        pairs.push_back(pair);
      }
    }
  }
}

}  // namespace

const char* name_of(IndirectLight indirect) {
  constexpr std::array<const char*, 2> names{"lines", "paths"};
  return names[static_cast<std::size_t>(indirect)];
}

std::uint64_t seed_of(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return hash64(hash64(seed ^ hash64(stream)) ^ hash64(index));
}

Result<TracedCell> trace_cell(const CellMesh& mesh, const std::string& name) {
  if (auto ok = validate(mesh, name); !ok) return tl::unexpected(ok.error());
  const double mm = std::ldexp(1.0, std::ilogb(std::max(mesh.period.x, mesh.period.y)));
  CellMesh scaled = mesh;
  scaled.period /= mm;
  for (V3f& p : scaled.positions) p = V3f(V3d(p) / mm);
  for (V3f& p : scaled.hairs.points) p = V3f(V3d(p) / mm);
  for (float& r : scaled.hairs.radius) r = static_cast<float>(static_cast<double>(r) / mm);
  auto scene = RayScene::create(scaled, name);
  if (!scene) return tl::unexpected(scene.error());
  return TracedCell{std::move(*scene), mm};
}

Result<void> check_options(const BakeOptions& o, const std::string& name) {
  const auto refuse = [&](const char* option, std::string why) {
    return fail(Code::option_out_of_range, name, option, std::move(why));
  };
  const auto in_range = [&](const char* option, double value, double min, double max) -> Result<void> {
    if (value >= min && value <= max) return {};
    return refuse(option, fmt::format("{} is outside of {} to {}", value, min, max));
  };
  const FabricLimits limits;
  constexpr double max_samples = 1 << 20;
  for (const auto& ok :
       {in_range("texels", o.width, 1, limits.texels_per_side),
        in_range("texels", o.height, 1, limits.texels_per_side),
        in_range("views", o.views, 1, limits.directions), in_range("lights", o.lights, 1, limits.directions),
        in_range("samples", o.samples, 1, max_samples),
        in_range("bounces", o.bounces == unlimited_bounces ? 0 : o.bounces, 0, 64),
        in_range("validation-pairs", o.validation_pairs, 0, 65536),
        in_range("held-out-pairs", o.held_out_pairs, 0, 65536),
        in_range("truth-samples", o.truth_samples, 2, max_samples)})
    if (!ok) return ok;
  const double pixels = static_cast<double>(o.width) * o.height * o.views * o.lights * (o.both_sides ? 4 : 1);
  const auto limit = static_cast<double>(ExrLimits{}.pixels_per_part);
  if (pixels > limit)
    return refuse("texels", fmt::format("texels x views x lights are {:.3g}; at most {:.3g} are allowed",
                                        pixels, limit));
  return {};
}

std::string digest_of(const CellMesh& mesh) {
  Digest digest;
  digest.update(&mesh.period, sizeof mesh.period);
  add(mesh.positions, digest);
  add(mesh.normals, digest);
  add(mesh.albedo, digest);
  add(mesh.fibre_directions, digest);
  add(mesh.gloss, digest);
  add(mesh.triangles, digest);
  if (!mesh.yarn_places.empty()) {
    add(mesh.yarn_places, digest);
    add(curve_values(mesh.yarns), digest);
  }
  add(mesh.transmission, digest);
  add(mesh.hairs.points, digest);
  add(mesh.hairs.root_triangles, digest);
  add(mesh.hairs.radius, digest);
  add(mesh.hairs.transparency, digest);
  return digest.hex();
}

std::string digest_of(const YarnCell& cell) {
  Digest digest;
  digest.update(&cell.period, sizeof cell.period);
  add(curve_values(cell.yarns), digest);
  add(cell.wall_transmission, digest);
  return digest.hex();
}

SamplesHeader samples_header(const YarnCell& cell, const std::string& digest, const BakeOptions& o,
                             double plane_mm, const std::string& provenance) {
  SamplesHeader header;
  header.width = o.width;
  header.height = o.height;
  header.period_mm = V2f(cell.period);
  header.reference_height = static_cast<float>(plane_mm);
  header.thickness_mm = static_cast<float>(cell.thickness);
  header.views = nearly_square_grid(o.views);
  header.lights = nearly_square_grid(o.lights);
  header.samples_per_texel = o.samples;
  header.truth_samples = o.truth_samples / 2 * 2;
  const std::uint64_t seed = hash64(o.seed ^ hash64(stream_directions));
  if (o.pairs) {
    header.pairs = *o.pairs;
  } else {
    header.pairs[index_of(PairKind::validation)] =
        random_direction_pairs(o.validation_pairs, min_pair_z, seed);
    header.pairs[index_of(PairKind::held_out)] =
        random_direction_pairs(o.held_out_pairs, min_pair_z, seed + 1);
    if (o.both_sides) add_pairs_of_sides(header);
  }
  header.both_sides = o.both_sides;
  if (o.stores_yarns) header.yarns = counts_of(cell.yarns);
  nlohmann::json text = provenance_json(provenance);
  nlohmann::json& bake = text["bake"];
  bake = {{"samples", o.samples}, {"seed", o.seed}, {"indirect", name_of(o.indirect)}, {"digest", digest}};
  bake["bounces"] = o.bounces == unlimited_bounces ? nlohmann::json("unlimited") : nlohmann::json(o.bounces);
  header.provenance = text.dump();
  return header;
}

}  // namespace selvedge
