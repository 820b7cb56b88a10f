#include "samples/gltf_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/gltf/edit.h"

namespace selvedge {
namespace {

template <class V>
std::span<const float> floats(const std::vector<V>& values) {
  static_assert(sizeof(V) == V::dimensions() * sizeof(float));
  // Imath's vectors are arrays of floats without padding.
  return {reinterpret_cast<const float*>(values.data()), values.size() * V::dimensions()};
}

bool finite(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

Result<void> check(const GarmentPrimitive& primitive, std::size_t materials, const std::string& path,
                   const std::string& place) {
  const std::size_t count = primitive.positions.size();
  const auto fits = [&](std::size_t size) { return size == 0 || size == count; };
  if (count == 0 || primitive.indices.empty()) return fail(Code::mesh_empty, path, place, "no triangles");
  if (!fits(primitive.normals.size()) || !fits(primitive.tangents.size()) ||
      !fits(primitive.tex_coords.size()) || primitive.indices.size() % 3 != 0) {
    return fail(Code::mesh_invalid, path, place, "arrays of different lengths");
  }
  if (std::any_of(primitive.indices.begin(), primitive.indices.end(),
                  [&](std::uint32_t i) { return i >= count; })) {
    return fail(Code::mesh_invalid, path, place, "an index is out of range");
  }
  if (primitive.material < 0 || static_cast<std::size_t>(primitive.material) >= materials) {
    return fail(Code::mesh_invalid, path, place, fmt::format("there is no material {}", primitive.material));
  }
  if (!finite(floats(primitive.positions)) || !finite(floats(primitive.normals)) ||
      !finite(floats(primitive.tangents)) || !finite(floats(primitive.tex_coords))) {
    return fail(Code::mesh_not_finite, path, place, "a value is not finite");
  }
  return {};
}

}  // namespace

Result<void> write_garment(const std::string& path, const Garment& garment) {
  GltfDocument document;
  document.json = Json{{"asset", {{"version", "2.0"}, {"generator", "Selvedge"}}}, {"scene", 0}};
  document.json["scenes"] = Json::array({Json{{"nodes", {0}}}});
  document.json["nodes"] = Json::array({Json{{"name", garment.name}, {"mesh", 0}}});
  Json materials = Json::array();
  for (const GarmentMaterial& material : garment.materials) {
    const V4f& color = material.base_color;
    Json json{{"name", material.name}};
    json["pbrMetallicRoughness"] = {{"baseColorFactor", {color.x, color.y, color.z, color.w}},
                                    {"metallicFactor", 0},
                                    {"roughnessFactor", material.roughness}};
    if (material.double_sided) json["doubleSided"] = true;
    materials.push_back(std::move(json));
  }
  Json primitives = Json::array();
  for (std::size_t p = 0; p < garment.primitives.size(); ++p) {
    const GarmentPrimitive& primitive = garment.primitives[p];
    if (Result<void> good = check(primitive, garment.materials.size(), path, fmt::format("primitive {}", p));
        !good) {
      return good;
    }
    Json attributes = Json::object();
    attributes["POSITION"] = append_float_accessor(document, floats(primitive.positions), 3, true);
    if (!primitive.normals.empty()) {
      attributes["NORMAL"] = append_float_accessor(document, floats(primitive.normals), 3, false);
    }
    if (!primitive.tangents.empty()) {
      attributes["TANGENT"] = append_float_accessor(document, floats(primitive.tangents), 4, false);
    }
    if (!primitive.tex_coords.empty()) {
      attributes["TEXCOORD_0"] = append_float_accessor(document, floats(primitive.tex_coords), 2, false);
    }
    primitives.push_back(Json{{"attributes", std::move(attributes)},
                              {"indices", append_index_accessor(document, primitive.indices)},
                              {"material", primitive.material}});
  }
  if (primitives.empty()) return fail(Code::mesh_empty, path, "", "a garment without primitives");
  document.json["meshes"] =
      Json::array({Json{{"name", garment.name}, {"primitives", std::move(primitives)}}});
  document.json["materials"] = std::move(materials);
  const Result<std::uint64_t> bytes = save_gltf(std::move(document), path);
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  return {};
}

}  // namespace selvedge
