#include "converter/plan/scene_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/fabric/file.h"
#include "format/scene/scene_points.h"

namespace selvedge {
namespace {

Result<std::vector<Viewpoints>> viewpoints_of(const Scene& scene, const PlanOptions& options) {
  const auto points = world_points(scene);
  if (!points) return tl::unexpected(points.error());
  const double aspect = static_cast<double>(options.size.x) / options.size.y;
  std::vector<Viewpoints> viewpoints;
  for (const std::string& name : options.cameras) {
    const auto camera = camera_of(scene, name, *points, aspect, options.camera);
    if (!camera) return tl::unexpected(camera.error());
    viewpoints.emplace_back(*camera);
  }
  if (options.distances) {
    const auto orbit =
        make_orbit(*points, aspect, options.distances->x, options.distances->y, options.camera);
    if (!orbit) return tl::unexpected(orbit.error());
    viewpoints.emplace_back(*orbit);
  }
  if (viewpoints.empty()) {
    const auto camera = make_camera(*points, aspect, options.camera);
    if (!camera) return tl::unexpected(camera.error());
    viewpoints.emplace_back(*camera);
  }
  return viewpoints;
}

std::vector<PixelCover> covers_of(const Scene& scene, const std::vector<Viewpoints>& viewpoints,
                                  const PlanOptions& options, const std::vector<V2d>& units) {
  std::vector<PixelCover> covers(scene.materials.size());
  for (const Viewpoints& viewpoint : viewpoints) {
    const auto partial = pixel_covers(scene, viewpoint, options.size.y * options.supersample, units);
    for (std::size_t i = 0; i < covers.size(); ++i) covers[i] |= partial[i];
  }
  return covers;
}

/// Whether some texel of these levels may have holes.
Result<bool> has_openings(FabricReader& reader, const LevelRange& levels) {
  for (int k = levels.first; k <= levels.last; ++k) {
    const auto level = reader.read_level(k, {LayerKind::opacity});
    if (!level) return tl::unexpected(level.error());
    const std::span<const float> opacity = level->opacity();
    if (std::any_of(opacity.begin(), opacity.end(), [](float alpha) { return alpha < 1; })) return true;
  }
  return false;
}

Result<void> check(const PlanOptions& options) {
  constexpr int largest = 1 << 20;
  if (std::min(options.size.x, options.size.y) < 1 || std::max(options.size.x, options.size.y) > largest) {
    return fail(Code::option_out_of_range, "", "--size",
                fmt::format("must lie between 1x1 and {0}x{0}", largest));
  }
  if (options.supersample < 1 || options.supersample > 16)
    return fail(Code::option_out_of_range, "", "--supersample", "must lie between 1 and 16");
  return {};
}

}  // namespace

Result<ScenePlan> plan_scene(const std::string& path, const PlanOptions& options) {
  if (const auto good = check(options); !good) return tl::unexpected(good.error());
  const auto scene = read_scene(path, options.limits, options.choice);
  if (!scene) return tl::unexpected(scene.error());
  std::vector<FabricReader> readers;
  const FabricLimits limits{.memory = scene->memory_left};
  for (const SceneFabric& fabric : scene->fabrics) {
    auto reader = fabric.path.empty() ? FabricReader::open(fabric.bytes, fabric.name, limits)
                                      : FabricReader::open(fabric.path, limits);
    if (!reader) return tl::unexpected(reader.error());
    readers.push_back(std::move(*reader));
  }
  const auto viewpoints = viewpoints_of(*scene, options);
  if (!viewpoints) return tl::unexpected(viewpoints.error());

  std::vector<V2d> millimetres;
  std::vector<V2d> texels;
  std::vector<int> with_fabric;
  for (std::size_t i = 0; i < scene->materials.size(); ++i) {
    const auto& fabric = scene->materials[i].fabric;
    if (fabric) with_fabric.push_back(static_cast<int>(i));
    const FabricHeader none;
    const FabricHeader& header = fabric ? readers[fabric->fabric].header() : none;
    millimetres.emplace_back(header.period_mm);
    texels.emplace_back(whole_texels(header));
  }
  if (with_fabric.empty())
    return fail(Code::material_missing, path, "/materials", "none of the materials has a fabric");
  const std::vector<PixelCover> in_mm = covers_of(*scene, *viewpoints, options, millimetres);
  const std::vector<PixelCover> in_texels = covers_of(*scene, *viewpoints, options, texels);

  ScenePlan plan{path, options, {}};
  std::vector<int> seen;
  for (const int index : with_fabric) {
    const SceneMaterial& material = scene->materials[index];
    const int number = material.fabric->fabric;
    FabricReader& reader = readers[number];
    const FabricHeader& header = reader.header();
    MaterialPlan entry;
    entry.index = index;
    entry.name = material.name;
    entry.fabric = scene->fabrics[number].name;
    entry.mm_per_repeat = V2d(header.period_mm);
    entry.texels = whole_texels(header);
    entry.whole_levels = whole_levels(header);
    entry.levels = levels_asked(in_texels[index], options.levels, entry.whole_levels);
    entry.demand = {in_mm[index].min_size, in_mm[index].max_size, static_cast<double>(options.levels.bias)};
    entry.seen = in_texels[index].fronts || in_texels[index].backs;
    entry.fronts = in_texels[index].fronts;
    entry.backs = in_texels[index].backs;
    if (entry.seen) entry.lacking = lacking_levels(header, entry.levels);
    if (entry.seen) seen.push_back(index);
    if (entry.seen && material.alpha_mode != AlphaMode::opaque) {
      const auto in_file = [&](int level) {
        return std::clamp(level - header.first_level(), 0, header.levels - 1);
      };
      const auto open = has_openings(reader, {in_file(entry.levels.first), in_file(entry.levels.last)});
      if (!open) return tl::unexpected(open.error());
      entry.holes = *open;
    }
    plan.materials.push_back(std::move(entry));
  }
  // Materials without a fabric are not examined: all of them may be seen.
  for (std::size_t i = 0; i < scene->materials.size(); ++i) {
    if (!scene->materials[i].fabric) seen.push_back(static_cast<int>(i));
  }
  std::sort(seen.begin(), seen.end());
  for (MaterialPlan& entry : plan.materials) {
    if (entry.holes) entry.behind = seen;
  }
  return plan;
}

}  // namespace selvedge
