#include "tests/fuzz/corpus_gltf.h"

#include "tests/fuzz/gltf_builder.h"

namespace selvedge::fuzz {
namespace {

/// A square with everything that a garment needs.
Builder quad() {
  Builder b;
  const int position = b.position(b.view(bytes_of(positions)), 4);
  const int normal = b.accessor(b.view(bytes_of(normals)), 5126, 4, "VEC3");
  const int uv = b.accessor(b.view(bytes_of(coordinates)), 5126, 4, "VEC2");
  const int indices = b.accessor(b.view(bytes_of(corners)), 5123, 6, "SCALAR");
  b.json["meshes"] = {{{"name", "square"},
                       {"primitives",
                        {{{"attributes", {{"POSITION", position}, {"NORMAL", normal}, {"TEXCOORD_0", uv}}},
                          {"indices", indices},
                          {"material", 0}}}}}};
  b.json["materials"] = {{{"name", "cloth"}, {"doubleSided", true}}};
  return b;
}

std::string base64(const std::string& bytes) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      word = word << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += i + k > bytes.size() ? '=' : digits[word >> (18 - 6 * k) & 63U];
    }
  }
  return text;
}

std::string dressed(const std::string& fabric, const std::string& picture) {
  Builder b = quad();
  const int view = b.view(fabric);
  b.json["extensionsUsed"] = {"SELVEDGE_materials_fabric", "KHR_texture_transform"};
  b.json["extensions"]["SELVEDGE_materials_fabric"]["fabrics"] = {
      {{"name", "knit"}, {"mimeType", "image/x-exr"}, {"bufferView", view}}};
  const Json transform{{"KHR_texture_transform",
                        {{"offset", {0.25, 0.5}}, {"rotation", 0.5}, {"scale", {4, 5}}, {"texCoord", 0}}}};
  b.json["textures"] = {{{"source", 0}}};
  b.json["images"] = {{{"uri", "data:image/png;base64," + base64(picture)}, {"name", "colour"}},
                      {{"bufferView", b.view(picture)}, {"mimeType", "image/png"}}};
  Json& material = b.json["materials"][0];
  material["alphaMode"] = "MASK";
  material["alphaCutoff"] = 0.5;
  material["pbrMetallicRoughness"] = {{"baseColorTexture", {{"index", 0}, {"extensions", transform}}},
                                      {"baseColorFactor", {1, 0.5, 0.25, 1}},
                                      {"metallicFactor", 0}};
  const Json info{{"index", 0}, {"texCoord", 0}, {"extensions", transform}};
  material["extensions"]["SELVEDGE_materials_fabric"]["fabric"] = info;
  material["extras"]["SELVEDGE_materials_fabric"] = info;
  material["extras"]["SELVEDGE_materials_fabric"]["name"] = "knit";
  return b.as_glb();
}

/// A data URI instead of a binary chunk.
std::string as_text(const std::string& uri) {
  Builder b = quad();
  b.json["buffers"] = {{{"byteLength", b.binary.size()}, {"uri", uri}}};
  return b.json.dump(1);
}

/// Strip, fan and points over one interleaved view, 8-bit indices, no normals, nodes in a tree.
std::string modes() {
  Builder b;
  std::vector<float> rows;
  for (std::size_t v = 0; v < 4; ++v) {
    rows.insert(rows.end(), positions.begin() + static_cast<std::ptrdiff_t>(3 * v),
                positions.begin() + static_cast<std::ptrdiff_t>(3 * v + 3));
    rows.insert(rows.end(), coordinates.begin() + static_cast<std::ptrdiff_t>(2 * v),
                coordinates.begin() + static_cast<std::ptrdiff_t>(2 * v + 2));
  }
  const int view = b.view(bytes_of(rows), 20);
  const int position = b.position(view, 4);
  const int uv = b.accessor(view, 5126, 4, "VEC2", 12);
  const int indices = b.accessor(b.view(bytes_of(std::vector<std::uint8_t>{0, 1, 3, 2})), 5121, 4, "SCALAR");
  b.json["meshes"] = {{{"primitives", Json::array()}}};
  for (const int mode : {5, 6, 0, 4}) {
    Json primitive{{"attributes", {{"POSITION", position}, {"TEXCOORD_0", uv}}}, {"mode", mode}};
    if (mode == 4) primitive["attributes"]["POSITION"] = b.position(view, 3);
    if (mode == 4) primitive["attributes"].erase("TEXCOORD_0");
    if (mode != 4) primitive["indices"] = indices;
    b.json["meshes"][0]["primitives"].push_back(primitive);
  }
  b.json["nodes"] = {{{"children", {1, 2}}, {"translation", {1, 2, 3}}, {"rotation", {0, 0, 1, 0}}},
                     {{"mesh", 0}, {"scale", {2, 2, 2}}},
                     {{"mesh", 0}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}}}};
  return b.as_glb();
}

std::string sparse() {
  Builder b = quad();
  const int indices = b.view(bytes_of(std::vector<std::uint16_t>{1, 3}));
  const auto replace = [&](std::size_t accessor, const std::vector<float>& values) {
    b.json["accessors"][accessor]["sparse"] = {
        {"count", 2},
        {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
        {"values", {{"bufferView", b.view(bytes_of(values))}}}};
  };
  replace(0, {1, 0, 0.5F, 0, 1, 0.5F});
  b.json["accessors"][0]["max"][2] = 0.5;
  replace(1, {0, 0.6F, 0.8F, 0.6F, 0, 0.8F});
  replace(2, {1, 0, 1, 1});
  b.json["accessors"][2].erase("bufferView");  // zeros, and two of them replaced
  return b.as_glb();
}

std::string quantized() {
  Builder b = quad();
  b.json["extensionsUsed"] = {"KHR_mesh_quantization"};
  b.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  const int position = b.position(
      b.view(bytes_of(std::vector<std::uint16_t>{0, 0, 0, 0, 9, 0, 0, 0, 9, 9, 0, 0, 0, 9, 0, 0}), 8), 4,
      5123);
  const int normal = b.accessor(
      b.view(bytes_of(std::vector<std::int8_t>{0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0}), 4),
      5120, 4, "VEC3");
  b.json["accessors"][normal]["normalized"] = true;
  primitive_of(b)["attributes"]["POSITION"] = position;
  primitive_of(b)["attributes"]["NORMAL"] = normal;
  return b.as_glb();
}

/// Parts that dressing has to preserve: tangents, a morph target, a skin, an animation, a variant.
std::string company() {
  Builder b = quad();
  const std::vector<float> tangents{1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1};
  primitive_of(b)["attributes"]["TANGENT"] = b.accessor(b.view(bytes_of(tangents)), 5126, 4, "VEC4");
  primitive_of(b)["targets"] = {{{"POSITION", 0}, {"NORMAL", 1}}};
  primitive_of(b)["extensions"]["KHR_materials_variants"]["mappings"] = {
      {{"material", 0}, {"variants", {0}}}};
  b.json["extensionsUsed"] = {"KHR_materials_variants"};
  b.json["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "red"}}};
  b.json["nodes"][0]["skin"] = 0;
  b.json["skins"] = {{{"joints", {0}}}};
  Json& attributes = primitive_of(b)["attributes"];
  attributes["JOINTS_0"] = b.accessor(b.view(std::string(16, '\0')), 5121, 4, "VEC4");
  attributes["WEIGHTS_0"] = b.accessor(
      b.view(bytes_of(std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0})), 5126, 4, "VEC4");
  const int times = b.accessor(b.view(bytes_of(std::vector<float>{0, 1})), 5126, 2, "SCALAR");
  b.json["accessors"].back()["min"] = {0};
  b.json["accessors"].back()["max"] = {1};
  const int places = b.accessor(b.view(bytes_of(std::vector<float>{0, 0, 0, 1, 1, 1})), 5126, 2, "VEC3");
  b.json["animations"] = {
      {{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
       {"samplers", {{{"input", times}, {"output", places}}}}}};
  return b.as_glb();
}

/// A square that is morphed and skinned, one of instances, a camera, a light, two scenes, a variant.
std::string rest() {
  Builder b = quad();
  const std::vector<std::uint8_t> joints(16, 0);
  std::vector<float> weights;
  for (int v = 0; v < 4; ++v) weights.insert(weights.end(), {1, 0, 0, 0});
  std::vector<float> matrix(16, 0.0F);
  for (std::size_t i = 0; i < 16; i += 5) matrix[i] = 1;
  const int joint = b.accessor(b.view(bytes_of(joints)), 5121, 4, "VEC4");
  const int weight = b.accessor(b.view(bytes_of(weights)), 5126, 4, "VEC4");
  const int inverse = b.accessor(b.view(bytes_of(matrix)), 5126, 1, "MAT4");
  const int steps = b.accessor(b.view(bytes_of(positions)), 5126, 4, "VEC3");
  const int differences = b.position(b.view(bytes_of(positions)), 4);
  Json skinned = primitive_of(b);
  skinned["attributes"]["JOINTS_0"] = joint;
  skinned["attributes"]["WEIGHTS_0"] = weight;
  primitive_of(b)["targets"] = {{{"POSITION", differences}, {"NORMAL", differences}}};
  primitive_of(b)["extensions"]["KHR_materials_variants"]["mappings"] = {
      {{"material", 0}, {"variants", {0}}}};
  b.json["meshes"][0]["weights"] = {0.5};
  b.json["meshes"].push_back({{"primitives", {skinned}}});
  b.json["skins"] = {{{"joints", {2}}, {"inverseBindMatrices", inverse}}};
  b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}}};
  b.json["nodes"] = {
      {{"mesh", 0},
       {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", steps}}}}}}}},
      {{"mesh", 1}, {"skin", 0}},
      {{"translation", {0, 1, 0}}, {"children", {3}}},
      {{"camera", 0}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}}};
  b.json["scenes"] = {{{"nodes", {0, 1, 2}}}, {{"nodes", {2}}}};
  b.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing", "KHR_lights_punctual", "KHR_materials_variants"};
  b.json["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "spot"}, {"spot", {{"outerConeAngle", 0.5}}}}};
  b.json["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "night"}}};
  return b.as_glb();
}

}  // namespace

std::map<std::string, std::string> gltf_seeds(const std::string& fabric, const std::string& picture) {
  Builder plain = quad();
  return {{"company.glb", company()},
          {"data-uri.gltf", as_text("data:application/octet-stream;base64," + base64(quad().binary))},
          {"draco-company.glb", compressed(true, 12, true)},
          {"draco-edgebreaker.glb", compressed(true, 10)},
          {"draco-sequential.glb", compressed(false, 8)},
          {"draco-unquantized.glb", compressed(false, 0)},
          {"dressed.glb", dressed(fabric, picture)},
          {"external.gltf", as_text("../missing%20buffer.bin")},
          {"meshopt.glb", meshopt()},
          {"modes.glb", modes()},
          {"quad.glb", plain.as_glb()},
          {"quantized.glb", quantized()},
          {"rest.glb", rest()},
          {"sparse.glb", sparse()}};
}

}  // namespace selvedge::fuzz
