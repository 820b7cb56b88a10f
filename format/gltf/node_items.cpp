#include "format/gltf/node_items.h"

#include <Imath/ImathMatrix.h>
#include <Imath/ImathQuat.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/gltf/materials.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

std::string name_of(const Json& json, const Json& node) {
  const std::string name = string_of(member(json, "name"));
  return name.empty() ? string_of(member(node, "name")) : name;
}

V3d row(const M44d& m, int i) { return {m[i][0], m[i][1], m[i][2]}; }

bool finite(const M44d& m) {
  return std::all_of(&m[0][0], &m[0][0] + 16, [](double x) { return std::isfinite(x); });
}

bool is_positive(double value) { return std::isfinite(value) && value > 0; }

}  // namespace

void read_camera(const GltfDocument& document, const Json& node, const M44d& world, Scene& scene) {
  const int index = index_of(member(node, "camera"));
  if (index < 0) return;
  const Json& json = entry_of(document, "cameras", index);
  SceneCamera camera;
  camera.world = world;
  camera.name = name_of(json, node);
  camera.perspective = member(json, "type") != "orthographic";
  const Json& lens = member(json, camera.perspective ? "perspective" : "orthographic");
  const auto number = [&](const char* key) { return number_of(member(lens, key), 0); };
  camera.znear = number("znear");
  camera.yfov = number("yfov");
  camera.magnification = V2d(number("xmag"), number("ymag"));
  if (const double far = number("zfar"); far > camera.znear) camera.zfar = far;
  if (const double aspect = number("aspectRatio"); is_positive(aspect)) camera.aspect = aspect;
  const bool has_lens = camera.perspective
                            ? is_positive(camera.yfov) && camera.yfov < std::numbers::pi && camera.znear > 0
                            : is_positive(camera.magnification.x) && is_positive(camera.magnification.y) &&
                                  camera.zfar.has_value();
  if (has_lens && finite(world) && row(world, 2).length() > 0) return scene.cameras.push_back(camera);
  remark(scene, fmt::format("/cameras/{}: nothing can be seen through it; left out", index));
}

void read_light(const GltfDocument& document, const Json& node, const M44d& world, Scene& scene) {
  using names::gltf::lights_punctual;
  const Json& number = member(member(member(node, "extensions"), lights_punctual), "light");
  if (number.is_null()) return;
  const int index = index_of(number);
  const Json& lights = array_of(member(member(document.json, "extensions"), lights_punctual), "lights");
  const std::string place = fmt::format("/extensions/{}/lights/{}", lights_punctual, index);
  const auto leave_out = [&](const char* why) { remark(scene, fmt::format("{}: {}; left out", place, why)); };
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
  // The extension ignores scales.
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
  scene.lights.push_back(light);
}

std::vector<M44d> places_of_node(GltfReader& reader, const Json& node, const std::string& place,
                                 const M44d& world, std::size_t limit) {
  using names::gltf::gpu_instancing;
  const Json& extension = member(member(node, "extensions"), gpu_instancing);
  if (extension.is_null()) return {world};
  const std::string where = fmt::format("{}/extensions/{}/attributes", place, gpu_instancing);
  const Json& attributes = member(extension, "attributes");
  std::size_t count = 0;  // of the first attribute, and so of all
  const auto read = [&]<class V>(V, const char* name) {
    const Json& accessor = member(attributes, name);
    const std::string at = where + "/" + name;
    if (!accessor.is_null() && reader.accessor_shape(index_of(accessor), at).count > limit)
      reader.fail(Code::file_too_large, at, "too many instances");
    std::vector<V> values = reader.attribute<V>(attributes, name, count, where);
    if (!values.empty()) count = values.size();
    return values;
  };
  const auto translations = read(V3d(), "TRANSLATION");
  const auto rotations = read(Imath::V4d(), "ROTATION");
  const auto scales = read(V3d(), "SCALE");
  std::vector<M44d> places;
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
