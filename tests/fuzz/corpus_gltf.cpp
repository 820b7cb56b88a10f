#include "tests/fuzz/corpus_gltf.h"

#include <draco/compression/expert_encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/format/gltf_fixtures.h"

namespace selvedge::fuzz {
namespace {

using Json = nlohmann::ordered_json;
using test::glb;

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// A document and its one buffer.
struct Builder {
  Json json{{"asset", {{"version", "2.0"}}},
            {"scene", 0},
            {"scenes", {{{"nodes", {0}}}}},
            {"nodes", {{{"mesh", 0}}}}};
  std::string binary;

  int view(const std::string& bytes, int stride = 0) {
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    Json view{{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}};
    if (stride > 0) view["byteStride"] = stride;
    binary += bytes;
    json["bufferViews"].push_back(view);
    return static_cast<int>(json["bufferViews"].size()) - 1;
  }
  int accessor(int view, int component_type, std::size_t count, const char* type, std::size_t offset = 0) {
    Json accessor{{"componentType", component_type}, {"count", count}, {"type", type}};
    if (view >= 0) accessor["bufferView"] = view;
    if (offset > 0) accessor["byteOffset"] = offset;
    json["accessors"].push_back(accessor);
    return static_cast<int>(json["accessors"].size()) - 1;
  }
  /// The corners of the square, or of what else fits into 1 x 1.
  int position(int view, std::size_t count, int component_type = 5126) {
    const int index = accessor(view, component_type, count, "VEC3");
    const int side = component_type == 5126 ? 1 : 9;
    json["accessors"].back()["min"] = {0, 0, 0};
    json["accessors"].back()["max"] = {side, side, 0};
    return index;
  }
  std::string as_glb() {
    json["buffers"] = {{{"byteLength", binary.size()}}};
    return glb(json.dump(), binary);
  }
};

const std::vector<float> positions{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
const std::vector<float> normals{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
const std::vector<float> coordinates{0, 0, 1, 0, 1, 1, 0, 1};
const std::vector<std::uint16_t> corners{0, 1, 2, 0, 2, 3};

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

Json& primitive_of(Builder& b) { return b.json["meshes"][0]["primitives"][0]; }

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

/// What dressing has to carry along: tangents, a morph target, a skin, an animation, a variant.
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

/// The square as a Draco mesh; `company`: with joints, colours and metadata.
std::string compressed(bool edgebreaker, int bits, bool company = false) {
  draco::TriangleSoupMeshBuilder soup;
  soup.Start(2);
  const int position = soup.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int normal = soup.AddAttribute(draco::GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32);
  const int uv = soup.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
  int joints = 0;
  int colour = 0;
  if (company) {
    joints = soup.AddAttribute(draco::GeometryAttribute::GENERIC, 4, draco::DT_UINT16);
    colour = soup.AddAttribute(draco::GeometryAttribute::COLOR, 4, draco::DT_UINT8);
  }
  for (std::uint32_t f = 0; f < 2; ++f) {
    const auto corner = [&](const std::vector<float>& values, std::size_t k, std::size_t components) {
      return values.data() + corners[3 * f + k] * components;
    };
    const draco::FaceIndex face(f);
    soup.SetAttributeValuesForFace(position, face, corner(positions, 0, 3), corner(positions, 1, 3),
                                   corner(positions, 2, 3));
    soup.SetAttributeValuesForFace(normal, face, corner(normals, 0, 3), corner(normals, 1, 3),
                                   corner(normals, 2, 3));
    soup.SetAttributeValuesForFace(uv, face, corner(coordinates, 0, 2), corner(coordinates, 1, 2),
                                   corner(coordinates, 2, 2));
    if (company) {
      const std::array<std::uint16_t, 4> joint{0, static_cast<std::uint16_t>(f), 2, 300};
      const std::array<std::uint8_t, 4> red{255, 0, static_cast<std::uint8_t>(f), 255};
      soup.SetAttributeValuesForFace(joints, face, joint.data(), joint.data(), joint.data());
      soup.SetAttributeValuesForFace(colour, face, red.data(), red.data(), red.data());
    }
  }
  const auto mesh = soup.Finalize();
  if (company) {
    auto metadata = std::make_unique<draco::GeometryMetadata>();
    metadata->AddEntryString("made by", "us");
    mesh->AddMetadata(std::move(metadata));
    auto of_joints = std::make_unique<draco::AttributeMetadata>();
    of_joints->AddEntryInt("joints", 4);
    mesh->AddAttributeMetadata(joints, std::move(of_joints));
  }
  draco::ExpertEncoder encoder(*mesh);
  encoder.SetEncodingMethod(edgebreaker ? draco::MESH_EDGEBREAKER_ENCODING : draco::MESH_SEQUENTIAL_ENCODING);
  encoder.SetSpeedOptions(edgebreaker ? 0 : 5, 5);
  for (const int id : {position, normal, uv}) {
    if (bits > 0) encoder.SetAttributeQuantization(id, bits);
  }
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeToBuffer(&buffer).ok()) return {};

  Builder b;
  const int view = b.view({buffer.data(), buffer.size()});
  const int a = b.position(-1, mesh->num_points());
  const int n = b.accessor(-1, 5126, mesh->num_points(), "VEC3");
  const int t = b.accessor(-1, 5126, mesh->num_points(), "VEC2");
  const int i = b.accessor(-1, 5123, 6, "SCALAR");
  const auto id_of = [&](int attribute) { return mesh->attribute(attribute)->unique_id(); };
  b.json["meshes"] = {{{"primitives",
                        {{{"attributes", {{"POSITION", a}, {"NORMAL", n}, {"TEXCOORD_0", t}}},
                          {"indices", i},
                          {"extensions",
                           {{"KHR_draco_mesh_compression",
                             {{"bufferView", view},
                              {"attributes",
                               {{"POSITION", id_of(position)},
                                {"NORMAL", id_of(normal)},
                                {"TEXCOORD_0", id_of(uv)}}}}}}}}}}}};
  if (company) {
    Json& ids = primitive_of(b)["extensions"]["KHR_draco_mesh_compression"]["attributes"];
    ids["JOINTS_0"] = id_of(joints);
    ids["COLOR_0"] = id_of(colour);
    primitive_of(b)["attributes"]["JOINTS_0"] = b.accessor(-1, 5123, mesh->num_points(), "VEC4");
    primitive_of(b)["attributes"]["COLOR_0"] = b.accessor(-1, 5121, mesh->num_points(), "VEC4");
    b.json["accessors"].back()["normalized"] = true;
    const std::vector<float> weights{1, 0, 0, 0};
    std::vector<float> all;
    for (std::uint32_t p = 0; p < mesh->num_points(); ++p)
      all.insert(all.end(), weights.begin(), weights.end());
    primitive_of(b)["attributes"]["WEIGHTS_0"] =
        b.accessor(b.view(bytes_of(all)), 5126, mesh->num_points(), "VEC4");
  }
  b.json["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  b.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  return b.as_glb();
}

/// A square whose views are compressed in every mode and by every filter.
std::string meshopt() {
  Builder b;
  std::size_t plain = 0;
  const auto view = [&](const std::vector<unsigned char>& stream, const char* mode, std::size_t count,
                        std::size_t stride, const char* filter = "NONE") {
    const int number = b.view({stream.begin(), stream.end()});
    Json& json = b.json["bufferViews"].back();
    Json extension{{"buffer", 0},
                   {"byteOffset", json["byteOffset"]},
                   {"byteLength", stream.size()},
                   {"byteStride", stride},
                   {"mode", mode},
                   {"count", count},
                   {"filter", filter}};
    json = {{"buffer", 1}, {"byteOffset", plain}, {"byteLength", count * stride}};
    json["extensions"]["EXT_meshopt_compression"] = std::move(extension);
    plain += count * stride;
    return number;
  };
  const auto attributes = [](const void* values, std::size_t count, std::size_t stride) {
    std::vector<unsigned char> stream(meshopt_encodeVertexBufferBound(count, stride));
    stream.resize(meshopt_encodeVertexBuffer(stream.data(), stream.size(), values, count, stride));
    return stream;
  };
  const std::vector<unsigned> indices(corners.begin(), corners.end());
  std::vector<unsigned char> list(meshopt_encodeIndexBufferBound(6, 4));
  list.resize(meshopt_encodeIndexBuffer(list.data(), list.size(), indices.data(), 6));
  std::vector<unsigned char> sequence(meshopt_encodeIndexSequenceBound(6, 4));
  sequence.resize(meshopt_encodeIndexSequence(sequence.data(), sequence.size(), indices.data(), 6));
  const std::vector<std::int8_t> octahedra{0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0};
  const std::vector<std::int32_t> powers{0, 1 << 24 | 1, 0, 0, 3, 3, 0, 5};
  const std::vector<std::int16_t> turns{0, 0, 0, 2047, 0, 0, 0, 2047, 0, 0, 0, 2047, 0, 0, 0, 2047};

  const int position = b.position(view(attributes(positions.data(), 4, 12), "ATTRIBUTES", 4, 12), 4);
  const int normal =
      b.accessor(view(attributes(octahedra.data(), 4, 4), "ATTRIBUTES", 4, 4, "OCTAHEDRAL"), 5120, 4, "VEC3");
  b.json["accessors"].back()["normalized"] = true;
  b.json["bufferViews"].back()["byteStride"] = 4;
  const int uv =
      b.accessor(view(attributes(powers.data(), 4, 8), "ATTRIBUTES", 4, 8, "EXPONENTIAL"), 5126, 4, "VEC2");
  view(attributes(turns.data(), 4, 8), "ATTRIBUTES", 4, 8, "QUATERNION");
  const int triangles = b.accessor(view(list, "TRIANGLES", 6, 2), 5123, 6, "SCALAR");
  const int plain_order = b.accessor(view(sequence, "INDICES", 6, 4), 5125, 6, "SCALAR");
  const Json vertices{{"POSITION", position}, {"NORMAL", normal}, {"TEXCOORD_0", uv}};
  b.json["meshes"] = {{{"primitives",
                        {{{"attributes", vertices}, {"indices", triangles}},
                         {{"attributes", vertices}, {"indices", plain_order}}}}}};
  b.json["extensionsUsed"] = {"EXT_meshopt_compression", "KHR_mesh_quantization"};
  b.json["extensionsRequired"] = {"EXT_meshopt_compression", "KHR_mesh_quantization"};
  b.json["buffers"] = {
      {{"byteLength", b.binary.size()}},
      {{"byteLength", plain}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}};
  return glb(b.json.dump(), b.binary);
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
