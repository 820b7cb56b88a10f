// Garments for tests, and their GLB files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "format/base/vec.h"
#include "format/gltf/edit.h"

namespace selvedge {

/// Triangles of one material. Arrays are per vertex; metres, +y up, v growing downwards in the picture.
struct GarmentPrimitive {
  int material = 0;  ///< index into Garment::materials
  std::vector<V3f> positions;
  std::vector<V3f> normals;  ///< unit; empty: none
  std::vector<V2f> tex_coords;
  std::vector<std::uint32_t> indices;  ///< three per triangle, counter-clockwise from outside
};

/// One node with one mesh. Materials have only a name.
struct Garment {
  std::string name;
  std::vector<std::string> materials;
  std::vector<GarmentPrimitive> primitives;
};

/// Writes a GLB.
inline Result<std::uint64_t> write_garment(const std::string& path, const Garment& garment) {
  GltfDocument document;
  document.json = Json{{"asset", {{"version", "2.0"}}}, {"scene", 0}};
  document.json["scenes"] = Json::array({Json{{"nodes", {0}}}});
  document.json["nodes"] = Json::array({Json{{"name", garment.name}, {"mesh", 0}}});
  for (const std::string& name : garment.materials) {
    document.json["materials"].push_back(Json{{"name", name}, {"doubleSided", true}});
    document.json["materials"].back()["pbrMetallicRoughness"] = {
        {"baseColorFactor", {0.8, 0.8, 0.8, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 1}};
  }
  Json primitives = Json::array();
  for (const GarmentPrimitive& p : garment.primitives) {
    Json attributes{{"POSITION", append_float_accessor(document, floats_of(p.positions), 3, true)}};
    if (!p.normals.empty())
      attributes["NORMAL"] = append_float_accessor(document, floats_of(p.normals), 3, false);
    if (!p.tex_coords.empty())
      attributes["TEXCOORD_0"] = append_float_accessor(document, floats_of(p.tex_coords), 2, false);
    primitives.push_back(Json{{"attributes", std::move(attributes)},
                              {"indices", append_index_accessor(document, p.indices)},
                              {"material", p.material}});
  }
  document.json["meshes"] =
      Json::array({Json{{"name", garment.name}, {"primitives", std::move(primitives)}}});
  return save_gltf(std::move(document), path);
}

}  // namespace selvedge

namespace selvedge::test {

/// A square of one metre with one unit of UV, all of it once per primitive, in the materials "cloth 0",
/// "cloth 1"...
inline Garment square(int primitives = 1) {
  Garment garment;
  garment.name = "square";
  for (int i = 0; i < primitives; ++i) {
    garment.materials.push_back("cloth " + std::to_string(i));
    GarmentPrimitive primitive;
    primitive.material = i;
    primitive.positions = {V3f(0, 0, 0), V3f(1, 0, 0), V3f(1, 1, 0), V3f(0, 1, 0)};
    primitive.normals.assign(4, V3f(0, 0, 1));
    primitive.tex_coords = {V2f(0, 1), V2f(1, 1), V2f(1, 0), V2f(0, 0)};
    primitive.indices = {0, 1, 2, 0, 2, 3};
    garment.primitives.push_back(primitive);
  }
  return garment;
}

}  // namespace selvedge::test
