#include "format/gltf/access.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace selvedge {
namespace {

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

bool is_index_type(int component_type) {
  return component_type == 5121 || component_type == 5123 || component_type == 5125;
}

/// `count` elements of `size` bytes each in the buffer view that `object` names, without gaps.
Result<std::vector<std::uint8_t>> gather(const GltfDocument& document, const Json& object, std::size_t count,
                                         std::size_t size, const std::string& place) {
  const int view = index_of(member(object, "bufferView"));
  const auto bytes = bytes_of_view(document, view, place);
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  const std::size_t offset = offset_of(object, "byteOffset");
  const std::size_t declared = offset_of(document.json["bufferViews"][view], "byteStride");
  const std::size_t stride = declared == 0 ? size : declared;
  if (stride < size || stride > 252) {
    return fail(Code::gltf_accessor, document.file, place,
                fmt::format("byteStride {} for elements of {} bytes", stride, size));
  }
  const std::size_t length = bytes->size();
  if (count > 0 &&
      (offset > length || size > length - offset || count - 1 > (length - offset - size) / stride)) {
    return fail(Code::gltf_accessor, document.file, place,
                fmt::format("{} elements of {} bytes from byte {} on reach beyond buffer view {} of {} bytes",
                            count, size, offset, view, length));
  }
  std::vector<std::uint8_t> elements(count * size);
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(elements.data() + i * size, bytes->data() + offset + i * stride, size);
  }
  return elements;
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

/// In double, so that a large transform does not multiply the rounding of normalised integers.
double number_at(const std::uint8_t* bytes, int component_type, bool normalized) {
  const auto scaled = [normalized](double value, double full) {
    return normalized ? std::max(value / full, -1.0) : value;
  };
  switch (component_type) {
    case 5120:
      return scaled(load<std::int8_t>(bytes), 127);
    case 5121:
      return scaled(*bytes, 255);
    case 5122:
      return scaled(load<std::int16_t>(bytes), 32767);
    case 5123:
      return scaled(load<std::uint16_t>(bytes), 65535);
    case 5125:
      return load<std::uint32_t>(bytes);
    default:
      return double{load<float>(bytes)};
  }
}

/// Replaces the elements that a "sparse" member says.
Result<void> apply_sparse(const GltfDocument& document, const Json& sparse, const AccessorShape& shape,
                          const std::string& place, std::vector<std::uint8_t>& elements) {
  const Json& indices = member(sparse, "indices");
  const std::optional<std::size_t> count = size_of(member(sparse, "count"));
  const int type = index_of(member(indices, "componentType"));
  if (!count || *count > shape.count) {
    return fail(Code::gltf_accessor, document.file, place + "/count",
                fmt::format("more replacements than the {} elements there are", shape.count));
  }
  if (!is_index_type(type)) {
    return fail(Code::gltf_malformed, document.file, place + "/indices", "wrong componentType");
  }
  const std::size_t size = shape.element_size();
  const auto targets = gather(document, indices, *count, component_size(type), place + "/indices");
  if (!targets) return tl::unexpected<Error>(targets.error());
  const auto replacements = gather(document, member(sparse, "values"), *count, size, place + "/values");
  if (!replacements) return tl::unexpected<Error>(replacements.error());
  std::size_t least = 0;
  for (std::size_t i = 0; i < *count; ++i) {
    const std::size_t target = unsigned_at(targets->data() + i * component_size(type), type);
    if (target < least) {
      return fail(Code::gltf_malformed, document.file, place,
                  fmt::format("index {} does not come after {}", target, least - 1));
    }
    least = target + 1;
    if (target >= shape.count) {
      return fail(Code::gltf_accessor, document.file, place,
                  fmt::format("index {} of {} elements", target, shape.count));
    }
    std::memcpy(elements.data() + target * size, replacements->data() + i * size, size);
  }
  return {};
}

}  // namespace

const Json& member(const Json& object, const char* key) {
  static const Json null;
  if (!object.is_object()) return null;
  const auto found = object.find(key);
  return found == object.end() ? null : *found;
}

const Json& array_of(const Json& object, const char* key) {
  static const Json empty = Json::array();
  const Json& found = member(object, key);
  return found.is_array() ? found : empty;
}

std::string string_of(const Json& value) { return value.is_string() ? value.get<std::string>() : ""; }

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
  const Json& entries = array_of(document.json, array);
  if (index < 0 || static_cast<std::size_t>(index) >= entries.size() || !entries[index].is_object()) {
    return fail(Code::gltf_accessor, document.file, place, fmt::format("there is no {}", at(array, index)));
  }
  return &entries[index];
}

Result<const Json*> view_of(const GltfDocument& document, int view, const std::string& place) {
  auto json = entry_of(document, "bufferViews", view, place);
  if (!json) return json;
  auto buffer = entry_of(document, "buffers", index_of(member(**json, "buffer")), at("bufferViews", view));
  if (!buffer) return buffer;
  const std::size_t offset = offset_of(**json, "byteOffset");
  const std::optional<std::size_t> length = size_of(member(**json, "byteLength"));
  const std::size_t available = offset_of(**buffer, "byteLength");
  if (!length) return fail(Code::gltf_malformed, document.file, at("bufferViews", view), "no byteLength");
  if (offset > available || *length > available - offset) {
    return fail(Code::gltf_accessor, document.file, at("bufferViews", view),
                fmt::format("bytes {} to {} of a buffer of {}", offset, offset + *length, available));
  }
  return json;
}

Result<std::span<const std::uint8_t>> bytes_of_view(const GltfDocument& document, int view,
                                                    const std::string& place) {
  const auto json = view_of(document, view, place);
  if (!json) return tl::unexpected<Error>(json.error());
  const auto buffer = static_cast<std::size_t>(index_of(member(**json, "buffer")));
  const std::size_t offset = offset_of(**json, "byteOffset");
  const std::size_t length = offset_of(**json, "byteLength");
  const std::size_t present = buffer < document.buffers.size() ? document.buffers[buffer].size() : 0;
  if (length > present || offset > present - length) {
    return fail(Code::gltf_accessor, document.file, at("bufferViews", view),
                fmt::format("buffer {} is not there", buffer));
  }
  return std::span<const std::uint8_t>(document.buffers[buffer]).subspan(offset, length);
}

std::size_t unbacked_elements(const GltfDocument& document) {
  std::size_t bytes = 0;
  for (const std::vector<std::uint8_t>& buffer : document.buffers) bytes += buffer.size();
  return (std::size_t{1} << 20) + 32 * bytes;
}

std::size_t component_size(int component_type) {
  constexpr std::array<std::size_t, 7> sizes{1, 1, 2, 2, 0, 4, 4};
  return component_type >= 5120 && component_type <= 5126 ? sizes[component_type - 5120] : 0;
}

Result<AccessorShape> shape_of(const GltfDocument& document, int accessor, const std::string& place) {
  const auto json = entry_of(document, "accessors", accessor, place);
  if (!json) return tl::unexpected<Error>(json.error());
  AccessorShape shape;
  shape.count = size_of(member(**json, "count")).value_or(0);
  shape.components = components_of(string_of(member(**json, "type")));
  shape.component_type = index_of(member(**json, "componentType"));
  shape.normalized = member(**json, "normalized") == true;
  if (shape.count == 0 || shape.element_size() == 0) {
    return fail(Code::gltf_malformed, document.file, at("accessors", accessor),
                "wrong count, type or componentType");
  }
  return shape;
}

Result<std::vector<std::uint8_t>> read_elements(const GltfDocument& document, int accessor,
                                                const std::string& place) {
  const Result<AccessorShape> shape = shape_of(document, accessor, place);
  if (!shape) return tl::unexpected<Error>(shape.error());
  const Json& json = document.json["accessors"][accessor];
  const std::string where = at("accessors", accessor);
  std::vector<std::uint8_t> elements;
  if (!member(json, "bufferView").is_null()) {
    auto stored = gather(document, json, shape->count, shape->element_size(), where);
    if (!stored) return stored;
    elements = std::move(*stored);
  } else if (shape->count > unbacked_elements(document)) {
    return fail(Code::file_too_large, document.file, where,
                fmt::format("{} elements without a buffer view", shape->count));
  } else {
    elements.resize(shape->count * shape->element_size());
  }
  const Json& sparse = member(json, "sparse");
  if (sparse.is_null()) return elements;
  Result<void> good = apply_sparse(document, sparse, *shape, where + "/sparse", elements);
  if (!good) return tl::unexpected<Error>(std::move(good.error()));
  return elements;
}

Result<std::vector<double>> read_numbers(const GltfDocument& document, int accessor,
                                         const std::string& place) {
  const Result<AccessorShape> shape = shape_of(document, accessor, place);
  if (!shape) return tl::unexpected<Error>(shape.error());
  const std::string type = member(document.json["accessors"][accessor], "type");
  // Columns of smaller matrices and components may be padded.
  if (type.starts_with("MAT") && (type != "MAT4" || shape->component_type != 5126)) {
    return fail(Code::gltf_malformed, document.file, place, "a matrix where a vector belongs");
  }
  const auto elements = read_elements(document, accessor, place);
  if (!elements) return tl::unexpected<Error>(elements.error());
  const std::size_t size = component_size(shape->component_type);
  std::vector<double> values(elements->size() / size);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = number_at(elements->data() + i * size, shape->component_type, shape->normalized);
  }
  return values;
}

Result<std::vector<std::uint32_t>> read_indices(const GltfDocument& document, int accessor,
                                                const std::string& place) {
  const Result<AccessorShape> shape = shape_of(document, accessor, place);
  if (!shape) return tl::unexpected<Error>(shape.error());
  const int type = shape->component_type;
  if (shape->components != 1 || !is_index_type(type)) {
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

std::vector<float> to_floats(std::span<const std::uint8_t> elements, int component_type, bool normalized) {
  const std::size_t size = component_size(component_type);
  std::vector<float> values(elements.size() / size);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<float>(number_at(elements.data() + i * size, component_type, normalized));
  }
  return values;
}

}  // namespace selvedge
