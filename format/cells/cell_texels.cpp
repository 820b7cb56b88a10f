#include "format/cells/cell_texels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "format/fabric/evaluate.h"
#include "format/fabric/footprint.h"

namespace selvedge {
namespace {

using Quad = float __attribute__((vector_size(16)));

Quad group_lanes(const V3f& c) { return Quad{c.x, c.y, c.z, 0}; }

/// Infinite radiance would spread, and NaN.
Quad tame(const Quad& radiance) {
  const Quad most = Quad{} + 1e30F;
  return radiance == radiance ? (radiance < most ? radiance : most) : Quad{};
}

/// Whether radiance is linear in what texels have.
bool is_linear(const FabricLevel& level) {
  return level.has(LayerKind::products) && !level.has(LayerKind::lobes) && !level.has(LayerKind::frame) &&
         !level.has(LayerKind::table) && !level.has(LayerKind::light);
}

/// A ring of directions of one height, and the solid angle of each.
struct Ring {
  float z;
  int count;
  float solid_angle;
};
/// Gauss-Legendre over the height: polynomials of z up to degree 5 have their integrals over the hemisphere.
constexpr float two_pi = 2 * std::numbers::pi_v<float>;
constexpr std::array rings{Ring{0.112701665F, 4, two_pi * 5 / 18 / 4}, Ring{0.5F, 5, two_pi * 8 / 18 / 5},
                           Ring{0.887298335F, 3, two_pi * 5 / 18 / 3}};

/// Adds the radiance of a linear level's texels times their opacity: for each lamp, and for light from all
/// around, products have one factor for all texels.
void add_linear(const FabricLevel& level, const Fabric& fabric, std::span<const float> of_around,
                const DirectionTaps& view, std::span<const CellLamp> lamps, const SmoothLight* around,
                std::span<const float> alpha, std::span<Quad> texels) {
  const std::size_t products = level.pairs.size();
  std::vector<float> by_view;
  for (const V2i& pair : level.pairs) by_view.push_back(phi(*level.bases, fabric, pair.x, view));
  std::vector<Quad> factors(products);
  const auto add = [&](const Quad& scale, int plane) {
    const float* c = level.coefficients().data();
    Quad* to = texels.data() + std::size_t{1} * plane * level.texels();
    for (std::size_t i = 0; i < alpha.size(); ++i) {
      Quad sum{};
      for (std::size_t m = 0; m < products; ++m) sum += factors[m] * *c++;
      const Quad radiance = tame(sum * scale);
      *to++ += (radiance > 0 ? radiance : Quad{}) * alpha[i];
    }
  };
  for (const CellLamp& lamp : lamps) {
    const DirectionTaps taps = interpolate(fabric.lights, lamp.direction);
    for (std::size_t m = 0; m < products; ++m)
      factors[m] = group_lanes(psi(*level.bases, fabric, level.pairs[m].y, taps)) * by_view[m];
    add(group_lanes(lamp.irradiance) * (lamp.direction.z * fabric.radiance_scale), lamp.plane);
  }
  if (around == nullptr) return;
  for (std::size_t m = 0; m < products; ++m) {
    V3f sum(0, 0, 0);
    const float* weights = &of_around[std::size_t{3} * smooth_function_count * level.pairs[m].y];
    for (const V3f& factor : around->coefficients) {
      sum += factor * V3f(weights[0], weights[1], weights[2]);
      weights += 3;
    }
    factors[m] = group_lanes(sum) * by_view[m];
  }
  add(Quad{} + fabric.radiance_scale, 0);
}

void add_texels(const FabricLevel& level, const Fabric& fabric, const TappedDirection& view,
                std::vector<CellLamp> lamps, const SmoothLight* around, std::span<Quad> texels) {
  // The dark side of what a scene hides from itself is below 0 here and there.
  if (around != nullptr) {
    const float least = is_transmission(fabric.side) ? 0 : std::numeric_limits<float>::lowest();
    const std::vector<CellLamp> smooth = lamps_of_smooth_light(*around, least);
    lamps.insert(lamps.end(), smooth.begin(), smooth.end());
  }
  std::vector<TappedDirection> directions;
  for (const CellLamp& lamp : lamps) directions.emplace_back(fabric.lights, lamp.direction);
  for (int i = 0; i < level.texels(); ++i) {
    const ViewFactors factors = view_factors(level, view.taps, i);
    if (!(factors.alpha > 0)) continue;
    for (std::size_t k = 0; k < lamps.size(); ++k) {
      const V3f radiance = radiance_of(level, fabric, i, factors, directions[k], view);
      texels[std::size_t{1} * lamps[k].plane * level.texels() + i] +=
          tame(group_lanes(radiance * lamps[k].irradiance)) * factors.alpha;
    }
  }
}

/// Response of a fabric's psi_b to smooth light, [b][function][colour]: integrals over the hemisphere, the
/// cosine included. Empty without products.
std::vector<float> smooth_response(const Fabric& fabric) {
  constexpr DirectionGrid grid{32, 32};
  const std::shared_ptr<const ProductBases> bases = shared_bases(fabric);
  if (!bases) return {};
  const std::size_t functions = bases->light.size() / fabric.lights.count();
  std::vector<float> response(functions * smooth_function_count * 3, 0.0F);
  for (const V3f& d : cell_directions(grid)) {
    const DirectionTaps taps = interpolate(fabric.lights, d);
    const auto basis = smooth_basis(d.x, d.y, d.z);
    const float part = d.z * two_pi / static_cast<float>(grid.count());
    for (std::size_t b = 0; b < functions; ++b) {
      const V3f of_b = psi(*bases, fabric, static_cast<int>(b), taps) * part;
      for (std::size_t k = 0; k < smooth_function_count; ++k)
        for (int c = 0; c < 3; ++c) response[(b * smooth_function_count + k) * 3 + c] += of_b[c] * basis[k];
    }
  }
  return response;
}

/// Levels of texels of a tile of a map, where fabrics store the first alone.
constexpr int levels_of_tile = level_count(map_tile_stitches, map_tile_stitches);

/// Texels of a level that an image shows; of a map, the texels of its window.
struct ImageTexels {
  V2i repeat;       ///< texels of the image's repeat
  V2i first{0, 0};  ///< of the repeat, rows upwards
  V2i count;
};
ImageTexels texels_of(const CellView& view, const FabricLevel& level, int number) {
  const CellSize& size = view.size;
  if (!size.shows_map) return {{level.width, level.height}, {0, 0}, {level.width, level.height}};
  ImageTexels texels{V2i(map_tile_stitches >> number), {0, 0}, {0, 0}};
  const V2i origin = size.unwrapped_origin();
  for (int axis = 0; axis < 2; ++axis) {
    const float per_sample =
        static_cast<float>(texels.repeat[axis]) / static_cast<float>(size.repeat_samples[axis]);
    const int end = origin[axis] + size.rendered_samples()[axis];
    texels.first[axis] = static_cast<int>(std::floor(static_cast<float>(origin[axis]) * per_sample));
    texels.count[axis] =
        static_cast<int>(std::ceil(static_cast<float>(end) * per_sample)) - texels.first[axis];
  }
  return texels;
}

/// The level of these texels of a map.
FabricLevel level_of_map(const Fabric& fabric, const YarnMap& map, const CellView& view, int number,
                         const ImageTexels& texels) {
  const V2i end = texels.first + texels.count;
  const V2i first_row(view.size.first_stitch.x + (texels.first.x << number),
                      -(view.size.first_stitch.y + (end.y << number)));
  return shown_texels(fabric.levels.front(), map, first_row, texels.count, number);
}

}  // namespace

std::vector<CellLamp> lamps_of_smooth_light(const SmoothLight& around, float least) {
  std::vector<CellLamp> lamps;
  for (const Ring& ring : rings) {
    const float planar = std::sqrt(1 - ring.z * ring.z);
    for (int i = 0; i < ring.count; ++i) {
      const float angle = two_pi * (static_cast<float>(i) + ring.z) / static_cast<float>(ring.count);
      CellLamp& lamp = lamps.emplace_back();
      lamp.direction = {planar * std::cos(angle), planar * std::sin(angle), ring.z};
      const auto basis = smooth_basis(lamp.direction.x, lamp.direction.y, ring.z);
      for (std::size_t k = 0; k < smooth_function_count; ++k)
        lamp.irradiance += around.coefficients[k] * basis[k];
      for (int c = 0; c < 3; ++c) lamp.irradiance[c] = std::max(lamp.irradiance[c], least) * ring.solid_angle;
    }
  }
  return lamps;
}

float max_yarn_pixel_texels(const Fabric& fabric) {
  const auto& yarns = fabric.levels.front().yarns();
  if (!yarns) return 0;
  const V2f texels(fabric.texels());
  const float nodes = static_cast<float>(yarns->data().nodes.size());
  return std::sqrt(texels.x * texels.y) / std::max(min_repeat_pixels, std::sqrt(nodes / max_nodes_per_pixel));
}

CellLevels shown_levels(const Fabric& fabric, const V2f& pixel, int forced) {
  const std::vector<FabricLevel>& levels = fabric.levels;
  const bool has_map = fabric.find_map() != nullptr;
  const int last = (has_map ? levels_of_tile : static_cast<int>(levels.size())) - 1;
  if (forced >= 0) return {0, std::min(forced, last), 0};
  const V2f texels = has_map ? V2f(map_tile_stitches) : V2f(fabric.texels());
  const V2f size = pixel * texels;
  const float width = pixel_width_texels({V2f(size.x, 0), V2f(0, size.y)});
  const float level = std::clamp(std::log2(width) + level_bias, 0.0F, static_cast<float>(last));
  CellLevels shown{yarn_weight(width, max_yarn_pixel_texels(fabric)), static_cast<int>(level), 0};
  // Larger images take too much memory.
  const auto is_large = [&](const FabricLevel& candidate) {
    return std::max(candidate.width, candidate.height) > max_cell_samples;
  };
  while (!has_map && shown.finer_level < last && is_large(levels[shown.finer_level])) ++shown.finer_level;
  if (shown.finer_level < last)
    shown.coarser_weight = coarser_level_weight(level - static_cast<float>(shown.finer_level));
  return shown;
}

CellSize texel_cell_size(const Fabric& fabric, const V2f& pixel, int level) {
  const bool has_map = fabric.find_map() != nullptr;
  const FabricLevel& stored = fabric.levels[has_map ? 0 : level];
  CellSize size{has_map ? V2i(map_tile_stitches >> level) : V2i(stored.width, stored.height), {1, 1}, 1};
  for (int axis = 0; axis < 2; ++axis) {
    const float texels = std::min(pixel[axis], 1.0F) * static_cast<float>(size.repeat_samples[axis]);
    size.pixel_samples[axis] = std::max(1, static_cast<int>(std::lround(texels)));
  }
  return size;
}

CellTexels::CellTexels(const Fabric& fabric) : front_{&fabric, smooth_response(fabric)} {
  if (const Fabric* const through = fabric.find_side(Side::through))
    through_ = {through, smooth_response(*through)};
}

void CellTexels::add_level(const CellView& view, int number, float weight, std::span<Group> samples) const {
  if (!(weight > 0)) return;
  const YarnMap* const map = view.size.shows_map ? front_.fabric->find_map() : nullptr;
  const auto& stored = front_.fabric->levels;
  const ImageTexels shown = texels_of(view, stored[map != nullptr ? 0 : number], number);
  std::array<FabricLevel, 2> of_map;
  const auto level_of = [&](const Fabric& fabric, FabricLevel& made) -> const FabricLevel& {
    return map != nullptr ? made = level_of_map(fabric, *map, view, number, shown) : fabric.levels[number];
  };
  const FabricLevel& level = level_of(*front_.fabric, of_map[0]);
  const std::size_t count = level.texels();
  std::vector<Quad> texels(count * view.plane_count);
  const TappedDirection seen(front_.fabric->views, view.view);
  std::vector<float> alpha(count);
  for (std::size_t i = 0; i < count; ++i)
    alpha[i] = view_factors(level, seen.taps, static_cast<int>(i)).alpha;
  for (const bool behind : {false, true}) {
    const Layer& layer = behind ? through_ : front_;
    if (layer.fabric == nullptr) continue;
    std::vector<CellLamp> lamps;
    for (const CellLamp& lamp : view.lamps) {
      const float z = behind ? -lamp.direction.z : lamp.direction.z;
      if (!(z > 0)) continue;
      lamps.push_back(lamp);
      lamps.back().direction.z = z;
    }
    std::optional<SmoothLight> around = view.environment;
    if (around && behind) around = mirrored(*around);
    const FabricLevel& own = behind ? level_of(*layer.fabric, of_map[1]) : level;
    const SmoothLight* const smooth = around ? &*around : nullptr;
    if (is_linear(own))
      add_linear(own, *layer.fabric, layer.response, seen.taps, lamps, smooth, alpha, texels);
    else
      add_texels(own, *layer.fabric, seen, std::move(lamps), smooth, texels);
  }
  // A sample shows the texel in which its middle lies. Rows of samples rise, texels' fall.
  const V2i size = view.size.rendered_samples();
  const V2i origin = map != nullptr ? view.size.unwrapped_origin() : view.size.window_origin;
  const auto texel_at = [&](int sample, int axis) {
    const int halves = 2 * view.size.repeat_samples[axis];
    const int twice = (2 * (origin[axis] + sample) + 1) * shown.repeat[axis] - shown.first[axis] * halves;
    return map != nullptr ? std::min(twice / halves, shown.count[axis] - 1)
                          : twice / halves % shown.count[axis];
  };
  Group* to = samples.data();
  for (int y = 0; y < size.y; ++y) {
    const std::size_t row = std::size_t{1} * (level.height - 1 - texel_at(y, 1)) * level.width;
    for (int x = 0; x < size.x; ++x) {
      const std::size_t i = row + texel_at(x, 0);
      (*to)[3] += weight * alpha[i];
      for (int plane = 0; plane < view.plane_count; ++plane, ++to) {
        const Quad& value = texels[plane * count + i];
        for (std::size_t c = 0; c < 3; ++c) (*to)[c] += weight * value[c];
      }
    }
  }
}

void CellTexels::add_to_samples(const CellView& view, std::span<Group> samples) const {
  const CellLevels& levels = view.levels;
  const float left = 1 - levels.yarn_weight;
  add_level(view, levels.finer_level, left * (1 - levels.coarser_weight), samples);
  add_level(view, levels.finer_level + 1, left * levels.coarser_weight, samples);
}

}  // namespace selvedge
