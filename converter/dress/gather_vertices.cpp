#include "converter/dress/gather_vertices.h"

#include <fmt/format.h>

#include <map>

#include "format/gltf/edit.h"

namespace selvedge {
namespace {

class Gatherer {
 public:
  Gatherer(GltfDocument& document, GltfReader& reader, const std::vector<std::uint32_t>& sources)
      : document_(document), reader_(reader), sources_(sources) {}

  void gather_all(Json& attributes, const std::string& place) {
    for (const auto& [semantic, accessor] : attributes.items()) {
      const auto [made, fresh] = made_.try_emplace(index_of(accessor), -1);
      if (fresh) made->second = gather(made->first, place + "/" + semantic);
      accessor = made->second;
    }
  }

 private:
  /// A new accessor whose element i is element sources_[i] of the old one.
  int gather(int accessor, const std::string& place) {
    AccessorShape shape = reader_.accessor_shape(accessor, place);
    const std::size_t size = shape.element_size();
    const std::vector<std::uint8_t> elements = reader_.elements(accessor, place);
    std::vector<std::uint8_t> gathered;
    gathered.reserve(sources_.size() * size);
    for (const std::uint32_t source : sources_) {
      if (source >= shape.count)
        reader_.fail(Code::gltf_malformed, place, fmt::format("there is no element {}", source));
      const auto first = elements.begin() + static_cast<std::ptrdiff_t>(source * size);
      gathered.insert(gathered.end(), first, first + static_cast<std::ptrdiff_t>(size));
    }
    shape.count = sources_.size();
    Json json = document_.json["accessors"][accessor];
    json.erase("byteOffset");
    json.erase("sparse");
    json["bufferView"] = append_attribute_view(document_, shape, gathered);
    json["count"] = shape.count;
    if (json.contains("min") || json.contains("max")) {
      set_bounds(json, to_floats(gathered, shape.component_type, false), shape.components);
    }
    document_.json["accessors"].push_back(std::move(json));
    return static_cast<int>(document_.json["accessors"].size()) - 1;
  }

  GltfDocument& document_;
  GltfReader& reader_;
  const std::vector<std::uint32_t>& sources_;
  std::map<int, int> made_;  ///< by the accessor of which it is a copy: many may name one
};

}  // namespace

void gather_vertices(GltfDocument& document, GltfReader& reader, Json& primitive,
                     const std::vector<std::uint32_t>& sources, const std::string& place) {
  Gatherer gatherer(document, reader, sources);
  gatherer.gather_all(primitive["attributes"], place + "/attributes");
  if (!primitive.contains("targets")) return;
  for (Json& target : primitive["targets"]) gatherer.gather_all(target, place + "/targets");
}

}  // namespace selvedge
