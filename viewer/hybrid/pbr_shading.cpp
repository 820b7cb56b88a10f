#include "viewer/hybrid/pbr_shading.h"

#include <Imath/half.h>

#include <algorithm>
#include <numbers>

#include "viewer/light/pbr_brdf.h"

namespace selvedge {
namespace {

/// The pixels' materials, one lane each.
struct PbrLanes {
  alignas(64) LaneFloats red{};
  alignas(64) LaneFloats green{};
  alignas(64) LaneFloats blue{};
  alignas(64) LaneFloats metallic{};
  alignas(64) LaneFloats roughness{};
  LaneDirections normal;       ///< in the frames' axes
  LaneDirections from_around;  ///< mean radiance of light from all around; red, green, blue
  LaneDirections emission;     ///< the same
};

template <std::size_t N>
SELVEDGE_INLINE PbrVector<WideFloat<N>> load(const LaneDirections& d, std::size_t first) {
  using Wide = WideFloat<N>;
  return {Wide::load(&d.x[first]), Wide::load(&d.y[first]), Wide::load(&d.z[first])};
}

template <std::size_t N>
SELVEDGE_INLINE void add_light(const PbrLanes& pbr, const LaneDirections& views,
                               std::span<const LaneLight> lights, LaneShading& result) {
  using Wide = WideFloat<N>;
  for (std::size_t first = 0; first < lane_count; first += N) {
    const PbrPoint<Wide> material{Wide::load(&pbr.red[first]), Wide::load(&pbr.green[first]),
                                  Wide::load(&pbr.blue[first]), Wide::load(&pbr.metallic[first]),
                                  Wide::load(&pbr.roughness[first])};
    const PbrVector<Wide> normal = load<N>(pbr.normal, first);
    const PbrVector<Wide> view = load<N>(views, first);
    const PbrColour<Wide> ambient = pbr_ambient(material, normal, view);
    const PbrVector<Wide> around = load<N>(pbr.from_around, first);
    const PbrVector<Wide> emission = load<N>(pbr.emission, first);
    Wide red = emission.x + ambient.red * around.x;
    Wide green = emission.y + ambient.green * around.y;
    Wide blue = emission.z + ambient.blue * around.z;
    for (const LaneLight& light : lights) {
      const PbrColour<Wide> seen = pbr_brdf(material, normal, view, load<N>(light.direction, first));
      const Wide share = Wide::load(&light.share[first]);
      red += seen.red * (share * Wide(light.irradiance.x));
      green += seen.green * (share * Wide(light.irradiance.y));
      blue += seen.blue * (share * Wide(light.irradiance.z));
    }
    red.store(&result.red[first]);
    green.store(&result.green[first]);
    blue.store(&result.blue[first]);
  }
}
SELVEDGE_THREE_BODIES(add_light,
                      (const PbrLanes& pbr, const LaneDirections& views, std::span<const LaneLight> lights,
                       LaneShading& result),
                      (pbr, views, lights, result))

float signed_share(std::uint32_t bits) {
  return std::max(static_cast<float>(static_cast<std::int16_t>(bits & 0xffffU)) / 32767.0F, -1.0F);
}
float share(std::uint32_t bits) { return static_cast<float>(bits & 0xffffU) / 65535.0F; }
float half_number(std::uint32_t bits) {
  Imath::half number;
  number.setBits(static_cast<std::uint16_t>(bits & 0xffffU));
  return number;
}

/// What white reflects that faces along `n`, of smooth light.
V3f mean_radiance(const LaneSmoothLight& light, std::size_t lane, const V3f& n) {
  // The integrals of cosine and functions by their degree (Ramamoorthi and Hanrahan 2001), by pi.
  const auto basis = smooth_basis(n.x, n.y, n.z);
  V3f sum(0, 0, 0);
  for (std::size_t k = 0; k < smooth_functions; ++k) {
    const float share = k == 0 ? 1.0F : k < 4 ? 2.0F / 3 : 0.25F;
    for (std::size_t c = 0; c < 3; ++c)
      sum[static_cast<int>(c)] += share * basis[k] * light.factors[k][c][lane];
  }
  return {std::max(sum.x, 0.0F), std::max(sum.y, 0.0F), std::max(sum.z, 0.0F)};
}

void set(PbrLanes& lanes, std::size_t lane, const PbrPixel& pixel, float side, float ambient,
         const LaneSmoothLight* around) {
  const PbrValues values = pbr_values(pixel);
  lanes.red[lane] = pixel.colour.x;
  lanes.green[lane] = pixel.colour.y;
  lanes.blue[lane] = pixel.colour.z;
  lanes.metallic[lane] = values.metallic;
  lanes.roughness[lane] = values.roughness;
  const V3f normal(values.slope.x * side, values.slope.y * side,
                   std::sqrt(std::max(1 - values.slope.length2(), 0.0F)));
  const V3f unit = normal.normalized();
  lanes.normal.x[lane] = unit.x;
  lanes.normal.y[lane] = unit.y;
  lanes.normal.z[lane] = unit.z;
  V3f from_around(ambient * std::numbers::inv_pi_v<float>);
  if (around != nullptr) from_around += mean_radiance(*around, lane, unit);
  from_around *= values.occlusion;
  lanes.from_around.x[lane] = from_around.x;
  lanes.from_around.y[lane] = from_around.y;
  lanes.from_around.z[lane] = from_around.z;
  lanes.emission.x[lane] = values.emission.x;
  lanes.emission.y[lane] = values.emission.y;
  lanes.emission.z[lane] = values.emission.z;
}

}  // namespace

PbrValues pbr_values(const PbrPixel& pixel) {
  const auto& words = pixel.words;
  PbrValues values;
  values.slope = V2f(signed_share(words[0]), signed_share(words[0] >> 16U));
  values.metallic = share(words[1]);
  values.roughness = share(words[1] >> 16U);
  values.emission = V3f(half_number(words[2]), half_number(words[2] >> 16U), half_number(words[3]));
  values.occlusion = half_number(words[3] >> 16U);
  return values;
}

void shade_pbr(const ShadingScene& scene, const ShadedBlock& shaded, LaneShading& result) {
  static const auto add_light = add_light_for_this_processor();
  const PixelPlaces& block = shaded.places;
  PbrLanes lanes;
  for (std::size_t lane = 0; lane < block.count; ++lane)
    set(lanes, lane, block.pbr[lane], block.side[lane], scene.ambient,
        scene.around != nullptr ? &shaded.around : nullptr);
  add_light(lanes, shaded.frames.view, shaded.lights, result);
  for (std::size_t lane = 0; lane < block.count; ++lane) {
    if (!scene.pbr[block.surface[lane]].unlit) continue;
    const V4f& colour = block.pbr[lane].colour;
    result.red[lane] = colour.x * std::numbers::inv_pi_v<float>;
    result.green[lane] = colour.y * std::numbers::inv_pi_v<float>;
    result.blue[lane] = colour.z * std::numbers::inv_pi_v<float>;
  }
}

}  // namespace selvedge
