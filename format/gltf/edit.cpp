#include "format/gltf/edit.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

namespace selvedge {
namespace {

template <class T>
std::span<const std::uint8_t> bytes_of(std::span<const T> values) {
  return {reinterpret_cast<const std::uint8_t*>(values.data()), values.size_bytes()};
}

}  // namespace

int append(Json& array, Json entry) {
  array.push_back(std::move(entry));
  return static_cast<int>(array.size()) - 1;
}

int append_view(GltfDocument& document, std::span<const std::uint8_t> bytes, int target, int stride) {
  Json& root = document.json;
  if (document.buffers.empty()) {
    document.buffers.emplace_back();
    root["buffers"] = Json::array({Json::object()});
  }
  Bytes& buffer = document.buffers.back();
  buffer.resize((buffer.size() + 3) / 4 * 4);
  Json view{
      {"buffer", document.buffers.size() - 1}, {"byteOffset", buffer.size()}, {"byteLength", bytes.size()}};
  if (stride > 0) view["byteStride"] = stride;
  if (target > 0) view["target"] = target;
  buffer.insert(buffer.end(), bytes.begin(), bytes.end());
  root["buffers"].back()["byteLength"] = buffer.size();
  return append(root["bufferViews"], std::move(view));
}

int append_attribute_view(GltfDocument& document, const AccessorShape& shape,
                          std::span<const std::uint8_t> elements) {
  const std::size_t size = shape.element_size();
  const std::size_t stride = (size + 3) / 4 * 4;
  if (stride == size) return append_view(document, elements, 34962);
  Bytes rows(shape.count * stride);
  for (std::size_t i = 0; i < shape.count; ++i)
    std::memcpy(rows.data() + i * stride, elements.data() + i * size, size);
  return append_view(document, rows, 34962, static_cast<int>(stride));
}

void drop_attribute(Json& primitive, const char* semantic) {
  primitive["attributes"].erase(semantic);
  if (!primitive.contains("targets")) return;
  for (Json& target : primitive["targets"]) target.erase(semantic);
}

void set_bounds(Json& accessor, std::span<const float> values, int components) {
  const auto n = static_cast<std::size_t>(components);
  std::vector<float> low(n, std::numeric_limits<float>::max());
  std::vector<float> high(n, std::numeric_limits<float>::lowest());
  for (std::size_t i = 0; i < values.size(); ++i) {
    low[i % n] = std::min(low[i % n], values[i]);
    high[i % n] = std::max(high[i % n], values[i]);
  }
  // In double, a float's exact value is written; as a float the JSON would hold a rounded one.
  accessor["min"] = std::vector<double>(low.begin(), low.end());
  accessor["max"] = std::vector<double>(high.begin(), high.end());
}

int append_float_accessor(GltfDocument& document, std::span<const float> values, int components,
                          bool bounds) {
  constexpr std::array<const char*, 5> types{"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  Json accessor{{"bufferView", append_view(document, bytes_of(values), 34962)},
                {"componentType", 5126},
                {"count", values.size() / static_cast<std::size_t>(components)},
                {"type", types[components]}};
  if (bounds) set_bounds(accessor, values, components);
  return append(document.json["accessors"], std::move(accessor));
}

int append_index_accessor(GltfDocument& document, std::span<const std::uint32_t> indices) {
  // 65535 itself is glTF's primitive restart value.
  const bool is_short = std::ranges::all_of(indices, [](std::uint32_t index) { return index < 65535; });
  std::vector<std::uint16_t> shorter;
  if (is_short)
    std::ranges::transform(indices, std::back_inserter(shorter),
                           [](std::uint32_t i) { return static_cast<std::uint16_t>(i); });
  const auto bytes = is_short ? bytes_of(std::span<const std::uint16_t>(shorter)) : bytes_of(indices);
  const int view = append_view(document, bytes, 34963);
  return append(document.json["accessors"], Json{{"bufferView", view},
                                                 {"componentType", is_short ? 5123 : 5125},
                                                 {"count", indices.size()},
                                                 {"type", "SCALAR"}});
}

void list_extension(Json& root, const char* name) {
  Json& used = root["extensionsUsed"];
  if (std::ranges::find(used, name) == used.end()) used.push_back(name);
}

void require_extension(Json& root, const char* name) {
  list_extension(root, name);
  Json& required = root["extensionsRequired"];
  if (std::ranges::find(required, name) == required.end()) required.push_back(name);
}

void unlist_extension(Json& root, const char* name) {
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
    if (!member(root, list).is_array()) continue;
    Json& names = root[list];
    names.erase(std::remove(names.begin(), names.end(), name), names.end());
    if (names.empty()) root.erase(list);
  }
}

void unlist_encoding(GltfDocument& document, const char* name) {
  const Json& required = array_member(document.json, "extensionsRequired");
  if (std::ranges::find(required, name) != required.end())
    document.original_encoding.required_extensions.insert(name);
  unlist_extension(document.json, name);
}

void relist_encoding(GltfDocument& document, const char* name) {
  const bool was_required = document.original_encoding.required_extensions.contains(name);
  (was_required ? require_extension : list_extension)(document.json, name);
}

BufferPosition view_position(const Json& view) {
  return {whole_number(member(view, "buffer")).value_or(0),
          whole_number(member(view, "byteOffset")).value_or(0)};
}

void erase_extension(Json& object, const char* name) {
  object["extensions"].erase(name);
  if (object["extensions"].empty()) object.erase("extensions");
}

}  // namespace selvedge
