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

/// A run of `count` elements of `size` bytes each, with every bound checked.
Result<ElementRun> run_of(const GltfDocument& document, int view, std::size_t offset, std::size_t count,
                          std::size_t size, const std::string& place) {
  const auto json = view_of(document, view, place);
  if (!json) return tl::unexpected<Error>(json.error());
  ElementRun run{view, offset, count, size, offset_of(**json, "byteStride")};
  if (run.stride == 0) run.stride = size;
  if (run.stride < size || run.stride > 252) {
    return fail(Code::gltf_accessor, document.file, place,
                fmt::format("byteStride {} for elements of {} bytes", run.stride, size));
  }
  const std::size_t length = offset_of(**json, "byteLength");
  if (count > 0 &&
      (offset > length || size > length - offset || count - 1 > (length - offset - size) / run.stride)) {
    return fail(Code::gltf_accessor, document.file, place,
                fmt::format("{} elements of {} bytes from byte {} on reach beyond buffer view {} of {} bytes",
                            count, size, offset, view, length));
  }
  return run;
}

/// Copies the elements of a run, without gaps.
Result<void> gather(const GltfDocument& document, const ElementRun& run, const std::string& place,
                    std::vector<std::uint8_t>& out) {
  out.assign(run.count * run.size, 0);
  if (run.view < 0) return {};
  const auto bytes = bytes_of_view(document, run.view, place);
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  for (std::size_t i = 0; i < run.count; ++i) {
    std::memcpy(out.data() + i * run.size, bytes->data() + run.offset + i * run.stride, run.size);
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

Result<void> apply_sparse(const GltfDocument& document, const SparseRuns& sparse, std::size_t count,
                          const std::string& place, std::vector<std::uint8_t>& elements) {
  std::vector<std::uint8_t> targets;
  std::vector<std::uint8_t> replacements;
  if (Result<void> good = gather(document, sparse.indices, place, targets); !good) return good;
  if (Result<void> good = gather(document, sparse.values, place, replacements); !good) return good;
  const std::size_t size = sparse.values.size;
  std::size_t least = 0;
  for (std::size_t i = 0; i < sparse.indices.count; ++i) {
    const std::size_t target = unsigned_at(targets.data() + i * sparse.indices.size, sparse.index_type);
    if (target < least) {
      return fail(Code::gltf_malformed, document.file, place + "/sparse",
                  fmt::format("index {} does not come after {}", target, least - 1));
    }
    least = target + 1;
    if (target >= count) {
      return fail(Code::gltf_accessor, document.file, place + "/sparse",
                  fmt::format("index {} of {} elements", target, count));
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
      !entries[index].is_object()) {
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
  if (offset + length > present) {
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

Result<ElementRun> elements_of(const GltfDocument& document, int accessor, const std::string& place) {
  const Result<AccessorShape> shape = shape_of(document, accessor, place);
  if (!shape) return tl::unexpected<Error>(shape.error());
  const Json& json = document.json["accessors"][accessor];
  const std::string where = at("accessors", accessor);
  const std::size_t size =
      component_size(shape->component_type) * static_cast<std::size_t>(shape->components);
  const Json& view = member(json, "bufferView");
  if (!view.is_null()) {
    return run_of(document, index_of(view), offset_of(json, "byteOffset"), shape->count, size, where);
  }
  if (shape->count > unbacked_elements(document)) {
    return fail(Code::file_too_large, document.file, where,
                fmt::format("{} elements without a buffer view", shape->count));
  }
  return ElementRun{-1, 0, shape->count, size, size};
}

Result<std::optional<SparseRuns>> sparse_of(const GltfDocument& document, int accessor,
                                            const std::string& place) {
  const Result<AccessorShape> shape = shape_of(document, accessor, place);
  if (!shape) return tl::unexpected<Error>(shape.error());
  const Json& sparse = member(document.json["accessors"][accessor], "sparse");
  if (sparse.is_null()) return std::optional<SparseRuns>{};
  const std::string where = at("accessors", accessor) + "/sparse";
  const std::optional<std::size_t> count = size_of(member(sparse, "count"));
  const Json& indices = member(sparse, "indices");
  const Json& values = member(sparse, "values");
  SparseRuns runs;
  runs.index_type = index_of(member(indices, "componentType"));
  if (!count || *count > shape->count) {
    return fail(Code::gltf_accessor, document.file, where + "/count",
                fmt::format("more replacements than the {} elements there are", shape->count));
  }
  if (runs.index_type != 5121 && runs.index_type != 5123 && runs.index_type != 5125) {
    return fail(Code::gltf_malformed, document.file, where + "/indices", "wrong componentType");
  }
  const auto run_at = [&](const Json& part, std::size_t size, const char* name) {
    return run_of(document, index_of(member(part, "bufferView")), offset_of(part, "byteOffset"), *count, size,
                  where + name);
  };
  const std::size_t size =
      component_size(shape->component_type) * static_cast<std::size_t>(shape->components);
  const Result<ElementRun> where_to = run_at(indices, component_size(runs.index_type), "/indices");
  if (!where_to) return tl::unexpected<Error>(where_to.error());
  const Result<ElementRun> what = run_at(values, size, "/values");
  if (!what) return tl::unexpected<Error>(what.error());
  runs.indices = *where_to;
  runs.values = *what;
  return std::optional(runs);
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
  const Result<ElementRun> run = elements_of(document, accessor, place);
  if (!run) return tl::unexpected<Error>(run.error());
  const Result<std::optional<SparseRuns>> sparse = sparse_of(document, accessor, place);
  if (!sparse) return tl::unexpected<Error>(sparse.error());
  const std::string where = at("accessors", accessor);
  std::vector<std::uint8_t> elements;
  if (Result<void> good = gather(document, *run, where, elements); !good) {
    return tl::unexpected<Error>(std::move(good.error()));
  }
  if (*sparse) {
    if (Result<void> good = apply_sparse(document, **sparse, run->count, where, elements); !good) {
      return tl::unexpected<Error>(std::move(good.error()));
    }
  }
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

std::vector<float> to_floats(std::span<const std::uint8_t> elements, int component_type, bool normalized) {
  const std::size_t size = component_size(component_type);
  std::vector<float> values(elements.size() / size);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<float>(number_at(elements.data() + i * size, component_type, normalized));
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
                {"type", types[components]}};
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
