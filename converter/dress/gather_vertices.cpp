#include "converter/dress/gather_vertices.h"

#include <fmt/format.h>

#include "format/gltf/edit.h"

namespace selvedge {
namespace {

/// A new accessor whose element i is element sources[i] of the old one; -1 after a fault.
int gather(GltfDocument& document, GltfReader& reader, int accessor,
           const std::vector<std::uint32_t>& sources, const std::string& place) {
  AccessorShape shape = reader.accessor_shape(accessor, place);
  const std::vector<std::uint8_t> elements = reader.elements(accessor, place);
  const std::size_t size = shape.element_size();
  std::vector<std::uint8_t> gathered;
  gathered.reserve(sources.size() * size);
  for (const std::uint32_t source : sources) {
    if (source >= shape.count)
      reader.fail(Code::gltf_malformed, place, fmt::format("there is no element {}", source));
    if (reader.fault) return -1;
    const auto first = elements.begin() + static_cast<std::ptrdiff_t>(source * size);
    gathered.insert(gathered.end(), first, first + static_cast<std::ptrdiff_t>(size));
  }
  shape.count = sources.size();
  Json json = document.json["accessors"][accessor];
  json.erase("byteOffset");
  json.erase("sparse");
  json["bufferView"] = append_attribute_view(document, shape, gathered);
  json["count"] = shape.count;
  if (json.contains("min") || json.contains("max")) {
    set_bounds(json, to_floats(gathered, shape.component_type, false), shape.components);
  }
  document.json["accessors"].push_back(std::move(json));
  return static_cast<int>(document.json["accessors"].size()) - 1;
}

void gather_all(GltfDocument& document, GltfReader& reader, Json& attributes,
                const std::vector<std::uint32_t>& sources, const std::string& place) {
  for (const auto& [semantic, accessor] : attributes.items()) {
    accessor = gather(document, reader, index_of(accessor), sources, place + "/" + semantic);
    if (reader.fault) return;
  }
}

}  // namespace

void gather_vertices(GltfDocument& document, GltfReader& reader, Json& primitive,
                     const std::vector<std::uint32_t>& sources, const std::string& place) {
  gather_all(document, reader, primitive["attributes"], sources, place + "/attributes");
  if (!primitive.contains("targets")) return;
  for (Json& target : primitive["targets"]) gather_all(document, reader, target, sources, place + "/targets");
}

}  // namespace selvedge
