#include "format/gltf/draco.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "format/gltf/draco_stream.h"
#include "format/gltf/edit.h"
#include "format/gltf/geometry.h"
#include "format/gltf/names.h"
#include "format/gltf/unused_parts.h"

namespace selvedge {
namespace {

/// Limits far beyond real meshes, which take a bit or two for each face and little more.
constexpr std::size_t free_elements = std::size_t{1} << 16;
constexpr std::size_t elements_per_byte = 64;

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
std::optional<Bytes> take_values(const DracoMesh& mesh, int id, const std::string& semantic,
                                 const AccessorShape& shape, Json& accessor) {
  std::optional<Bytes> elements = mesh.values(id, shape.component_type);
  if (!elements) return std::nullopt;
  std::vector<float> values = to_floats(*elements, shape.component_type, false);
  if (shape.component_type == 5126) {
    make_valid(semantic, values, static_cast<std::size_t>(shape.components));
    std::memcpy(elements->data(), values.data(), elements->size());
  }
  if (accessor.contains("min") || accessor.contains("max")) set_bounds(accessor, values, shape.components);
  accessor["count"] = mesh.points();
  return elements;
}

/// The header of a stream; what lies behind the end is 0.
struct StreamReader {
  std::span<const std::uint8_t> bytes;
  bool is_good = true;

  void skip(std::uint64_t count) {
    is_good = is_good && count <= bytes.size();
    bytes = is_good ? bytes.subspan(static_cast<std::size_t>(count)) : std::span<const std::uint8_t>();
  }
  std::uint64_t number(std::size_t size) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < std::min(size, bytes.size()); ++i) value |= std::uint64_t{bytes[i]} << 8 * i;
    skip(size);
    return value;
  }
  std::uint64_t packed() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const std::uint64_t part = number(1);
      value |= (part & 0x7F) << shift;
      if (part < 0x80) return value;
    }
    is_good = false;
    return 0;
  }
  /// Entries, and parts that have a name and their own, one after the other.
  void skip_metadata() {
    for (std::uint64_t parts = 1; parts > 0 && is_good; --parts) {
      for (std::uint64_t entries = packed(); entries > 0 && is_good; --entries) {
        skip(number(1));
        skip(packed());
      }
      parts += packed();
      if (parts > 1) skip(number(1));
    }
  }
};

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
    const DracoMesh mesh = decode(view, where);
    const Json& attributes = member(extension, "attributes");
    if (!attributes.is_object()) reader_.fail(Code::gltf_malformed, where, "no attributes");
    for (const auto& [semantic, id] : attributes.items()) {
      int accessor = index_of(member(member(primitive, "attributes"), semantic.c_str()));
      const std::string attribute = where + "/attributes/" + semantic;
      if (is_fresh(accessor, view, attribute))
        expand_attribute(mesh, view, semantic, index_of(id), accessor, attribute);
      primitive["attributes"][semantic] = accessor;
    }
    int indices = index_of(member(primitive, "indices"));
    if (is_fresh(indices, view, place)) expand_indices(mesh, view, indices, place + "/indices");
    primitive["indices"] = indices;
  }

  DracoMesh decode(int view, const std::string& place) {
    const std::span<const std::uint8_t> bytes = reader_.view_bytes(view, place);
    const std::optional<DracoCounts> counts = draco_counts(bytes);
    if (!counts) reader_.fail(Code::file_damaged, place, "Draco: no mesh, or its header is damaged");
    const std::size_t limit = free_elements + elements_per_byte * bytes.size();
    if (counts->faces > limit || counts->points > limit)
      reader_.fail(Code::file_too_large, place,
                   fmt::format("Draco: {} faces and {} points of {} bytes", counts->faces, counts->points,
                               bytes.size()));
    Result<DracoMesh> mesh = DracoMesh::decode(bytes);
    if (!mesh) reader_.fail(Code::file_damaged, place, "Draco: " + mesh.error().message);
    if (mesh->points() == 0 || mesh->indices().empty())
      reader_.fail(Code::gltf_malformed, place, "Draco: a mesh without triangles");
    return std::move(*mesh);
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
  void expand_attribute(const DracoMesh& mesh, int view, const std::string& semantic, int id, int accessor,
                        const std::string& place) {
    AccessorShape shape = reader_.accessor_shape(accessor, place);
    if (mesh.components(id) != shape.components)
      reader_.fail(
          Code::gltf_malformed, place,
          fmt::format("Draco attribute {} is missing, boolean, or has the wrong number of components", id));
    shape.count = mesh.points();
    Json json = document_.json["accessors"][accessor];
    const std::optional<Bytes> elements = take_values(mesh, id, semantic, shape, json);
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

  void expand_indices(const DracoMesh& mesh, int view, int accessor, const std::string& place) {
    Json former = reader_.entry("accessors", accessor, place);
    const std::vector<std::uint32_t>& indices = mesh.indices();
    if (*std::ranges::max_element(indices) >= mesh.points())
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
    for (std::size_t m = 0; m < array_member(document_.json, "meshes").size(); ++m)
      for (std::size_t p = 0; p < array_member(document_.json["meshes"][m], "primitives").size(); ++p)
        visit(document_.json["meshes"][m]["primitives"][p], fmt::format("/meshes/{}/primitives/{}", m, p));
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
    std::vector<DracoAttribute> streamed;
    for (const auto& [semantic, accessor] : attributes.items()) {
      const AccessorShape shape = reader_.accessor_shape(index_of(accessor), place);
      if (shape.count != count) return false;
      DracoAttribute& attribute =
          streamed.emplace_back(DracoAttribute{semantic, shape, reader_.elements(index_of(accessor), place)});
      if (shape.component_type == 5126)
        attribute.bits = bits_of(semantic, to_floats(attribute.elements, shape.component_type, false));
    }
    const bool is_ordered = primitive.contains("targets");  // which are no part of the stream
    const std::optional<Bytes> stream =
        encode_draco(streamed, read_triangles(reader_, primitive, place, count), is_ordered);
    const Result<DracoMesh> decoded = DracoMesh::decode(stream.value_or(Bytes()));
    if (!decoded) return document_.remarks.push_back(place + ": written without Draco"), false;
    name(primitive, *decoded, *stream);
    return true;
  }

  /// Gives a primitive its stream and accessors without bytes.
  void name(Json& primitive, const DracoMesh& mesh, std::span<const std::uint8_t> stream) {
    Json& accessors = document_.json["accessors"];
    Json ids = Json::object();
    int id = 0;
    for (auto& [semantic, number] : primitive["attributes"].items()) {
      const AccessorShape shape = reader_.accessor_shape(index_of(number), "");
      Json accessor = accessors[index_of(number)];
      for (const char* key : {"bufferView", "byteOffset", "sparse"}) accessor.erase(key);
      take_values(mesh, id, semantic, shape, accessor);
      ids[semantic] = id++;
      number = append(accessors, std::move(accessor));
    }
    primitive["indices"] = append(accessors, {{"componentType", mesh.points() < 65536 ? 5123 : 5125},
                                              {"count", mesh.indices().size()},
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
  StreamReader in{bytes};
  constexpr std::string_view magic = "DRACO";
  for (const char c : magic)
    if (in.number(1) != static_cast<std::uint8_t>(c)) return std::nullopt;
  const std::uint64_t major = in.number(1);
  const std::uint64_t version = major * 256 + in.number(1);
  const std::uint64_t kind = in.number(1);
  const std::uint64_t method = in.number(1);
  const std::uint64_t flags = in.number(2);
  if (kind != 1 || method > 1) return std::nullopt;  // no mesh
  if (version >= 0x103 && (flags & 0x8000) != 0) {
    for (std::uint64_t attributes = in.packed(); attributes > 0 && in.is_good; --attributes) {
      in.packed();
      in.skip_metadata();
    }
    in.skip_metadata();
  }
  const bool edgebreaker = method == 1;
  const bool packed = version >= (edgebreaker ? 0x200 : 0x202);
  const auto count = [&] { return packed ? in.packed() : in.number(4); };
  if (edgebreaker) in.number(1);                // how it is traversed
  if (edgebreaker && version < 0x202) count();  // vertices that splits add
  const std::uint64_t first = count();
  const std::uint64_t second = count();
  if (!in.is_good) return std::nullopt;
  return edgebreaker ? DracoCounts{second, first} : DracoCounts{first, second};
}

void expand_draco(GltfDocument& document) { Expander(document).expand(); }

void repack_draco(GltfDocument& document) {
  if (!document.original_encoding.draco_accessors.empty()) Packer(document).pack();
}

}  // namespace selvedge
