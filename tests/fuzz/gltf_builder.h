// A glTF document under construction, and the square that most seeds are made of.
#pragma once

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/format/gltf_fixtures.h"

namespace selvedge::fuzz {

using Json = nlohmann::ordered_json;
using test::glb;

/// Bytes of numbers of type T.
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

inline const std::vector<float> positions{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
inline const std::vector<float> normals{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
inline const std::vector<float> coordinates{0, 0, 1, 0, 1, 1, 0, 1};
inline const std::vector<std::uint16_t> corners{0, 1, 2, 0, 2, 3};

inline Json& primitive_of(Builder& b) { return b.json["meshes"][0]["primitives"][0]; }

}  // namespace selvedge::fuzz
