#include "format/scene/level_bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/scene/footprint.h"

namespace selvedge {
namespace {

/// Margin of the bounds for rounding errors, in levels.
constexpr double rounding = 1e-3;

}  // namespace

LevelRange levels_asked(const PixelCover& cover, const LevelOptions& options, int levels) {
  const auto level = [&](double texels) {
    return std::log2(std::clamp(texels, 1e-30, 1e30)) + static_cast<double>(options.bias);
  };
  // The two levels of which the blend at a fractional level consists, or the one.
  const auto blended = [&](double fraction) {
    const double lower = std::floor(fraction);
    return lower + static_cast<double>(blend_of_levels(static_cast<float>(fraction - lower), options.blend));
  };
  const double last = levels - 1;
  const double first = std::clamp(std::floor(blended(level(cover.min_size) - rounding)), 0.0, last);
  const double coarsest = std::clamp(std::ceil(blended(level(cover.max_size) + rounding)), first, last);
  return {static_cast<int>(first), static_cast<int>(cover.max_size > 0 ? coarsest : last)};
}

LevelRange levels_for(const TexelDemand& demand, const V2d& texel_mm, int levels) {
  // In addition to the margin of levels_asked(), because repeats are stored rounded, too.
  constexpr double margin = 1 + 1e-3;
  PixelCover cover;
  // Bounds for any direction of a footprint's axes.
  cover.min_size = demand.min_mm / std::max(texel_mm.x, texel_mm.y) / margin;
  cover.max_size = demand.max_mm / std::min(texel_mm.x, texel_mm.y) * margin;
  LevelOptions options;
  options.bias = static_cast<float>(demand.bias);
  return levels_asked(cover, options, levels);
}

LackingLevels& LackingLevels::operator|=(const LackingLevels& other) {
  finer = std::max(finer, other.finer);
  coarser = std::max(coarser, other.coarser);
  return *this;
}

LackingLevels lacking_levels(const FabricHeader& header, const LevelRange& asked) {
  const int first = header.first_level();
  return {std::max(first - asked.first, 0), std::max(asked.last - (first + header.levels - 1), 0)};
}

Error lacking_issue(const std::string& name, const FabricHeader& header, const LackingLevels& lacking) {
  const int first = header.first_level();
  const int last = first + header.levels - 1;
  return {Code::fabric_levels, name, "/whole",
          fmt::format("the file has {} of the whole, and {} may be asked for: the nearest there are take "
                      "their place",
                      levels_text(first, last), levels_text(first - lacking.finer, last + lacking.coarser))};
}

std::optional<Error> lacking_issue(const std::string& name, const FabricHeader& header, int wanted) {
  const int first = header.first_level();
  const int last = first + header.levels - 1;
  // A fabric without `whole` lacks no levels.
  const int all = header.whole ? std::max(header.whole->levels, last + 1) : last + 1;
  const int level = std::min(wanted, all - 1);
  if (level >= first && level <= last) return std::nullopt;
  return Error{
      Code::fabric_levels, name, "/whole",
      fmt::format("the file has {} of the whole, and level {} is asked for: the nearest there is takes "
                  "its place",
                  levels_text(first, last), level)};
}

std::vector<LevelRange> levels_asked(const Scene& scene, const Camera& camera, int height,
                                     const LevelOptions& options,
                                     std::span<const FabricHeader* const> headers,
                                     std::vector<LackingLevels>* lacking) {
  std::vector<V2d> units;
  for (const SceneMaterial& material : scene.materials) {
    units.push_back(material.fabric ? V2d(whole_texels(*headers[material.fabric->fabric])) : V2d(1, 1));
  }
  const std::vector<PixelCover> covers = pixel_covers(scene, camera, height, units);
  std::vector<PixelCover> fabric_covers(headers.size());
  for (std::size_t i = 0; i < covers.size(); ++i) {
    if (scene.materials[i].fabric) fabric_covers[scene.materials[i].fabric->fabric] |= covers[i];
  }
  std::vector<LevelRange> ranges;
  if (lacking != nullptr) lacking->assign(headers.size(), {});
  for (std::size_t i = 0; i < headers.size(); ++i) {
    const int before = headers[i]->first_level();
    const int last = headers[i]->levels - 1;
    const LevelRange asked = levels_asked(fabric_covers[i], options, whole_levels(*headers[i]));
    const bool seen = fabric_covers[i].fronts || fabric_covers[i].backs;
    if (lacking != nullptr && seen) (*lacking)[i] = lacking_levels(*headers[i], asked);
    ranges.push_back({std::clamp(asked.first - before, 0, last), std::clamp(asked.last - before, 0, last)});
  }
  return ranges;
}

}  // namespace selvedge
