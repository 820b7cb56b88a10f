#include "samples/gltf_writer.h"

#include "format/gltf/edit.h"

namespace selvedge {

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
  for (const GarmentPrimitive& primitive : garment.primitives) {
    Json attributes = Json::object();
    attributes["POSITION"] = append_float_accessor(document, floats_of(primitive.positions), 3, true);
    if (!primitive.normals.empty()) {
      attributes["NORMAL"] = append_float_accessor(document, floats_of(primitive.normals), 3, false);
    }
    if (!primitive.tex_coords.empty()) {
      attributes["TEXCOORD_0"] = append_float_accessor(document, floats_of(primitive.tex_coords), 2, false);
    }
    primitives.push_back(Json{{"attributes", std::move(attributes)},
                              {"indices", append_index_accessor(document, primitive.indices)},
                              {"material", primitive.material}});
  }
  document.json["meshes"] =
      Json::array({Json{{"name", garment.name}, {"primitives", std::move(primitives)}}});
  document.json["materials"] = std::move(materials);
  return save_gltf(std::move(document), path).map([](std::uint64_t) {});
}

}  // namespace selvedge
