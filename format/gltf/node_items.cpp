#include "format/gltf/node_items.h"

#include <Imath/ImathMatrix.h>
#include <Imath/ImathQuat.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/gltf/access.h"
#include "format/gltf/materials.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

std::string name_of(const Json& json, const Json& node) {
  for (const Json* named : {&json, &node}) {
    if (std::string name = string_of(member(*named, "name")); !name.empty()) return name;
  }
  return "";
}

V3d row(const M44d& m, int i) { return {m[i][0], m[i][1], m[i][2]}; }

bool finite(const M44d& m) {
  return std::all_of(&m[0][0], &m[0][0] + 16, [](double x) { return std::isfinite(x); });
}

bool is_positive(double value) { return std::isfinite(value) && value > 0; }

}  // namespace

std::optional<SceneCamera> camera_of_node(const GltfDocument& document, const Json& node, const M44d& world,
                                          Scene& scene) {
  const int index = index_of(member(node, "camera"));
  if (index < 0) return std::nullopt;
  const auto json = entry_of(document, "cameras", index, "");
  SceneCamera camera;
  camera.world = world;
  bool good = json.has_value() && finite(world) && row(world, 2).length() > 0;
  if (good) {
    camera.name = name_of(**json, node);
    camera.perspective = member(**json, "type") != "orthographic";
    const Json& lens = member(**json, camera.perspective ? "perspective" : "orthographic");
    camera.znear = number_of(member(lens, "znear"), 0);
    if (const double far = number_of(member(lens, "zfar"), 0); far > camera.znear) camera.zfar = far;
    if (camera.perspective) {
      camera.yfov = number_of(member(lens, "yfov"), 0);
      if (const double aspect = number_of(member(lens, "aspectRatio"), 0); is_positive(aspect))
        camera.aspect = aspect;
      good = is_positive(camera.yfov) && camera.yfov < std::numbers::pi && camera.znear > 0;
    } else {
      camera.magnification = V2d(number_of(member(lens, "xmag"), 0), number_of(member(lens, "ymag"), 0));
      good = is_positive(camera.magnification.x) && is_positive(camera.magnification.y) && camera.zfar;
    }
  }
  if (good) return camera;
  remark(scene, fmt::format("/cameras/{}: nothing can be seen through it; left out", index));
  return std::nullopt;
}

std::optional<SceneLight> light_of_node(const GltfDocument& document, const Json& node, const M44d& world,
                                        Scene& scene) {
  using names::gltf::lights_punctual;
  const Json& number = member(member(member(node, "extensions"), lights_punctual), "light");
  if (number.is_null()) return std::nullopt;
  const int index = index_of(number);
  const Json& lights = array_of(member(member(document.json, "extensions"), lights_punctual), "lights");
  const std::string place = fmt::format("/extensions/{}/lights/{}", lights_punctual, index);
  const auto leave_out = [&](const char* why) -> std::optional<SceneLight> {
    remark(scene, fmt::format("{}: {}; left out", place, why));
    return std::nullopt;
  };
  if (static_cast<std::size_t>(index) >= lights.size()) return leave_out("there is no such light");
  const Json& json = lights[index];
  SceneLight light;
  light.name = name_of(json, node);
  const Json& type = member(json, "type");
  if (type == "point") {
    light.kind = LightKind::point;
  } else if (type == "spot") {
    light.kind = LightKind::spot;
  } else if (type != "directional") {
    return leave_out("unknown type");
  }
  const Json& color = member(json, "color");
  for (std::size_t c = 0; color.is_array() && c < 3 && c < color.size(); ++c)
    light.color[static_cast<int>(c)] = static_cast<float>(number_of(color[c], 1));
  light.intensity = static_cast<float>(number_of(member(json, "intensity"), 1));
  light.range = number_of(member(json, "range"), 0);
  light.position = V3d(world[3][0], world[3][1], world[3][2]);
  // Only the direction: the extension leaves scales out.
  light.direction = -row(world, 2).normalized();
  if (light.kind == LightKind::spot) {
    const Json& spot = member(json, "spot");
    light.inner_cone = number_of(member(spot, "innerConeAngle"), 0);
    light.outer_cone = number_of(member(spot, "outerConeAngle"), std::numbers::pi / 4);
    if (!(light.inner_cone >= 0 && light.inner_cone < light.outer_cone &&
          light.outer_cone <= std::numbers::pi / 2))
      return leave_out("the angles of its cone are out of range");
  }
  if (!finite(world) || light.direction.length() < 0.5) return leave_out("its node has no direction");
  if (!(light.intensity >= 0) || !std::isfinite(light.intensity) || !(light.range >= 0))
    return leave_out("its intensity or range is out of range");
  return light;
}

Result<std::vector<M44d>> places_of_node(const GltfDocument& document, const Json& node,
                                         const std::string& place, const M44d& world, std::size_t limit) {
  using names::gltf::gpu_instancing;
  const Json& extension = member(member(node, "extensions"), gpu_instancing);
  if (extension.is_null()) return std::vector<M44d>{world};
  const std::string where = fmt::format("{}/extensions/{}", place, gpu_instancing);
  const Json& attributes = member(extension, "attributes");
  std::size_t count = 0;  // of the first attribute, and so of all
  std::vector<V3d> translations;
  std::vector<Imath::V4d> rotations;
  std::vector<V3d> scales;
  const auto read = [&]<class V>(const char* name, std::vector<V>& values) -> Result<void> {
    const Json& accessor = member(attributes, name);
    if (accessor.is_null()) return {};
    const std::string at = fmt::format("{}/attributes/{}", where, name);
    const Result<AccessorShape> shape = shape_of(document, index_of(accessor), at);
    if (shape && shape->count > limit)
      return fail(Code::file_too_large, document.file, at, "too many instances");
    auto found = read_vectors<V>(document, index_of(accessor), count, at);
    if (!found) return tl::unexpected<Error>(std::move(found.error()));
    values = std::move(*found);
    count = values.size();
    return {};
  };
  for (Result<void> good :
       {read("TRANSLATION", translations), read("ROTATION", rotations), read("SCALE", scales)}) {
    if (!good) return tl::unexpected<Error>(std::move(good.error()));
  }
  std::vector<M44d> places;
  places.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    M44d local;
    if (!scales.empty()) local.setScale(scales[i]);
    if (!rotations.empty()) {
      const Imath::V4d& r = rotations[i];
      local *= Imath::Quatd(r.w, r.x, r.y, r.z).normalized().toMatrix44();
    }
    if (!translations.empty()) local *= M44d().setTranslation(translations[i]);
    places.push_back(local * world);
  }
  return places;
}

}  // namespace selvedge
