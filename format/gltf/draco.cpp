#include "format/gltf/draco.h"

#include <draco/compression/decode.h>
#include <draco/compression/point_cloud/point_cloud_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <map>
#include <memory>
#include <set>

#include "format/gltf/edit.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

draco::DecoderBuffer buffer_of(std::span<const std::uint8_t> bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return buffer;
}

/// Limits far beyond real meshes, which take a bit or two for each face and little more.
constexpr std::size_t free_elements = std::size_t{1} << 16;
constexpr std::size_t elements_per_byte = 64;

template <class T>
bool copy_values(const draco::Mesh& mesh, const draco::PointAttribute& attribute, std::uint8_t* out) {
  const std::size_t components = static_cast<std::size_t>(attribute.num_components());
  std::vector<T> value(components);
  for (std::uint32_t p = 0; p < mesh.num_points(); ++p) {
    if (!attribute.ConvertValue<T>(attribute.mapped_index(draco::PointIndex(p)),
                                   static_cast<std::int8_t>(components), value.data())) {
      return false;
    }
    std::memcpy(out + p * components * sizeof(T), value.data(), components * sizeof(T));
  }
  return true;
}

bool copy_values(const draco::Mesh& mesh, const draco::PointAttribute& attribute, int component_type,
                 std::uint8_t* out) {
  constexpr std::array<bool (*)(const draco::Mesh&, const draco::PointAttribute&, std::uint8_t*), 7> copies{
      copy_values<std::int8_t>,   copy_values<std::uint8_t>, copy_values<std::int16_t>,
      copy_values<std::uint16_t>, copy_values<float>,        copy_values<std::uint32_t>,
      copy_values<float>};
  return copies.at(component_type - 5120)(mesh, attribute, out);
}

/// Quantisation leaves normals, tangents and weights that plain glTF does not allow.
void make_valid(const std::string& semantic, std::vector<float>& values, std::size_t components) {
  const bool weights = semantic.starts_with("WEIGHTS_");
  if (!weights && semantic != "NORMAL" && semantic != "TANGENT") return;
  for (std::size_t i = 0; i + components <= values.size(); i += components) {
    float* v = values.data() + i;
    double sum = 0;
    const std::size_t count = weights ? components : 3;
    for (std::size_t c = 0; c < count; ++c) sum += weights ? v[c] : double{v[c]} * v[c];
    const double length = weights ? sum : std::sqrt(sum);
    for (std::size_t c = 0; c < count && length > 0; ++c) v[c] = static_cast<float>(v[c] / length);
    if (components == 4 && !weights) v[3] = v[3] < 0 ? -1.0F : 1.0F;
  }
}

class Expander {
 public:
  explicit Expander(GltfDocument& document) : document_(document), reader_(document) {}

  void expand() {
    for (std::size_t m = 0; m < array_of(document_.json, "meshes").size(); ++m) {
      const std::size_t primitives = array_of(document_.json["meshes"][m], "primitives").size();
      for (std::size_t p = 0; p < primitives; ++p) {
        const Json primitive = document_.json["meshes"][m]["primitives"][p];
        if (member(member(primitive, "extensions"), names::gltf::draco).is_null()) continue;
        expand_primitive(primitive, fmt::format("/meshes/{}/primitives/{}", m, p));
        Json& plain = document_.json["meshes"][m]["primitives"][p];
        erase_extension(plain, names::gltf::draco);
        plain.erase("mode");  // decoded faces are a list, whatever the primitive was before
      }
    }
    if (!expanded_.empty()) reuse_views();
    drop_extension(document_.json, names::gltf::draco);
  }

 private:
  void expand_primitive(const Json& primitive, const std::string& place) {
    const Json& extension = member(member(primitive, "extensions"), names::gltf::draco);
    const std::string where = place + "/extensions/" + names::gltf::draco;
    const int view = index_of(member(extension, "bufferView"));
    const std::unique_ptr<draco::Mesh> mesh = decode(view, where);
    const Json& attributes = member(extension, "attributes");
    if (!attributes.is_object()) reader_.fail(Code::gltf_malformed, where, "no attributes");
    for (const auto& [semantic, id] : attributes.items()) {
      const int accessor = index_of(member(member(primitive, "attributes"), semantic.c_str()));
      const std::string attribute = where + "/attributes/" + semantic;
      if (is_fresh(accessor, view, attribute))
        expand_attribute(*mesh, semantic, index_of(id), accessor, attribute);
    }
    const int indices = index_of(member(primitive, "indices"));
    if (is_fresh(indices, view, place)) expand_indices(*mesh, indices, place + "/indices");
  }

  std::unique_ptr<draco::Mesh> decode(int view, const std::string& place) {
    const std::span<const std::uint8_t> bytes = reader_.bytes(view, place);
    const std::optional<DracoCounts> counts = draco_counts(bytes);
    if (!counts) reader_.fail(Code::file_damaged, place, "Draco: no mesh, or its header is damaged");
    const std::size_t limit = free_elements + elements_per_byte * bytes.size();
    if (counts->faces > limit || counts->points > limit) {
      reader_.fail(Code::file_too_large, place,
                   fmt::format("Draco: {} faces and {} points of {} bytes", counts->faces, counts->points,
                               bytes.size()));
    }
    try {
      draco::DecoderBuffer buffer = buffer_of(bytes);
      auto mesh = draco::Decoder().DecodeMeshFromBuffer(&buffer);
      if (!mesh.ok())
        reader_.fail(Code::file_damaged, place, fmt::format("Draco: {}", mesh.status().error_msg_string()));
      if (mesh.value()->num_points() == 0 || mesh.value()->num_faces() == 0)
        reader_.fail(Code::gltf_malformed, place, "Draco: a mesh without triangles");
      return std::move(mesh).value();
    } catch (const std::exception& error) {
      reader_.fail(Code::file_damaged, place, fmt::format("Draco: {}", error.what()));
    }
  }

  /// Whether the accessor still has to be filled from `view`. Primitives may share accessors and views.
  bool is_fresh(int accessor, int view, const std::string& place) {
    const auto [entry, fresh] = expanded_.emplace(accessor, view);
    if (entry->second != view) {
      reader_.fail(Code::gltf_malformed, place,
                   fmt::format("accessor {} is filled by two Draco meshes", accessor));
    }
    return fresh;
  }

  /// The primitive's attribute `semantic`: a new view behind its accessor.
  void expand_attribute(const draco::Mesh& mesh, const std::string& semantic, int id, int accessor,
                        const std::string& place) {
    AccessorShape shape = reader_.accessor_shape(accessor, place);
    const draco::PointAttribute* attribute =
        id < 0 ? nullptr : mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(id));
    if (attribute == nullptr || attribute->num_components() != shape.components) {
      reader_.fail(Code::gltf_malformed, place,
                   fmt::format("Draco attribute {} is missing or has the wrong number of components", id));
    }
    // Draco would read arbitrary bytes as bool; glTF has no booleans.
    if (attribute->data_type() == draco::DT_BOOL)
      reader_.fail(Code::gltf_malformed, place, fmt::format("Draco attribute {} is boolean", id));
    shape.count = mesh.num_points();
    Bytes elements(shape.count * shape.element_size());
    if (!copy_values(mesh, *attribute, shape.component_type, elements.data()))
      reader_.fail(Code::file_damaged, place, "a Draco value does not fit into its accessor");
    Json json = document_.json["accessors"][accessor];
    std::vector<float> values = to_floats(elements, shape.component_type, false);
    if (shape.component_type == 5126) {
      make_valid(semantic, values, static_cast<std::size_t>(shape.components));
      std::memcpy(elements.data(), values.data(), elements.size());
    }
    if (json.contains("min") || json.contains("max")) set_bounds(json, values, shape.components);
    json.erase("byteOffset");
    json["bufferView"] = append_attribute_view(document_, shape, elements);
    json["count"] = shape.count;
    document_.json["accessors"][accessor] = std::move(json);
  }

  void expand_indices(const draco::Mesh& mesh, int accessor, const std::string& place) {
    reader_.entry("accessors", accessor, place);
    std::vector<std::uint32_t> indices;
    indices.reserve(std::size_t{mesh.num_faces()} * 3);
    for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
      for (const draco::PointIndex& point : mesh.face(draco::FaceIndex(f))) indices.push_back(point.value());
    }
    if (*std::ranges::max_element(indices) >= mesh.num_points())
      reader_.fail(Code::file_damaged, place, "a Draco face refers to a point that is not there");
    append_index_accessor(document_, indices);
    // The primitive keeps the number of its accessor, which gets the new data.
    Json& accessors = document_.json["accessors"];
    Json& old = accessors[accessor];
    for (const char* key : {"bufferView", "componentType", "count", "type"}) old[key] = accessors.back()[key];
    for (const char* key : {"byteOffset", "min", "max"}) old.erase(key);
    accessors.erase(accessors.size() - 1);
  }

  /// Moves new views to the places of the compressed ones, which are unused now: removing those would
  /// renumber the views behind them, to which other extensions may refer.
  void reuse_views() {
    std::set<int> free;
    for (const auto& [accessor, view] : expanded_) free.insert(view);
    Json& views = document_.json["bufferViews"];
    for (const int place : free) {
      const int last = static_cast<int>(views.size()) - 1;
      views[place] = views.back();
      views.erase(static_cast<std::size_t>(last));
      for (const auto& [accessor, view] : expanded_) {
        Json& json = document_.json["accessors"][accessor];
        if (json["bufferView"] == last) json["bufferView"] = place;
      }
    }
  }

  GltfDocument& document_;
  GltfReader reader_;
  std::map<int, int> expanded_;  ///< accessor -> the compressed view that its values came from
};

}  // namespace

std::optional<DracoCounts> draco_counts(std::span<const std::uint8_t> bytes) {
  draco::DecoderBuffer buffer = buffer_of(bytes);
  draco::DracoHeader header{};
  if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok()) return std::nullopt;
  if (header.encoder_type != draco::TRIANGULAR_MESH || header.encoder_method > 1) return std::nullopt;
  const int version = header.version_major * 256 + header.version_minor;
  draco::GeometryMetadata metadata;
  if (version >= 0x103 && (header.flags & METADATA_FLAG_MASK) != 0 &&
      !draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata)) {
    return std::nullopt;
  }
  const bool edgebreaker = header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING;
  const bool packed = version >= (edgebreaker ? 0x200 : 0x202);
  bool good = true;
  const auto count = [&] {
    std::uint64_t value = 0;
    std::uint32_t fixed = 0;
    good = good && (packed ? draco::DecodeVarint(&value, &buffer) : buffer.Decode(&fixed));
    return packed ? value : fixed;
  };
  std::uint8_t traversal = 0;
  if (edgebreaker) good = buffer.Decode(&traversal);
  if (edgebreaker && version < 0x202) count();  // vertices that splits add
  const std::uint64_t first = count();
  const std::uint64_t second = count();
  if (!good) return std::nullopt;
  return edgebreaker ? DracoCounts{second, first} : DracoCounts{first, second};
}

void expand_draco(GltfDocument& document) { Expander(document).expand(); }

}  // namespace selvedge
