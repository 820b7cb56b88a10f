#include "apps/selvedge-view/show_report.h"

namespace selvedge {
namespace {

Json json_of(const V3f& v) { return {v.x, v.y, v.z}; }

}  // namespace

Json json_of(const Light& light) {
  Json all = {{"irradiance", json_of(light.irradiance)}};
  if (light.kind != LightKind::point) all["direction"] = json_of(V3f(light.direction));
  if (light.kind != LightKind::directional) all["position"] = json_of(V3f(light.position));
  return all;
}

Json json_of(const PixelProbe& probe, const std::vector<std::string>& fabrics) {
  Json texels = Json::array();
  for (const ProbedTexel& t : probe.texels)
    texels.push_back({{"level", t.level}, {"texel", {t.texel.x, t.texel.y}}, {"weight", t.weight}});
  Json lights = Json::array();
  for (const V3f& light : probe.lights) lights.push_back(json_of(light));
  Json fabric;
  if (probe.fabric >= 0) fabric = fabrics[probe.fabric];
  return {{"pixel", {probe.pixel.x, probe.pixel.y}},
          {"back", probe.back},
          {"fabric", fabric},
          {"uv", {probe.uv.x, probe.uv.y}},
          {"texels", texels},
          {"view", json_of(probe.view)},
          {"lights", lights},
          {"radiance", json_of(probe.radiance)},
          {"alpha", probe.alpha}};
}

}  // namespace selvedge
