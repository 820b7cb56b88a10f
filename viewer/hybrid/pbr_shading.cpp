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
  LaneDirections normal;  ///< in the frames' axes
  LaneColours emission;
  alignas(64) LaneFloats scale{};     ///< of f0: reflected_share()
  alignas(64) LaneFloats bias{};      ///< the same
  alignas(64) LaneFloats of_lamps{};  ///< share of the light of an environment's lamps, by pi
  LaneColours mean{};                 ///< of light from all around but these lamps, as pbr_around() takes it
  LaneColours mirrored{};             ///< the same
};

template <std::size_t N>
SELVEDGE_INLINE PbrVector<WideFloat<N>> load(const LaneDirections& d, std::size_t first) {
  using Wide = WideFloat<N>;
  return {Wide::load(&d.x[first]), Wide::load(&d.y[first]), Wide::load(&d.z[first])};
}

template <std::size_t N>
SELVEDGE_INLINE PbrColour<WideFloat<N>> load(const LaneColours& c, std::size_t first) {
  using Wide = WideFloat<N>;
  return {Wide::load(&c[0][first]), Wide::load(&c[1][first]), Wide::load(&c[2][first])};
}

template <class T>
SELVEDGE_INLINE void add(PbrColour<T>& sum, const PbrColour<T>& c) {
  sum.red += c.red;
  sum.green += c.green;
  sum.blue += c.blue;
}
template <class T>
SELVEDGE_INLINE PbrColour<T> lit(const PbrColour<T>& c, const V3f& irradiance, const T& share) {
  return {c.red * (share * T(irradiance.x)), c.green * (share * T(irradiance.y)),
          c.blue * (share * T(irradiance.z))};
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
    PbrColour<Wide> sum = load<N>(pbr.emission, first);
    PbrColour<Wide> mean = load<N>(pbr.mean, first);
    for (const LaneLight& light : lights) {
      const PbrVector<Wide> direction = load<N>(light.direction, first);
      const Wide share = Wide::load(&light.share[first]);
      if (light.of_environment) {
        const Wide arrives = larger(pbr_dot(normal, direction), Wide(0)) * Wide::load(&pbr.of_lamps[first]);
        add(mean, lit({arrives, arrives, arrives}, light.irradiance, share));
      } else {
        add(sum, lit(pbr_brdf(material, normal, view, direction), light.irradiance, share));
      }
    }
    add(sum, pbr_around(material, Wide::load(&pbr.scale[first]), Wide::load(&pbr.bias[first]), mean,
                        load<N>(pbr.mirrored, first)));
    sum.red.store(&result.red[first]);
    sum.green.store(&result.green[first]);
    sum.blue.store(&result.blue[first]);
  }
}
SELVEDGE_THREE_BODIES(add_light,
                      (const PbrLanes& pbr, const LaneDirections& views, std::span<const LaneLight> lights,
                       LaneShading& result),
                      (pbr, views, lights, result))

/// Occlusion of a mirror image (Lagarde and de Rousiers 2014).
float mirrored_occlusion(float nv, float occlusion, float roughness) {
  return std::clamp(std::pow(nv + occlusion, std::exp2(-16 * roughness - 1)) - 1 + occlusion, 0.0F, 1.0F);
}
/// Where a lobe gathers light: the mirrored view, of rough surfaces nearer to the normal.
V3f mirrored_view(const V3f& normal, const V3f& view, float roughness) {
  const V3f mirrored = normal * (2 * normal.dot(view)) - view;
  const float alpha = roughness * roughness;
  return (mirrored + (normal - mirrored) * (alpha * alpha)).normalized();
}
float visible_share(const V3f& seen, const V3f& all) {
  const float sum = all.x + all.y + all.z;
  return sum > 0 ? std::clamp((seen.x + seen.y + seen.z) / sum, 0.0F, 1.0F) : 1.0F;
}

float signed_share(std::uint32_t bits) {
  return std::max(static_cast<float>(static_cast<std::int16_t>(bits & 0xffffU)) / 32767.0F, -1.0F);
}
float share(std::uint32_t bits) { return static_cast<float>(bits & 0xffffU) / 65535.0F; }
float half_number(std::uint32_t bits) {
  Imath::half number;
  number.setBits(static_cast<std::uint16_t>(bits & 0xffffU));
  return number;
}

/// Smooth light of these factors that white facing along `n` reflects.
template <class Factor>
V3f mean_radiance(const Factor& factor, const V3f& n) {
  // The integrals of cosine and functions by their degree (Ramamoorthi and Hanrahan 2001), by pi.
  const auto basis = smooth_basis(n.x, n.y, n.z);
  V3f sum(0, 0, 0);
  for (std::size_t k = 0; k < smooth_functions; ++k)
    sum += factor(k) * ((k == 0 ? 1.0F : k < 4 ? 2.0F / 3 : 0.25F) * basis[k]);
  return {std::max(sum.x, 0.0F), std::max(sum.y, 0.0F), std::max(sum.z, 0.0F)};
}

/// A direction of a frame's axes in the world's.
V3f in_world(const LaneFrames& frames, std::size_t lane, const V3f& d) {
  const auto along = [&](const LaneFloats& x, const LaneFloats& y, const LaneFloats& z) {
    return x[lane] * d.x + y[lane] * d.y + z[lane] * d.z;
  };
  return {along(frames.tangent.x, frames.up.x, frames.normal.x),
          along(frames.tangent.y, frames.up.y, frames.normal.y),
          along(frames.tangent.z, frames.up.z, frames.normal.z)};
}

/// mean_radiance() of what reaches a pixel.
V3f seen_around(const ShadedBlock& block, std::size_t lane, const V3f& d) {
  return mean_radiance(
      [&](std::size_t k) {
        const LaneColours& c = block.around.factors[k];
        return V3f(c[0][lane], c[1][lane], c[2][lane]);
      },
      d);
}

/// Sets what comes from around. An environment is its mean and its mirror image; its lamps, which the mirror
/// image has, add to the mean alone. An occlusion texture and what the vertices do not see tell of the same
/// mesh: the darker one counts, towards the normal for the mean, towards the mirrored view for the mirror
/// image. Lamps whose shadows are drawn have no other.
void set_around(PbrLanes& lanes, std::size_t lane, const ShadingScene& scene, const ShadedBlock& shaded,
                const V3f& normal, const PbrValues& values) {
  const LaneFrames& frames = shaded.frames;
  const V3f view(frames.view.x[lane], frames.view.y[lane], frames.view.z[lane]);
  const float nv = std::abs(normal.dot(view));
  const V2f share = reflected_share(values.roughness, nv);
  lanes.scale[lane] = share.x;
  lanes.bias[lane] = share.y;
  const float occlusion = values.occlusion;
  lanes.of_lamps[lane] = (scene.shadows.empty() ? occlusion : 1.0F) * std::numbers::inv_pi_v<float>;
  const float of_mirrored = mirrored_occlusion(nv, occlusion, values.roughness);
  V3f mean(0, 0, 0);
  V3f mirrored(0, 0, 0);
  if (scene.around != nullptr) {
    const V3f towards = mirrored_view(normal, view, values.roughness);
    const float visible = share_around(scene, shaded, lane, normal);
    mean = seen_around(shaded, lane, normal) * std::min(1.0F, occlusion / std::max(visible, 1e-3F));
    mirrored = V3f(scene.ambient * std::numbers::inv_pi_v<float>);
    if (scene.reflections != nullptr)
      mirrored += scene.reflections->at(V3d(in_world(frames, lane, towards)).normalized(), values.roughness);
    mirrored *= std::min(share_around(scene, shaded, lane, towards), of_mirrored);
  }
  for (int c = 0; c < 3; ++c) {
    lanes.mean[static_cast<std::size_t>(c)][lane] = mean[c];
    lanes.mirrored[static_cast<std::size_t>(c)][lane] = mirrored[c];
  }
}

void set(PbrLanes& lanes, std::size_t lane, const ShadingScene& scene, const ShadedBlock& shaded) {
  const PbrPixel& pixel = shaded.places.pbr[lane];
  const PbrValues values = pbr_values(pixel);
  lanes.red[lane] = pixel.colour.x;
  lanes.green[lane] = pixel.colour.y;
  lanes.blue[lane] = pixel.colour.z;
  lanes.metallic[lane] = values.metallic;
  lanes.roughness[lane] = values.roughness;
  const float side = shaded.places.side[lane];
  const V3f normal(values.slope.x * side, values.slope.y * side,
                   std::sqrt(std::max(1 - values.slope.length2(), 0.0F)));
  const V3f unit = normal.normalized();
  lanes.normal.x[lane] = unit.x;
  lanes.normal.y[lane] = unit.y;
  lanes.normal.z[lane] = unit.z;
  for (int c = 0; c < 3; ++c) lanes.emission[static_cast<std::size_t>(c)][lane] = values.emission[c];
  set_around(lanes, lane, scene, shaded, unit, values);
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

float share_around(const ShadingScene& scene, const ShadedBlock& block, std::size_t lane, const V3f& normal) {
  if (scene.around_vertices.empty()) return 1;
  const V3f all = mean_radiance([&](std::size_t k) { return scene.around->factors[k]; },
                                in_world(block.frames, lane, normal));
  return visible_share(seen_around(block, lane, normal), all);
}

void shade_pbr(const ShadingScene& scene, const ShadedBlock& shaded, LaneShading& result) {
  static const auto add_light = add_light_for_this_processor();
  const PixelPlaces& block = shaded.places;
  PbrLanes lanes;
  for (std::size_t lane = 0; lane < block.count; ++lane) set(lanes, lane, scene, shaded);
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
