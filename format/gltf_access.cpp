#include "format/gltf_access.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace selvedge {
namespace {

/// Without data behind it (sparse accessors) an element costs a file nothing: a limit of our own.
constexpr std::size_t largest_zero_filled = std::size_t{1} << 24;

std::string at(const char* array, int index) { return fmt::format("/{}/{}", array, index); }

std::size_t offset_of(const Json& object, const char* key) {
  return size_of(member(object, key)).value_or(0);
}

int components_of(const std::string& type) {
  constexpr std::array<std::pair<std::string_view, int>, 7> table{
      {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}}};
  for (const auto& [name, components] : table) {
    if (name == type) return components;
  }
  return 0;
}

/// Copies `count` elements of `size` bytes out of a view, with every bound checked.
Result<void> gather(const GltfDocument& document, int view, std::size_t offset, std::size_t count,
                    std::size_t size, const std::string& place, std::uint8_t* out) {
  const auto bytes = bytes_of_view(document, view, place);
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  const Json& json = document.json["bufferViews"][static_cast<std::size_t>(view)];
  std::size_t stride = offset_of(json, "byteStride");
  if (stride == 0) stride = size;
  if (stride < size || stride > 252) {
    return fail(Code::gltf_malformed, document.file, at("bufferViews", view),
                fmt::format("byteStride {} for elements of {} bytes", stride, size));
  }
  if (count > 0 && (offset > bytes->size() || size > bytes->size() - offset ||
                    count - 1 > (bytes->size() - offset - size) / stride)) {
    return fail(Code::gltf_malformed, document.file, place,
                fmt::format("{} elements reach beyond buffer view {}", count, view));
  }
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(out + i * size, bytes->data() + offset + i * stride, size);
  }
  return {};
}

template <class T>
T load(const std::uint8_t* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

std::uint32_t unsigned_at(const std::uint8_t* bytes, int component_type) {
  if (component_type == 5121) return *bytes;
  if (component_type == 5123) return load<std::uint16_t>(bytes);
  return load<std::uint32_t>(bytes);
}

float float_at(const std::uint8_t* bytes, int component_type, bool normalized) {
  switch (component_type) {
    case 5120: {
      const auto value = static_cast<float>(load<std::int8_t>(bytes));
      return normalized ? std::max(value / 127.0F, -1.0F) : value;
    }
    case 5121: {
      const auto value = static_cast<float>(*bytes);
      return normalized ? value / 255.0F : value;
    }
    case 5122: {
      const auto value = static_cast<float>(load<std::int16_t>(bytes));
      return normalized ? std::max(value / 32767.0F, -1.0F) : value;
    }
    case 5123: {
      const auto value = static_cast<float>(load<std::uint16_t>(bytes));
      return normalized ? value / 65535.0F : value;
    }
    case 5125:
      return static_cast<float>(load<std::uint32_t>(bytes));
    default:
      return load<float>(bytes);
  }
}

Result<void> apply_sparse(const GltfDocument& document, const Json& sparse, const AccessorShape& shape,
                          const std::string& place, std::vector<std::uint8_t>& elements) {
  const std::string where = place + "/sparse";
  const std::optional<std::size_t> count = size_of(member(sparse, "count"));
  const Json& indices = member(sparse, "indices");
  const Json& values = member(sparse, "values");
  const int type = index_of(member(indices, "componentType"));
  if (!count || *count > shape.count || (type != 5121 && type != 5123 && type != 5125)) {
    return fail(Code::gltf_malformed, document.file, where, "wrong count or component type");
  }
  const std::size_t size = component_size(shape.component_type) * static_cast<std::size_t>(shape.components);
  const std::size_t index_size = component_size(type);
  std::vector<std::uint8_t> targets(*count * index_size);
  std::vector<std::uint8_t> replacements(*count * size);
  if (Result<void> good = gather(document, index_of(member(indices, "bufferView")),
                                 offset_of(indices, "byteOffset"), *count, index_size, where, targets.data());
      !good) {
    return good;
  }
  if (Result<void> good = gather(document, index_of(member(values, "bufferView")),
                                 offset_of(values, "byteOffset"), *count, size, where, replacements.data());
      !good) {
    return good;
  }
  for (std::size_t i = 0; i < *count; ++i) {
    const std::size_t target = unsigned_at(targets.data() + i * index_size, type);
    if (target >= shape.count) {
      return fail(Code::gltf_malformed, document.file, where,
                  fmt::format("index {} is out of range", target));
    }
    std::memcpy(elements.data() + target * size, replacements.data() + i * size, size);
  }
  return {};
}

void append_padding(std::vector<std::uint8_t>& buffer) { buffer.resize((buffer.size() + 3) / 4 * 4); }

}  // namespace

const Json& member(const Json& object, const char* key) {
  static const Json null;
  if (!object.is_object()) return null;
  const auto found = object.find(key);
  return found == object.end() ? null : *found;
}

std::optional<std::size_t> size_of(const Json& value) {
  constexpr double largest = 0x1p40;
  if (!value.is_number()) return std::nullopt;
  const double number = value.get<double>();
  if (!(number >= 0) || number > largest || number != std::floor(number)) return std::nullopt;
  return static_cast<std::size_t>(number);
}

int index_of(const Json& value) {
  const std::optional<std::size_t> size = size_of(value);
  return size && *size <= static_cast<std::size_t>(std::numeric_limits<int>::max()) ? static_cast<int>(*size)
                                                                                    : -1;
}

double number_of(const Json& value, double otherwise) {
  return value.is_number() ? value.get<double>() : otherwise;
}

Result<const Json*> entry_of(const GltfDocument& document, const char* array, int index,
                             const std::string& place) {
  const Json& entries = member(document.json, array);
  if (!entries.is_array() || index < 0 || static_cast<std::size_t>(index) >= entries.size() ||
      !entries[static_cast<std::size_t>(index)].is_object()) {
    return fail(Code::gltf_malformed, document.file, place, fmt::format("there is no {}", at(array, index)));
  }
  return &entries[static_cast<std::size_t>(index)];
}

Result<std::span<const std::uint8_t>> bytes_of_view(const GltfDocument& document, int view,
                                                    const std::string& place) {
  const auto json = entry_of(document, "bufferViews", view, place);
  if (!json) return tl::unexpected<Error>(json.error());
  const int buffer = index_of(member(**json, "buffer"));
  const std::size_t offset = offset_of(**json, "byteOffset");
  const std::optional<std::size_t> length = size_of(member(**json, "byteLength"));
  if (buffer < 0 || static_cast<std::size_t>(buffer) >= document.buffers.size() || !length) {
    return fail(Code::gltf_malformed, document.file, at("bufferViews", view), "no buffer or no byteLength");
  }
  const std::vector<std::uint8_t>& bytes = document.buffers[static_cast<std::size_t>(buffer)];
  if (offset > bytes.size() || *length > bytes.size() - offset) {
    return fail(Code::gltf_malformed, document.file, at("bufferViews", view),
                fmt::format("bytes {} to {} of a buffer of {}", offset, offset + *length, bytes.size()));
  }
  return std::span<const std::uint8_t>(bytes).subspan(offset, *length);
}

std::size_t component_size(int component_type) {
  switch (component_type) {
    case 5120:
    case 5121:
      return 1;
    case 5122:
    case 5123:
      return 2;
    case 5125:
    case 5126:
      return 4;
    default:
      return 0;
  }
}

Result<AccessorShape> shape_of(const GltfDocument& document, int accessor, const std::string& place) {
  const auto json = entry_of(document, "accessors", accessor, place);
  if (!json) return tl::unexpected<Error>(json.error());
  AccessorShape shape;
  const std::optional<std::size_t> count = size_of(member(**json, "count"));
  const Json& type = member(**json, "type");
  shape.component_type = index_of(member(**json, "componentType"));
  shape.components = type.is_string() ? components_of(type.get<std::string>()) : 0;
  shape.normalized = member(**json, "normalized") == true;
  if (!count || *count == 0 || shape.components == 0 || component_size(shape.component_type) == 0) {
    return fail(Code::gltf_malformed, document.file, at("accessors", accessor),
                "wrong count, type or componentType");
  }
  shape.count = *count;
  return shape;
}

Result<std::vector<std::uint8_t>> read_elements(const GltfDocument& document, int accessor,
                                                const std::string& place) {
  const Result<AccessorShape> shape = shape_of(document, accessor, place);
  if (!shape) return tl::unexpected<Error>(shape.error());
  const Json& json = document.json["accessors"][static_cast<std::size_t>(accessor)];
  const std::string where = at("accessors", accessor);
  const std::size_t size =
      component_size(shape->component_type) * static_cast<std::size_t>(shape->components);
  const Json& view = member(json, "bufferView");
  // Checked before the allocation: the data cannot be larger than all there is.
  std::size_t available = largest_zero_filled;
  if (!view.is_null()) {
    const auto bytes = bytes_of_view(document, index_of(view), where);
    if (!bytes) return tl::unexpected<Error>(bytes.error());
    available = bytes->size();
  }
  if (shape->count > available) {
    return fail(Code::gltf_malformed, document.file, where,
                fmt::format("{} elements have no room in their buffer view", shape->count));
  }
  std::vector<std::uint8_t> elements(shape->count * size);
  if (!view.is_null()) {
    if (Result<void> good = gather(document, index_of(view), offset_of(json, "byteOffset"), shape->count,
                                   size, where, elements.data());
        !good) {
      return tl::unexpected<Error>(std::move(good.error()));
    }
  }
  if (const Json& sparse = member(json, "sparse"); !sparse.is_null()) {
    if (Result<void> good = apply_sparse(document, sparse, *shape, where, elements); !good) {
      return tl::unexpected<Error>(std::move(good.error()));
    }
  }
  return elements;
}

Result<std::vector<float>> read_floats(const GltfDocument& document, int accessor, const std::string& place) {
  const Result<AccessorShape> shape = shape_of(document, accessor, place);
  if (!shape) return tl::unexpected<Error>(shape.error());
  if (member(document.json["accessors"][static_cast<std::size_t>(accessor)], "type")
          .get_ref<const std::string&>()
          .starts_with("MAT")) {
    return fail(Code::gltf_malformed, document.file, place, "a matrix where a vector belongs");
  }
  const auto elements = read_elements(document, accessor, place);
  if (!elements) return tl::unexpected<Error>(elements.error());
  return to_floats(*elements, shape->component_type, shape->normalized);
}

std::vector<float> to_floats(std::span<const std::uint8_t> elements, int component_type, bool normalized) {
  const std::size_t size = component_size(component_type);
  std::vector<float> values(elements.size() / size);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = float_at(elements.data() + i * size, component_type, normalized);
  }
  return values;
}

Result<std::vector<std::uint32_t>> read_indices(const GltfDocument& document, int accessor,
                                                const std::string& place) {
  const Result<AccessorShape> shape = shape_of(document, accessor, place);
  if (!shape) return tl::unexpected<Error>(shape.error());
  const int type = shape->component_type;
  if (shape->components != 1 || (type != 5121 && type != 5123 && type != 5125)) {
    return fail(Code::gltf_malformed, document.file, place, "indices are not unsigned integers");
  }
  const auto elements = read_elements(document, accessor, place);
  if (!elements) return tl::unexpected<Error>(elements.error());
  std::vector<std::uint32_t> values(shape->count);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = unsigned_at(elements->data() + i * component_size(type), type);
  }
  return values;
}

int append_view(GltfDocument& document, std::span<const std::uint8_t> bytes, int target, int stride) {
  Json& root = document.json;
  if (document.buffers.empty()) {
    document.buffers.emplace_back();
    root["buffers"] = Json::array({Json::object()});
  }
  std::vector<std::uint8_t>& buffer = document.buffers.back();
  append_padding(buffer);
  Json view{
      {"buffer", document.buffers.size() - 1}, {"byteOffset", buffer.size()}, {"byteLength", bytes.size()}};
  if (stride > 0) view["byteStride"] = stride;
  if (target > 0) view["target"] = target;
  buffer.insert(buffer.end(), bytes.begin(), bytes.end());
  root["buffers"].back()["byteLength"] = buffer.size();
  root["bufferViews"].push_back(std::move(view));
  return static_cast<int>(root["bufferViews"].size()) - 1;
}

int append_attribute_view(GltfDocument& document, const AccessorShape& shape,
                          std::span<const std::uint8_t> elements) {
  const std::size_t size = component_size(shape.component_type) * static_cast<std::size_t>(shape.components);
  const std::size_t stride = (size + 3) / 4 * 4;
  if (stride == size) return append_view(document, elements, 34962);
  std::vector<std::uint8_t> rows(shape.count * stride);
  for (std::size_t i = 0; i < shape.count; ++i) {
    std::memcpy(rows.data() + i * stride, elements.data() + i * size, size);
  }
  return append_view(document, rows, 34962, static_cast<int>(stride));
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
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(values.data());
  Json accessor{{"bufferView", append_view(document, {bytes, values.size_bytes()}, 34962)},
                {"componentType", 5126},
                {"count", values.size() / static_cast<std::size_t>(components)},
                {"type", types[static_cast<std::size_t>(components)]}};
  if (bounds) set_bounds(accessor, values, components);
  document.json["accessors"].push_back(std::move(accessor));
  return static_cast<int>(document.json["accessors"].size()) - 1;
}

int append_index_accessor(GltfDocument& document, std::span<const std::uint32_t> indices) {
  const std::uint32_t highest = indices.empty() ? 0 : *std::max_element(indices.begin(), indices.end());
  int type = 5125;
  int view = 0;
  if (highest < 65535) {  // 65535 itself is glTF's primitive restart value
    type = 5123;
    std::vector<std::uint16_t> shorter(indices.size());
    std::transform(indices.begin(), indices.end(), shorter.begin(),
                   [](std::uint32_t i) { return static_cast<std::uint16_t>(i); });
    view = append_view(document, {reinterpret_cast<const std::uint8_t*>(shorter.data()), shorter.size() * 2},
                       34963);
  } else {
    view = append_view(document,
                       {reinterpret_cast<const std::uint8_t*>(indices.data()), indices.size_bytes()}, 34963);
  }
  document.json["accessors"].push_back(
      Json{{"bufferView", view}, {"componentType", type}, {"count", indices.size()}, {"type", "SCALAR"}});
  return static_cast<int>(document.json["accessors"].size()) - 1;
}

void use_extension(Json& root, const char* name) {
  Json& used = root["extensionsUsed"];
  if (std::find(used.begin(), used.end(), name) == used.end()) used.push_back(name);
}

void drop_extension(Json& root, const char* name) {
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
    if (!member(root, list).is_array()) continue;
    Json kept = Json::array();
    for (const Json& entry : root[list]) {
      if (entry != name) kept.push_back(entry);
    }
    if (kept.empty()) {
      root.erase(list);
    } else {
      root[list] = std::move(kept);
    }
  }
}

}  // namespace selvedge
