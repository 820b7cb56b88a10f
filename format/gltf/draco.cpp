#include "format/gltf/draco.h"

#include <draco/compression/decode.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "format/gltf/draco_header.h"
#include "format/gltf/edit.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

/// A regular mesh takes a bit or two for each face and little more: this is far beyond any real one.
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

/// The primitive's attribute `semantic`: a new view behind its accessor.
Result<void> expand_attribute(GltfDocument& document, const draco::Mesh& mesh, const std::string& semantic,
                              int id, int accessor, const std::string& place) {
  Result<AccessorShape> shape = shape_of(document, accessor, place);
  if (!shape) return tl::unexpected<Error>(std::move(shape.error()));
  const draco::PointAttribute* attribute =
      id < 0 ? nullptr : mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(id));
  if (attribute == nullptr || attribute->num_components() != shape->components) {
    return fail(Code::gltf_malformed, document.file, place,
                fmt::format("Draco attribute {} is missing or has the wrong number of components", id));
  }
  // Any byte may stand where Draco would then read a bool; glTF has none.
  if (attribute->data_type() == draco::DT_BOOL) {
    return fail(Code::gltf_malformed, document.file, place, fmt::format("Draco attribute {} is boolean", id));
  }
  shape->count = mesh.num_points();
  std::vector<std::uint8_t> elements(shape->count * shape->element_size());
  if (!copy_values(mesh, *attribute, shape->component_type, elements.data())) {
    return fail(Code::file_damaged, document.file, place, "a Draco value does not fit into its accessor");
  }
  Json json = document.json["accessors"][accessor];
  std::vector<float> values = to_floats(elements, shape->component_type, false);
  if (shape->component_type == 5126) {
    make_valid(semantic, values, static_cast<std::size_t>(shape->components));
    std::memcpy(elements.data(), values.data(), elements.size());
  }
  if (json.contains("min") || json.contains("max")) set_bounds(json, values, shape->components);
  json.erase("byteOffset");
  json["bufferView"] = append_attribute_view(document, *shape, elements);
  json["count"] = shape->count;
  document.json["accessors"][accessor] = std::move(json);
  return {};
}

Result<void> expand_indices(GltfDocument& document, const draco::Mesh& mesh, int accessor,
                            const std::string& place) {
  const auto json = entry_of(document, "accessors", accessor, place);
  if (!json) return tl::unexpected<Error>(json.error());
  std::vector<std::uint32_t> indices;
  indices.reserve(std::size_t{mesh.num_faces()} * 3);
  for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
    for (const draco::PointIndex& point : mesh.face(draco::FaceIndex(f))) {
      if (point.value() >= mesh.num_points()) {
        return fail(Code::file_damaged, document.file, place,
                    "a Draco face refers to a point that is not there");
      }
      indices.push_back(point.value());
    }
  }
  append_index_accessor(document, indices);
  // The new accessor's data goes behind the old number, which the primitive already has.
  Json& accessors = document.json["accessors"];
  Json& old = accessors[accessor];
  for (const char* key : {"bufferView", "componentType", "count", "type"}) old[key] = accessors.back()[key];
  for (const char* key : {"byteOffset", "min", "max"}) old.erase(key);
  accessors.erase(accessors.size() - 1);
  return {};
}

Result<std::unique_ptr<draco::Mesh>> decode(const GltfDocument& document, int view,
                                            const std::string& place) {
  const auto bytes = bytes_of_view(document, view, place);
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  const std::optional<DracoCounts> counts = draco_counts(*bytes);
  if (!counts)
    return fail(Code::file_damaged, document.file, place, "Draco: no mesh, or its header is damaged");
  if (const std::size_t most = free_elements + elements_per_byte * bytes->size();
      counts->faces > most || counts->points > most) {
    return fail(Code::file_too_large, document.file, place,
                fmt::format("Draco: {} faces and {} points of {} bytes", counts->faces, counts->points,
                            bytes->size()));
  }
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    draco::Decoder decoder;
    auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
    if (!mesh.ok()) {
      return fail(Code::file_damaged, document.file, place,
                  fmt::format("Draco: {}", mesh.status().error_msg_string()));
    }
    std::unique_ptr<draco::Mesh> decoded = std::move(mesh).value();
    if (decoded->num_points() == 0 || decoded->num_faces() == 0) {
      return fail(Code::gltf_malformed, document.file, place, "Draco: a mesh without triangles");
    }
    return decoded;
  } catch (const std::exception& error) {
    return fail(Code::file_damaged, document.file, place, fmt::format("Draco: {}", error.what()));
  }
}

using Expanded = std::map<int, int>;  ///< accessor -> the compressed view that its values came from

/// Whether the accessor still has to be filled from `view`. Primitives may share accessors and views.
Result<bool> is_fresh(const GltfDocument& document, Expanded& expanded, int accessor, int view,
                      const std::string& place) {
  const auto [entry, fresh] = expanded.emplace(accessor, view);
  if (!fresh && entry->second != view) {
    return fail(Code::gltf_malformed, document.file, place,
                fmt::format("accessor {} is filled by two Draco meshes", accessor));
  }
  return fresh;
}

Result<void> expand_primitive(GltfDocument& document, const Json& primitive, const std::string& place,
                              Expanded& expanded) {
  const Json& extension = member(member(primitive, "extensions"), names::gltf::draco);
  const std::string where = place + "/extensions/" + names::gltf::draco;
  const int view = index_of(member(extension, "bufferView"));
  const Result<std::unique_ptr<draco::Mesh>> mesh = decode(document, view, where);
  if (!mesh) return tl::unexpected<Error>(mesh.error());
  const Json& attributes = member(extension, "attributes");
  if (!attributes.is_object()) return fail(Code::gltf_malformed, document.file, where, "no attributes");
  for (const auto& [semantic, id] : attributes.items()) {
    const int accessor = index_of(member(member(primitive, "attributes"), semantic.c_str()));
    const std::string attribute = where + "/attributes/" + semantic;
    const Result<bool> fresh = is_fresh(document, expanded, accessor, view, attribute);
    if (!fresh) return tl::unexpected<Error>(fresh.error());
    if (!*fresh) continue;
    if (Result<void> good = expand_attribute(document, **mesh, semantic, index_of(id), accessor, attribute);
        !good) {
      return good;
    }
  }
  const int indices = index_of(member(primitive, "indices"));
  const Result<bool> fresh = is_fresh(document, expanded, indices, view, place);
  if (!fresh) return tl::unexpected<Error>(fresh.error());
  return *fresh ? expand_indices(document, **mesh, indices, place + "/indices") : Result<void>{};
}

/// Puts new views into the places of the compressed ones, which nothing refers to any more: views cannot be
/// removed, because other extensions may refer to the ones behind them by number.
void reuse_views(GltfDocument& document, const Expanded& expanded) {
  std::set<int> free;
  for (const auto& [accessor, view] : expanded) free.insert(view);
  Json& views = document.json["bufferViews"];
  for (const int place : free) {
    const int last = static_cast<int>(views.size()) - 1;
    views[place] = views.back();
    views.erase(static_cast<std::size_t>(last));
    for (const auto& [accessor, view] : expanded) {
      Json& json = document.json["accessors"][accessor];
      if (json["bufferView"] == last) json["bufferView"] = place;
    }
  }
}

}  // namespace

Result<void> expand_draco(GltfDocument& document) {
  Expanded expanded;
  for (std::size_t m = 0; m < array_of(document.json, "meshes").size(); ++m) {
    const std::size_t primitives = array_of(document.json["meshes"][m], "primitives").size();
    for (std::size_t p = 0; p < primitives; ++p) {
      const Json primitive = document.json["meshes"][m]["primitives"][p];
      if (member(member(primitive, "extensions"), names::gltf::draco).is_null()) continue;
      const std::string place = fmt::format("/meshes/{}/primitives/{}", m, p);
      if (Result<void> good = expand_primitive(document, primitive, place, expanded); !good) return good;
      Json& plain = document.json["meshes"][m]["primitives"][p];
      plain["extensions"].erase(names::gltf::draco);
      if (plain["extensions"].empty()) plain.erase("extensions");
      plain.erase("mode");  // decoded faces are a list, whatever the primitive was before
    }
  }
  if (!expanded.empty()) reuse_views(document, expanded);
  drop_extension(document.json, names::gltf::draco);
  return {};
}

}  // namespace selvedge
