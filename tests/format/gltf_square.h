// A good glTF file to be broken, one rule at a time.
#pragma once

#include <doctest/doctest.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "format/check/gltf.h"
#include "format/gltf/document.h"
#include "tests/format/gltf_fixtures.h"

namespace selvedge::test {

/// A square of two triangles with all attributes that a fabric wants, as JSON to be broken, and its bytes.
struct Square {
  Json json;
  std::string bytes;

  Square() {
    bytes = bytes_of<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}) +
            bytes_of<float>({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}) +
            bytes_of<float>({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}) +
            bytes_of<float>({0, 1, 1, 1, 1, 0, 0, 0}) + bytes_of<std::uint16_t>({0, 1, 2, 0, 2, 3});
    json = Json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"TANGENT":2,"TEXCOORD_0":3},
                                "indices":4,"material":0}]}],
      "materials":[{"name":"cloth"}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
                   {"bufferView":1,"componentType":5126,"count":4,"type":"VEC3"},
                   {"bufferView":2,"componentType":5126,"count":4,"type":"VEC4"},
                   {"bufferView":3,"componentType":5126,"count":4,"type":"VEC2"},
                   {"bufferView":4,"componentType":5123,"count":6,"type":"SCALAR"}],
      "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48,"target":34962},
                     {"buffer":0,"byteOffset":48,"byteLength":48,"target":34962},
                     {"buffer":0,"byteOffset":96,"byteLength":64,"target":34962},
                     {"buffer":0,"byteOffset":160,"byteLength":32,"target":34962},
                     {"buffer":0,"byteOffset":192,"byteLength":12,"target":34963}],
      "buffers":[{"byteLength":204}]})");
  }

  template <class T>
  void put(std::size_t at, T value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
  }

  /// Appends a view of bytes, which begins at a multiple of 4; returns its number.
  std::size_t add_view(const std::string& more) {
    bytes.resize((bytes.size() + 3) / 4 * 4);
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", more.size()}});
    bytes += more;
    json["buffers"][0]["byteLength"] = bytes.size();
    return json["bufferViews"].size() - 1;
  }
  /// Appends an accessor over its own view; returns its number.
  std::size_t add_accessor(const std::string& more, int component_type, std::size_t count, const char* type) {
    json["accessors"].push_back({{"bufferView", add_view(more)},
                                 {"componentType", component_type},
                                 {"count", count},
                                 {"type", type}});
    return json["accessors"].size() - 1;
  }

  /// Refers to a fabric file, with a complete fallback (whose texture is a black pixel).
  void dress() {
    const std::string png(
        "\211\120\116\107\015\012\032\012\000\000\000\015\111\110\104\122\000\000\000\001\000\000\000\001\010"
        "\002\000\000\000\220\167\123\336\000\000\000\014\111\104\101\124\170\234\143\140\140\140\000\000\000"
        "\004\000\001\366\027\070\125\000\000\000\000\111\105\116\104\256\102\140\202",
        69);
    json["images"] = Json::array({{{"bufferView", add_view(png)}, {"mimeType", "image/png"}}});
    json["textures"] = Json::array({{{"source", 0}}});
    json["extensionsUsed"] = {"SELVEDGE_materials_fabric", "KHR_texture_transform"};
    json["extensions"]["SELVEDGE_materials_fabric"]["fabrics"] =
        Json::parse(R"([{"name":"net","mimeType":"image/x-exr","uri":"the%20net.exr"}])");
    json["materials"][0] = Json::parse(R"({"name":"cloth","alphaMode":"MASK","doubleSided":true,
      "pbrMetallicRoughness":{"metallicFactor":0,"baseColorTexture":{"index":0,
        "extensions":{"KHR_texture_transform":{"scale":[20,25]}}}},
      "extensions":{"SELVEDGE_materials_fabric":{"fabric":{"index":0,
        "extensions":{"KHR_texture_transform":{"scale":[20,25]}}}}}})");
  }

  /// Two variants, of which the second wears a copy of the material on the primitive.
  Json& wear_variants() {
    json["extensionsUsed"].push_back("KHR_materials_variants");
    json["extensions"]["KHR_materials_variants"]["variants"] = Json::parse(R"([{"name":"a"},{"name":"b"}])");
    json["materials"].push_back(Json(material()));
    Json& worn = primitive()["extensions"]["KHR_materials_variants"];
    worn["mappings"] = Json::parse(R"([{"material":0,"variants":[0]},{"material":1,"variants":[1]}])");
    return worn["mappings"];
  }

  /// A joint that the mesh is skinned to; JOINTS_0 of all vertices is 0.
  void skin() {
    std::string weights;
    for (int vertex = 0; vertex < 4; ++vertex) weights += bytes_of<float>({1, 0, 0, 0});
    primitive()["attributes"]["JOINTS_0"] = add_accessor(std::string(16, '\0'), 5121, 4, "VEC4");
    primitive()["attributes"]["WEIGHTS_0"] = add_accessor(weights, 5126, 4, "VEC4");
    json["nodes"][0]["skin"] = 0;
    json["nodes"].push_back(Json::object());
    json["scenes"][0]["nodes"].push_back(1);
    json["skins"] = Json::parse(R"([{"joints":[1]}])");
  }

  Json& at(const char* pointer) { return json[Json::json_pointer(pointer)]; }
  Json& primitive() { return at("/meshes/0/primitives/0"); }
  Json& material() { return at("/materials/0"); }
  Json& root_fabrics() { return at("/extensions/SELVEDGE_materials_fabric/fabrics"); }
};

inline Result<GltfDocument> load(const Square& square) {
  const std::string file = glb(square.json.dump(), square.bytes);
  return load_gltf({reinterpret_cast<const std::uint8_t*>(file.data()), file.size()}, "a.glb");
}

inline std::string text_of(const Issues& issues) {
  std::string text;
  for (const Error& issue : issues) text += to_line(issue) + "\n";
  return text;
}

inline Issues check(const Folder& folder, const Square& square) {
  write_bytes(folder / "case.glb", glb(square.json.dump(), square.bytes));
  return check_gltf(folder / "case.glb");
}

/// One rule that is broken, and the only issue that it may lead to.
struct Case {
  const char* what;
  std::function<void(Square&)> spoil;
  Code code;
  const char* place;
};

inline void check_cases(const Folder& folder, const std::vector<Case>& cases, bool dressed) {
  for (const Case& one : cases) {
    CAPTURE(one.what);
    Square square;
    if (dressed) square.dress();
    one.spoil(square);
    const Issues issues = check(folder, square);
    INFO(text_of(issues));
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].code == one.code);
    CHECK(issues[0].place == one.place);
    CHECK(issues[0].file == folder / "case.glb");
    CHECK_FALSE(issues[0].message.empty());
  }
}

}  // namespace selvedge::test
