// A .glb file as it is, nothing of it expanded.
#pragma once

#include <cstring>
#include <string>
#include <vector>

#include "format/base/atomic_file.h"
#include "format/gltf/access.h"
#include "format/gltf/names.h"
#include "tests/require.h"

namespace selvedge::test {

struct RawGlb {
  Json json;
  std::string binary;

  explicit RawGlb(const std::string& path) {
    const std::string bytes = need(read_file(path));
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data() + 12, sizeof length);
    json = Json::parse(bytes.substr(20, length));
    binary = bytes.substr(std::min(bytes.size(), std::size_t{28} + length));
  }

  std::string bytes_of(const Json& range) const {
    return binary.substr(whole_number(member(range, "byteOffset")).value_or(0), range.at("byteLength"));
  }

  /// The compressed streams of primitives (Draco) and views (meshopt).
  std::vector<std::string> streams() const {
    std::vector<std::string> found;
    for (const Json& mesh : json["meshes"]) {
      for (const Json& primitive : mesh["primitives"]) {
        const Json& extension = member(member(primitive, "extensions"), names::gltf::draco);
        if (extension.is_object())
          found.push_back(bytes_of(json["bufferViews"][extension["bufferView"].get<std::size_t>()]));
      }
    }
    for (const Json& view : json["bufferViews"]) {
      const Json& extension = member(member(view, "extensions"), names::gltf::meshopt);
      if (extension.is_object()) found.push_back(bytes_of(extension));
    }
    return found;
  }
};

}  // namespace selvedge::test
