#include "format/gltf/draco.h"

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
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
#include "format/gltf/geometry.h"
#include "format/gltf/names.h"
#include "format/gltf/unused_parts.h"

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

/// The decoded elements of an attribute, and in `accessor` their number and bounds; nothing if a value does
/// not fit.
std::optional<Bytes> take_values(const draco::Mesh& mesh, const draco::PointAttribute& attribute,
                                 const std::string& semantic, const AccessorShape& shape, Json& accessor) {
  Bytes elements(mesh.num_points() * shape.element_size());
  if (!copy_values(mesh, attribute, shape.component_type, elements.data())) return std::nullopt;
  std::vector<float> values = to_floats(elements, shape.component_type, false);
  if (shape.component_type == 5126) {
    make_valid(semantic, values, static_cast<std::size_t>(shape.components));
    std::memcpy(elements.data(), values.data(), elements.size());
  }
  if (accessor.contains("min") || accessor.contains("max")) set_bounds(accessor, values, shape.components);
  accessor["count"] = mesh.num_points();
  return elements;
}

class Expander {
 public:
  explicit Expander(GltfDocument& document) : document_(document), reader_(document) {}

  void expand() {
    for (std::size_t m = 0; m < array_member(document_.json, "meshes").size(); ++m) {
      const std::size_t primitives = array_member(document_.json["meshes"][m], "primitives").size();
      for (std::size_t p = 0; p < primitives; ++p) {
        Json primitive = document_.json["meshes"][m]["primitives"][p];
        if (member(member(primitive, "extensions"), names::gltf::draco).is_null()) continue;
        expand_primitive(primitive, fmt::format("/meshes/{}/primitives/{}", m, p));
        erase_extension(primitive, names::gltf::draco);
        // Decoded faces are a list, whatever the primitive was before.
        if (member(primitive, "mode") != 4) primitive.erase("mode");
        document_.json["meshes"][m]["primitives"][p] = std::move(primitive);
      }
    }
    if (!expanded_.empty()) reuse_views();
    unlist_encoding(document_, names::gltf::draco);
    // Without that, the former views of the accessors were plain ones.
    if (!document_.original_encoding.required_extensions.contains(names::gltf::draco))
      document_.original_encoding.draco_accessors.clear();
  }

 private:
  void expand_primitive(Json& primitive, const std::string& place) {
    const Json& extension = member(member(primitive, "extensions"), names::gltf::draco);
    const std::string where = place + "/extensions/" + names::gltf::draco;
    const int view = index_of(member(extension, "bufferView"));
    const std::unique_ptr<draco::Mesh> mesh = decode(view, where);
    const Json& attributes = member(extension, "attributes");
    if (!attributes.is_object()) reader_.fail(Code::gltf_malformed, where, "no attributes");
    for (const auto& [semantic, id] : attributes.items()) {
      int accessor = index_of(member(member(primitive, "attributes"), semantic.c_str()));
      const std::string attribute = where + "/attributes/" + semantic;
      if (is_fresh(accessor, view, attribute))
        expand_attribute(*mesh, view, semantic, index_of(id), accessor, attribute);
      primitive["attributes"][semantic] = accessor;
    }
    int indices = index_of(member(primitive, "indices"));
    if (is_fresh(indices, view, place)) expand_indices(*mesh, view, indices, place + "/indices");
    primitive["indices"] = indices;
  }

  std::unique_ptr<draco::Mesh> decode(int view, const std::string& place) {
    const std::span<const std::uint8_t> bytes = reader_.view_bytes(view, place);
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

  /// Whether the accessor still has to be filled from `view`. Primitives may share accessors and views; the
  /// values of a second view get an accessor of their own, as Blender writes one for equal lists of indices.
  bool is_fresh(int& accessor, int view, const std::string& place) {
    const auto [entry, fresh] = expanded_.try_emplace({accessor, view}, accessor);
    if (fresh) {
      const auto [former, alone] = former_.try_emplace(accessor, reader_.entry("accessors", accessor, place));
      if (!alone) entry->second = append(document_.json["accessors"], former->second);
    }
    accessor = entry->second;
    return fresh;
  }

  /// The primitive's attribute `semantic`: a new view behind its accessor.
  void expand_attribute(const draco::Mesh& mesh, int view, const std::string& semantic, int id, int accessor,
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
    Json json = document_.json["accessors"][accessor];
    const std::optional<Bytes> elements = take_values(mesh, *attribute, semantic, shape, json);
    if (!elements) reader_.fail(Code::file_damaged, place, "a Draco value does not fit into its accessor");
    json.erase("byteOffset");
    json["bufferView"] = append_attribute_view(document_, shape, *elements);
    std::swap(document_.json["accessors"][accessor], json);
    keep(std::move(json), accessor, view, id);
  }

  /// Keeps what an accessor was before its new view; `view` has the stream.
  void keep(Json former, int accessor, int view, int id) {
    for (const char* key : {"bufferView", "byteOffset"}) former.erase(key);
    const Json& views = document_.json["bufferViews"];
    const Json& expanded = views[index_of(document_.json["accessors"][accessor]["bufferView"])];
    document_.original_encoding.draco_accessors[view_position(expanded)] = {std::move(former), views[view],
                                                                            id};
  }

  void expand_indices(const draco::Mesh& mesh, int view, int accessor, const std::string& place) {
    Json former = reader_.entry("accessors", accessor, place);
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
    keep(std::move(former), accessor, view, -1);
  }

  /// Moves new views to the places of the compressed ones, which are unused now: removing those would
  /// renumber the views behind them, to which other extensions may refer.
  void reuse_views() {
    std::set<int> free;
    for (const auto& [filled, accessor] : expanded_) free.insert(filled.second);
    Json& views = document_.json["bufferViews"];
    for (const int place : free) {
      const int last = static_cast<int>(views.size()) - 1;
      views[place] = views.back();
      views.erase(static_cast<std::size_t>(last));
      for (const auto& [filled, accessor] : expanded_) {
        Json& json = document_.json["accessors"][accessor];
        if (json["bufferView"] == last) json["bufferView"] = place;
      }
    }
  }

  GltfDocument& document_;
  GltfReader reader_;
  /// The accessor of the file and the compressed view -> the accessor with the values of that view.
  std::map<std::pair<int, int>, int> expanded_;
  std::map<int, Json> former_;  ///< the accessors of the file
};

using DracoAccessor = OriginalEncoding::DracoAccessor;

/// Bits with which a step of texture coordinates is 2^-17, be they metres, as unwrapped ones, or over a range
/// of 1: the texels of a fabric need 2^-15 (spec/SELVEDGE_materials_fabric, "Implementation notes"), and
/// small triangles keep their directions.
int texture_bits(std::span<const float> values) {
  std::array<float, 2> low{values[0], values[1]};
  std::array<float, 2> high = low;
  for (std::size_t i = 0; i < values.size(); ++i) {
    low[i % 2] = std::min(low[i % 2], values[i]);
    high[i % 2] = std::max(high[i % 2], values[i]);
  }
  const double range = std::max(high[0] - low[0], high[1] - low[1]);
  return std::clamp(
      17 + (range > 0 && std::isfinite(range) ? static_cast<int>(std::ceil(std::log2(range))) : 0), 1, 30);
}

/// Bits of an attribute of floats; 0: its floats as they are.
int bits_of(const std::string& semantic, std::span<const float> values) {
  if (semantic.starts_with("TEXCOORD_")) return texture_bits(values);
  if (semantic == "POSITION") return 14;
  if (semantic == "NORMAL" || semantic.starts_with("COLOR_")) return 10;
  return semantic == "TANGENT" || semantic.starts_with("WEIGHTS_") ? 12 : 0;
}

draco::GeometryAttribute::Type type_of(const std::string& semantic) {
  if (semantic == "POSITION") return draco::GeometryAttribute::POSITION;
  if (semantic == "NORMAL") return draco::GeometryAttribute::NORMAL;
  if (semantic.starts_with("COLOR_")) return draco::GeometryAttribute::COLOR;
  if (semantic.starts_with("TEXCOORD_")) return draco::GeometryAttribute::TEX_COORD;
  return draco::GeometryAttribute::GENERIC;
}

class Packer {
 public:
  explicit Packer(GltfDocument& document)
      : document_(document), reader_(document), before_(used_parts(document)) {}

  void pack() {
    each_primitive([&](Json& primitive, const std::string& place) {
      if (Json extension = former_extension(primitive); !extension.is_null())
        extensions_.emplace(place, std::move(extension));
      else if (!is_new(primitive) || !encode(primitive, place))
        each_accessor(primitive, [&](const Json& accessor) { plain_.insert(index_of(accessor)); });
    });
    each_primitive([&](Json& primitive, const std::string& place) {
      const auto found = extensions_.find(place);
      if (found == extensions_.end()) return;
      primitive["extensions"][names::gltf::draco] = found->second;
      for (const auto& [semantic, id] : found->second["attributes"].items())
        restore(primitive["attributes"][semantic]);
      restore(primitive["indices"]);
    });
    if (extensions_.empty() && !encoded_) return;
    name_streams();
    drop_unused_data(document_, before_);
    relist_encoding(document_, names::gltf::draco);
  }

 private:
  template <class F>
  void each_primitive(const F& visit) {
    for (std::size_t m = 0; m < array_member(document_.json, "meshes").size(); ++m) {
      for (std::size_t p = 0; p < array_member(document_.json["meshes"][m], "primitives").size(); ++p)
        visit(document_.json["meshes"][m]["primitives"][p], fmt::format("/meshes/{}/primitives/{}", m, p));
    }
  }

  template <class F>
  static void each_accessor(const Json& primitive, const F& visit) {
    for (const Json& accessor : member(primitive, "attributes")) visit(accessor);
    visit(member(primitive, "indices"));
  }

  BufferPosition place_behind(const Json& accessor) const {
    const Json& json = root_entry(document_, "accessors", index_of(accessor));
    return view_position(root_entry(document_, "bufferViews", index_of(member(json, "bufferView"))));
  }

  const DracoAccessor* former(const BufferPosition& place) const {
    const auto found = document_.original_encoding.draco_accessors.find(place);
    return found == document_.original_encoding.draco_accessors.end() ? nullptr : &found->second;
  }

  bool is_new(const Json& primitive) const {
    bool found = false;
    each_accessor(primitive, [&](const Json& accessor) {
      found |= place_behind(accessor) >= document_.original_encoding.known_end;
    });
    return found;
  }

  /// The extension of a primitive with vertices and indices of one stream, whose view stands as a whole in
  /// the place of its number; null for others.
  Json former_extension(const Json& primitive) const {
    const DracoAccessor* const indices = former(place_behind(member(primitive, "indices")));
    if (indices == nullptr || is_new(primitive)) return nullptr;
    Json attributes = Json::object();
    for (const auto& [semantic, accessor] : member(primitive, "attributes").items()) {
      const DracoAccessor* const attribute = former(place_behind(accessor));
      if (attribute == nullptr) continue;
      if (attribute->view != indices->view) return nullptr;
      attributes[semantic] = attribute->attribute_id;
    }
    return {{"bufferView", indices->view}, {"attributes", std::move(attributes)}};
  }

  /// Gives an accessor its former JSON; if plain primitives need it as it is, a new one gets that.
  void restore(Json& number) {
    const int expanded = index_of(number);
    if (const auto [entry, fresh] = restored_.try_emplace(expanded, expanded); fresh) {
      const DracoAccessor* const was = former(place_behind(number));
      if (plain_.contains(expanded))
        entry->second = append(document_.json["accessors"], was->json);
      else
        document_.json["accessors"][expanded] = was->json;
    }
    number = restored_.at(expanded);
  }

  /// Puts the streams into places that expanded views have left, the first ones of which were theirs.
  void name_streams() {
    const std::set<int> used = used_parts(document_).views;
    Json& views = document_.json["bufferViews"];
    std::map<BufferPosition, int> numbers;
    for (int i = 0; i < static_cast<int>(views.size()); ++i) {
      const DracoAccessor* const was = former(view_position(views[i]));
      if (was == nullptr || used.contains(i)) continue;
      if (numbers.try_emplace(view_position(was->view), i).second) views[i] = was->view;
    }
    each_primitive([&](Json& primitive, const std::string& place) {
      if (!extensions_.contains(place)) return;
      Json& view = primitive["extensions"][names::gltf::draco]["bufferView"];
      const auto [number, missing] = numbers.try_emplace(view_position(view), -1);
      if (missing) number->second = append(views, view);
      view = number->second;
    });
  }

  /// Makes a stream of a primitive; false if Draco cannot.
  bool encode(Json& primitive, const std::string& place) {
    const Json attributes = member(primitive, "attributes");
    const std::size_t count = reader_.accessor_shape(index_of(member(attributes, "POSITION")), place).count;
    draco::Mesh mesh;
    mesh.set_num_points(static_cast<std::uint32_t>(count));
    std::map<int, int> bits;
    for (const auto& [semantic, accessor] : attributes.items()) {
      const AccessorShape shape = reader_.accessor_shape(index_of(accessor), place);
      if (shape.count != count) return false;
      const Bytes elements = reader_.elements(index_of(accessor), place);
      const int id = add(mesh, semantic, shape, elements);
      if (shape.component_type == 5126)
        bits[id] = bits_of(semantic, to_floats(elements, shape.component_type, false));
    }
    const std::vector<std::uint32_t> triangles = read_triangles(reader_, primitive, place, count);
    for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
      mesh.AddFace({draco::PointIndex(triangles[t]), draco::PointIndex(triangles[t + 1]),
                    draco::PointIndex(triangles[t + 2])});
    }
    const bool ordered = primitive.contains("targets");  // which are no part of the stream
    if (!ordered) {
      mesh.DeduplicateAttributeValues();
      mesh.DeduplicatePointIds();
    }
    draco::ExpertEncoder encoder(mesh);
    encoder.SetEncodingMethod(ordered ? draco::MESH_SEQUENTIAL_ENCODING : draco::MESH_EDGEBREAKER_ENCODING);
    for (const auto& [id, number] : bits)
      if (number > 0) encoder.SetAttributeQuantization(id, number);
    draco::EncoderBuffer buffer;
    if (!encoder.EncodeToBuffer(&buffer).ok()) return false;
    const std::span<const std::uint8_t> stream(reinterpret_cast<const std::uint8_t*>(buffer.data()),
                                               buffer.size());
    draco::DecoderBuffer input = buffer_of(stream);
    const auto decoded = draco::Decoder().DecodeMeshFromBuffer(&input);
    if (!decoded.ok()) return false;
    name(primitive, *decoded.value(), stream);
    return true;
  }

  static int add(draco::Mesh& mesh, const std::string& semantic, const AccessorShape& shape,
                 const Bytes& elements) {
    constexpr std::array<draco::DataType, 7> types{draco::DT_INT8,   draco::DT_UINT8,   draco::DT_INT16,
                                                   draco::DT_UINT16, draco::DT_INVALID, draco::DT_UINT32,
                                                   draco::DT_FLOAT32};
    const std::size_t size = shape.element_size();
    draco::GeometryAttribute description;
    description.Init(type_of(semantic), nullptr, static_cast<std::int8_t>(shape.components),
                     types.at(shape.component_type - 5120), shape.normalized, static_cast<std::int64_t>(size),
                     0);
    const int id = mesh.AddAttribute(description, true, static_cast<std::uint32_t>(shape.count));
    for (std::size_t i = 0; i < shape.count; ++i) {
      mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(static_cast<std::uint32_t>(i)),
                                            elements.data() + i * size);
    }
    return id;
  }

  /// Gives a primitive its stream and accessors without bytes.
  void name(Json& primitive, const draco::Mesh& mesh, std::span<const std::uint8_t> stream) {
    Json& accessors = document_.json["accessors"];
    Json ids = Json::object();
    int id = 0;
    for (auto& [semantic, number] : primitive["attributes"].items()) {
      const AccessorShape shape = reader_.accessor_shape(index_of(number), "");
      Json accessor = accessors[index_of(number)];
      for (const char* key : {"bufferView", "byteOffset", "sparse"}) accessor.erase(key);
      take_values(mesh, *mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(id)), semantic, shape,
                  accessor);
      ids[semantic] = id++;
      number = append(accessors, std::move(accessor));
    }
    primitive["indices"] = append(accessors, {{"componentType", mesh.num_points() < 65536 ? 5123 : 5125},
                                              {"count", std::size_t{mesh.num_faces()} * 3},
                                              {"type", "SCALAR"}});
    primitive.erase("mode");
    primitive["extensions"][names::gltf::draco] = {{"bufferView", append_view(document_, stream)},
                                                   {"attributes", std::move(ids)}};
    encoded_ = true;
  }

  GltfDocument& document_;
  GltfReader reader_;
  UsedParts before_;
  std::map<std::string, Json> extensions_;  ///< by the place of the primitive
  std::set<int> plain_;                     ///< accessors that primitives need with their bytes
  std::map<int, int> restored_;             ///< accessors -> accessors of streams
  bool encoded_ = false;
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

void repack_draco(GltfDocument& document) {
  if (!document.original_encoding.draco_accessors.empty()) Packer(document).pack();
}

}  // namespace selvedge
