#include "viewer/scene/packed_fabric.h"

#include <algorithm>
#include <numbers>

#include "format/fabric/smooth_light.h"
#include "format/fabric/yarn_sky.h"

namespace selvedge {
namespace {

PackedLayout layout_of(const FabricLevel& level) {
  PackedLayout layout;
  layout.is_flat = !level.has(LayerKind::lobes) && !level.has(LayerKind::frame);
  layout.lobes = level.lobe_count();
  layout.has_views = level.has(LayerKind::table) || level.has(LayerKind::opacity);
  layout.has_lights = level.has(LayerKind::light);
  layout.has_table =
      level.has(LayerKind::table) || level.has(LayerKind::light) || !level.has(LayerKind::products);
  if (level.has(LayerKind::products)) {
    layout.pairs = level.pairs;
    layout.products = static_cast<int>(layout.pairs.size());
  }
  return layout;
}

void pack_texels(const FabricLevel& level, const PackedLayout& layout, std::vector<Group>& groups) {
  for (int i = 0; i < level.texels(); ++i) {
    const V3f n = level.has(LayerKind::frame) ? level.frame()[i].normal : V3f(0, 0, 1);
    const V3f t = level.has(LayerKind::frame) ? level.frame()[i].tangent : V3f(1, 0, 0);
    const std::size_t per_channel = parameter_count(layout.lobes);
    const float* p = level.has(LayerKind::lobes) ? &level.lobes()[i * 3 * per_channel] : nullptr;
    const auto rho = [&](std::size_t channel) { return p != nullptr ? p[channel * per_channel] : 1.0F; };
    groups.push_back({n.x, n.y, n.z, rho(0)});
    groups.push_back({t.x, t.y, t.z, rho(1)});
    groups.push_back({rho(2), 0, 0, 0});
    for (std::size_t channel = 0; channel < 3; ++channel) {
      for (int j = 0; j < layout.lobes; ++j) {
        const float* lobe = p + channel * per_channel + 1 + 4 * j;
        groups.push_back({lobe[0], lobe[1], lobe[2], lobe[3]});
      }
    }
  }
}

void pack_views(const FabricLevel& level, std::size_t count, std::vector<Group>& groups) {
  for (std::size_t i = 0; i < count; ++i) {
    const float alpha = level.has(LayerKind::opacity) ? level.opacity()[i] : 1.0F;
    const V3f colour = level.has(LayerKind::table) ? level.view_table()[i] : V3f(1, 1, 1);
    groups.push_back({alpha * colour.x, alpha * colour.y, alpha * colour.z, alpha});
  }
}

void pack_coefficients(const FabricLevel& level, const PackedLayout& layout, std::vector<Group>& groups) {
  const std::size_t count = level.pairs.size();
  const std::span<const float> coefficients = level.coefficients();
  for (std::size_t first = 0; first < coefficients.size(); first += count) {
    groups.resize(groups.size() + layout.coefficient_groups());
    Group* const texel = &groups[groups.size() - layout.coefficient_groups()];
    for (std::size_t m = 0; m < count; ++m) texel[m / 4][m % 4] = coefficients[first + m];
  }
}

/// Integrals over the hemisphere of psi_b, the cosine and the functions of smooth light.
void pack_around(const Fabric& fabric, const ProductBases& bases, std::vector<float>& factors) {
  constexpr DirectionGrid grid{32, 32};
  const std::size_t lights = fabric.lights.count();
  const std::size_t functions = bases.light.size() / lights;
  factors.assign(functions * smooth_functions * 3, 0.0F);
  for (const V3f& d : directions_of(grid)) {
    const DirectionTaps taps = interpolate(fabric.lights, d);
    const auto basis = smooth_basis(d.x, d.y, d.z);
    const float part = d.z * 2 * std::numbers::pi_v<float> / static_cast<float>(grid.count());
    for (std::size_t b = 0; b < functions; ++b) {
      V3f psi(0, 0, 0);
      for (std::size_t tap = 0; tap < 4; ++tap)
        psi += bases.light[b * lights + taps.cell[tap]] * taps.weight[tap];
      for (std::size_t k = 0; k < smooth_functions; ++k) {
        for (int c = 0; c < 3; ++c) factors[(b * smooth_functions + k) * 3 + c] += psi[c] * basis[k] * part;
      }
    }
  }
}

void pack_bases(const Fabric& fabric, const ProductBases& bases, PackedFabric& packed) {
  const std::size_t views = fabric.views.count();
  const std::size_t lights = fabric.lights.count();
  const std::size_t view_functions = bases.view.size() / views;
  const std::size_t light_functions = bases.light.size() / lights;
  packed.view_stride = static_cast<int>((view_functions + 15) / 16 * 16);
  packed.light_stride = static_cast<int>((light_functions + 3) / 4 * 4);
  packed.view_basis.resize(views * packed.view_stride);
  packed.light_basis.resize(lights * packed.light_stride);
  for (std::size_t view = 0; view < views; ++view) {
    for (std::size_t a = 0; a < view_functions; ++a)
      packed.view_basis[view * packed.view_stride + a] = bases.view[a * views + view];
  }
  for (std::size_t light = 0; light < lights; ++light) {
    for (std::size_t b = 0; b < light_functions; ++b) {
      const V3f& psi = bases.light[b * lights + light];
      packed.light_basis[light * packed.light_stride + b] = {psi.x, psi.y, psi.z, 0};
    }
  }
  pack_around(fabric, bases, packed.around_basis);
  packed.view_functions = static_cast<int>(view_functions);
  packed.light_functions = static_cast<int>(light_functions);
}

}  // namespace

std::uint64_t packed_memory(const FabricHeader& header) {
  std::uint64_t groups = 0;
  const bool turns = header.side_of(Side::back) != nullptr;
  for_each_side(header, [&](const FabricHeader& side) {
    // Turned over, the fabric is a copy of its own, of front or back and of all light that comes through.
    const std::uint64_t copies = turns && side.side != Side::front ? 3 : 1;
    for (int k = 0; k < header.levels; ++k) {
      const auto has = [&](LayerKind kind) { return side.has(kind, side.level_of_texels(k)); };
      int of_texel = 3;
      if (has(LayerKind::lobes)) of_texel += 3 * side.shape.lobes;
      if (has(LayerKind::table) || has(LayerKind::opacity) || lets_through(side.side))
        of_texel += side.views.count();
      if (has(LayerKind::light)) of_texel += side.lights.count();
      if (has(LayerKind::products)) of_texel += (side.shape.products + 3) / 4;
      groups += copies * of_texel * level_size(header.width, k) * level_size(header.height, k);
    }
  });
  return groups * sizeof(Group);
}

PackedFabric pack(const Fabric& fabric) {
  PackedFabric packed;
  packed.fabric = &fabric;
  if (fabric.levels.front().yarns())
    packed.largest_cell_pixel =
        std::sqrt(static_cast<float>(fabric.texels().x) * static_cast<float>(fabric.texels().y)) /
        least_cell_pixels;
  for (const FabricLevel& level : fabric.levels) {
    const PackedLayout layout = layout_of(level);
    const auto found = std::find(packed.layouts.begin(), packed.layouts.end(), layout);
    PackedLevel target;
    target.width = level.width;
    target.height = level.height;
    target.layout = static_cast<int>(found - packed.layouts.begin());
    if (found == packed.layouts.end()) packed.layouts.push_back(layout);
    const std::size_t texels = level.texels();
    // Exactly: packed_memory() leaves no room to grow.
    target.texels.reserve(texels * layout.texel_groups());
    target.coefficients.reserve(texels * layout.coefficient_groups());
    target.lights.reserve(level.light_table().size());
    if (layout.has_views) target.views.reserve(texels * fabric.views.count());
    pack_texels(level, layout, target.texels);
    if (layout.has_views && layout.is_linear()) {
      const auto opacity = level.opacity();
      target.opacity.assign(opacity.begin(), opacity.end());
    } else if (layout.has_views) {
      pack_views(level, texels * fabric.views.count(), target.views);
    }
    for (const V3f& s : level.light_table()) target.lights.push_back({s.x, s.y, s.z, 0});
    if (level.has(LayerKind::products)) {
      pack_coefficients(level, layout, target.coefficients);
      if (packed.light_functions == 0) pack_bases(fabric, *level.bases, packed);
    }
    packed.needs_views |= layout.has_views || packed.view_functions > 0;
    packed.needs_lights |= layout.has_lights || layout.products > 0;
    packed.levels.push_back(std::move(target));
  }
  if (!fabric.levels.empty() && fabric.levels.front().yarns() != nullptr)
    packed.yarn_sky = sky_of(*fabric.levels.front().yarns());
  if (const Fabric* const through = fabric.side_of(Side::through))
    packed.through = std::make_shared<const PackedFabric>(pack(*through));
  if (fabric.side_of(Side::back) != nullptr) {
    const auto source = std::make_shared<const Fabric>(turned_over(fabric));
    PackedFabric turned = pack(*source);
    turned.own = source;
    packed.turned = std::make_shared<const PackedFabric>(std::move(turned));
  }
  return packed;
}

}  // namespace selvedge
