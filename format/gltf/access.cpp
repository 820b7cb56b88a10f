#include "format/gltf/access.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "format/base/guard.h"

namespace selvedge {
namespace {

const Json null;

std::string at(const char* array, int index) { return fmt::format("/{}/{}", array, index); }

std::size_t size_or_0(const Json& object, const char* key) {
  return whole_number(member(object, key)).value_or(0);
}

bool is_index_type(int type) { return type == 5121 || type == 5123 || type == 5125; }

template <class T>
T load(const std::uint8_t* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

/// In double, so that a large transform does not multiply the rounding of normalised integers.
double number_at(const std::uint8_t* bytes, int type, bool normalized) {
  const auto scaled = [normalized](double value, double full) {
    return normalized ? std::max(value / full, -1.0) : value;
  };
  if (type == 5120) return scaled(load<std::int8_t>(bytes), 127);
  if (type == 5121) return scaled(*bytes, 255);
  if (type == 5122) return scaled(load<std::int16_t>(bytes), 32767);
  if (type == 5123) return scaled(load<std::uint16_t>(bytes), 65535);
  return type == 5125 ? load<std::uint32_t>(bytes) : double{load<float>(bytes)};
}

template <class T>
std::vector<T> convert(std::span<const std::uint8_t> elements, int type, bool normalized) {
  const std::size_t size = component_size(type);
  std::vector<T> values(elements.size() / size);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<T>(number_at(elements.data() + i * size, type, normalized));
  return values;
}

}  // namespace

const Json& member(const Json& object, const char* key) {
  if (!object.is_object()) return null;
  const auto found = object.find(key);
  return found == object.end() ? null : *found;
}

const Json& array_member(const Json& object, const char* key) {
  static const Json empty = Json::array();
  const Json& found = member(object, key);
  return found.is_array() ? found : empty;
}

std::string string_of(const Json& value) { return value.is_string() ? value.get<std::string>() : ""; }

std::optional<std::size_t> whole_number(const Json& value) {
  constexpr double largest = 0x1p40;
  const double number = number_or(value, -1);
  if (!(number >= 0) || number > largest || number != std::floor(number)) return std::nullopt;
  return static_cast<std::size_t>(number);
}

int index_of(const Json& value) {
  constexpr std::size_t largest = std::numeric_limits<int>::max();
  const std::optional<std::size_t> size = whole_number(value);
  return size && *size <= largest ? static_cast<int>(*size) : -1;
}

double number_or(const Json& value, double otherwise) {
  return value.is_number() ? value.get<double>() : otherwise;
}

const Json& root_entry(const GltfDocument& document, const char* array, int index) {
  const Json& entries = array_member(document.json, array);
  const bool present = index >= 0 && static_cast<std::size_t>(index) < entries.size();
  return present && entries[index].is_object() ? entries[index] : null;
}

int component_count(const Json& accessor) {
  constexpr std::array<std::pair<const char*, int>, 7> table{
      {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}}};
  for (const auto& [name, components] : table)
    if (member(accessor, "type") == name) return components;
  return 0;
}

std::size_t component_size(int component_type) {
  constexpr std::array<std::size_t, 7> sizes{1, 1, 2, 2, 0, 4, 4};
  return component_type >= 5120 && component_type <= 5126 ? sizes[component_type - 5120] : 0;
}

std::size_t max_unbacked_elements(const GltfDocument& document) {
  std::size_t bytes = 0;
  for (const Bytes& buffer : document.buffers) bytes += buffer.size();
  return (std::size_t{1} << 20) + 32 * bytes;
}

std::vector<float> to_floats(std::span<const std::uint8_t> elements, int component_type, bool normalized) {
  return convert<float>(elements, component_type, normalized);
}

void GltfReader::fail(Code code, std::string place, std::string message) const {
  throw Failure{Error{code, document.file, std::move(place), std::move(message)}};
}

const Json& GltfReader::entry(const char* array, int index, const std::string& place) {
  const Json& found = root_entry(document, array, index);
  if (found.is_null()) fail(Code::gltf_accessor, place, fmt::format("there is no {}", at(array, index)));
  return found;
}

const Json& GltfReader::buffer_view(int index, const std::string& place) {
  const Json& json = entry("bufferViews", index, place);
  const std::string where = at("bufferViews", index);
  const Json& buffer = entry("buffers", index_of(member(json, "buffer")), where);
  const std::size_t offset = size_or_0(json, "byteOffset");
  const std::optional<std::size_t> length = whole_number(member(json, "byteLength"));
  const std::size_t available = size_or_0(buffer, "byteLength");
  if (!length) fail(Code::gltf_malformed, where, "no byteLength");
  if (offset > available || *length > available - offset)
    fail(Code::gltf_accessor, where,
         fmt::format("bytes {} to {} of a buffer of {}", offset, offset + *length, available));
  return json;
}

std::span<const std::uint8_t> GltfReader::view_bytes(int index, const std::string& place) {
  const Json& json = buffer_view(index, place);
  const auto buffer = static_cast<std::size_t>(index_of(member(json, "buffer")));
  const std::size_t offset = size_or_0(json, "byteOffset");
  const std::size_t length = size_or_0(json, "byteLength");
  const std::size_t present = buffer < document.buffers.size() ? document.buffers[buffer].size() : 0;
  if (length <= present && offset <= present - length)
    return std::span<const std::uint8_t>(document.buffers[buffer]).subspan(offset, length);
  fail(Code::gltf_accessor, at("bufferViews", index), fmt::format("buffer {} is not there", buffer));
}

AccessorShape GltfReader::accessor_shape(int accessor, const std::string& place) {
  const Json& json = entry("accessors", accessor, place);
  AccessorShape shape{size_or_0(json, "count"), component_count(json),
                      index_of(member(json, "componentType")), member(json, "normalized") == true};
  if (shape.count == 0 || shape.element_size() == 0)
    fail(Code::gltf_malformed, at("accessors", accessor), "wrong count, type or componentType");
  return shape;
}

/// `count` elements of `size` bytes each in the buffer view that `object` names, without gaps.
Bytes GltfReader::gather(const Json& object, std::size_t count, std::size_t size, const std::string& place) {
  const int view = index_of(member(object, "bufferView"));
  const std::span<const std::uint8_t> stored = view_bytes(view, place);
  const std::size_t offset = size_or_0(object, "byteOffset");
  const std::size_t declared = size_or_0(document.json["bufferViews"][view], "byteStride");
  const std::size_t stride = declared == 0 ? size : declared;
  const std::size_t length = stored.size();
  if (stride < size || stride > 252)
    fail(Code::gltf_accessor, place, fmt::format("byteStride {} for elements of {} bytes", stride, size));
  if (count > 0 &&
      (offset > length || size > length - offset || count - 1 > (length - offset - size) / stride))
    fail(Code::gltf_accessor, place,
         fmt::format("{} elements of {} bytes from byte {} on reach beyond buffer view {} of {} bytes", count,
                     size, offset, view, length));
  Bytes elements(count * size);
  for (std::size_t i = 0; i < count; ++i)
    std::memcpy(elements.data() + i * size, stored.data() + offset + i * stride, size);
  return elements;
}

/// Replaces the elements that a "sparse" member lists.
void GltfReader::apply_sparse(const Json& sparse, const AccessorShape& shape, const std::string& place,
                              Bytes& elements) {
  const Json& indices = member(sparse, "indices");
  const std::optional<std::size_t> count = whole_number(member(sparse, "count"));
  const int type = index_of(member(indices, "componentType"));
  if (!count || *count > shape.count)
    fail(Code::gltf_accessor, place + "/count",
         fmt::format("more replacements than the {} elements there are", shape.count));
  if (!is_index_type(type)) fail(Code::gltf_malformed, place + "/indices", "wrong componentType");
  const std::size_t size = shape.element_size();
  const auto targets =
      convert<std::size_t>(gather(indices, *count, component_size(type), place + "/indices"), type, false);
  const auto replacements = gather(member(sparse, "values"), *count, size, place + "/values");
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (i > 0 && targets[i] <= targets[i - 1])
      fail(Code::gltf_malformed, place,
           fmt::format("index {} does not come after {}", targets[i], targets[i - 1]));
    if (targets[i] >= shape.count)
      fail(Code::gltf_accessor, place, fmt::format("index {} of {} elements", targets[i], shape.count));
    std::memcpy(elements.data() + targets[i] * size, replacements.data() + i * size, size);
  }
}

Bytes GltfReader::elements(int accessor, const std::string& place) {
  const AccessorShape shape = accessor_shape(accessor, place);
  const Json& json = entry("accessors", accessor, place);
  const std::string where = at("accessors", accessor);
  Bytes elements;
  if (!member(json, "bufferView").is_null())
    elements = gather(json, shape.count, shape.element_size(), where);
  else if (shape.count > max_unbacked_elements(document))
    fail(Code::file_too_large, where, fmt::format("{} elements without a buffer view", shape.count));
  else
    elements.resize(shape.count * shape.element_size());
  const Json& sparse = member(json, "sparse");
  if (!sparse.is_null()) apply_sparse(sparse, shape, where + "/sparse", elements);
  return elements;
}

std::vector<double> GltfReader::numbers(int accessor, const std::string& place) {
  const AccessorShape shape = accessor_shape(accessor, place);
  const std::string type = string_of(member(entry("accessors", accessor, place), "type"));
  // Columns of smaller matrices and components may be padded.
  if (type.starts_with("MAT") && (type != "MAT4" || shape.component_type != 5126))
    fail(Code::gltf_malformed, place, "a matrix where a vector belongs");
  return convert<double>(elements(accessor, place), shape.component_type, shape.normalized);
}

std::vector<double> GltfReader::vector_numbers(int accessor, std::size_t components, std::size_t count,
                                               const std::string& place) {
  const AccessorShape shape = accessor_shape(accessor, place);
  if (static_cast<std::size_t>(shape.components) != components || (count > 0 && shape.count != count))
    fail(Code::gltf_malformed, place,
         fmt::format("{} elements of {} numbers do not belong here", shape.count, shape.components));
  std::vector<double> values = numbers(accessor, place);
  const auto bad = std::ranges::find_if(values, [](double x) { return !std::isfinite(x); });
  if (bad == values.end()) return values;
  fail(Code::mesh_not_finite, place,
       fmt::format("element {} is not finite", static_cast<std::size_t>(bad - values.begin()) / components));
}

std::vector<std::uint32_t> GltfReader::indices(int accessor, const std::string& place) {
  const AccessorShape shape = accessor_shape(accessor, place);
  if (shape.components != 1 || !is_index_type(shape.component_type))
    fail(Code::gltf_malformed, place, "indices are not unsigned integers");
  return convert<std::uint32_t>(elements(accessor, place), shape.component_type, false);
}

}  // namespace selvedge
