#include "format/gltf/meshopt.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>

#include "format/base/vec.h"
#include "format/gltf/edit.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

using names::gltf::khr_meshopt;
using names::gltf::meshopt;

/// The attribute codec spends at least 2 bits on 16 bytes, the index codecs a byte on an index or a triangle.
constexpr std::size_t bytes_per_byte = 64;

enum class StreamMode { attributes, triangles, indices, unknown };
enum class Filter { none, octahedral, quaternion, exponential, unknown };

NLOHMANN_JSON_SERIALIZE_ENUM(StreamMode, {{StreamMode::unknown, nullptr},
                                          {StreamMode::attributes, "ATTRIBUTES"},
                                          {StreamMode::triangles, "TRIANGLES"},
                                          {StreamMode::indices, "INDICES"}})
NLOHMANN_JSON_SERIALIZE_ENUM(Filter, {{Filter::unknown, ""},
                                      {Filter::none, nullptr},
                                      {Filter::none, "NONE"},
                                      {Filter::octahedral, "OCTAHEDRAL"},
                                      {Filter::quaternion, "QUATERNION"},
                                      {Filter::exponential, "EXPONENTIAL"}})

/// A view's compressed stream, as the extension describes it.
struct Stream {
  StreamMode mode = StreamMode::attributes;
  Filter filter = Filter::none;
  std::size_t count = 0;
  std::size_t stride = 0;
  std::span<const std::uint8_t> bytes;

  std::size_t size() const { return count * stride; }  ///< decoded, in bytes
};

const char* extension_of(const Json& object) {
  for (const char* name : {meshopt, khr_meshopt})
    if (!member(member(object, "extensions"), name).is_null()) return name;
  return nullptr;
}

/// The rule of the extension that the numbers of a stream break; nullptr if they keep all.
const char* fault_of(const Stream& s) {
  if (s.count == 0) return "count is not a positive integer";
  if (s.mode == StreamMode::attributes && (s.stride == 0 || s.stride > 256 || s.stride % 4 != 0))
    return "byteStride is no multiple of 4 up to 256";
  if (s.mode != StreamMode::attributes && s.stride != 2 && s.stride != 4)
    return "byteStride is neither 2 nor 4";
  if (s.mode != StreamMode::attributes && s.filter != Filter::none) return "a filter on indices";
  if (s.mode == StreamMode::triangles && s.count % 3 != 0) return "count is no multiple of 3";
  if (s.filter == Filter::octahedral && s.stride != 4 && s.stride != 8)
    return "byteStride is neither 4 nor 8 for filter OCTAHEDRAL";
  if (s.filter == Filter::quaternion && s.stride != 8) return "byteStride is not 8 for filter QUATERNION";
  return nullptr;
}

Stream stream_of(GltfReader& reader, const Json& view, const Json& extension, const std::string& place) {
  const auto refuse = [&](Code code, std::string message) { reader.fail(code, place, std::move(message)); };
  const auto size = [&](const char* key) { return whole_number(member(extension, key)).value_or(0); };
  const Json& filter = member(extension, "filter");
  Stream stream{member(extension, "mode").get<StreamMode>(),
                filter.get<Filter>(),
                size("count"),
                size("byteStride"),
                {}};
  if (stream.mode == StreamMode::unknown) refuse(Code::gltf_malformed, "unknown mode");
  if (stream.filter == Filter::unknown)
    refuse(Code::gltf_unsupported, fmt::format("filter \"{}\"", string_of(filter)));
  if (const char* fault = fault_of(stream)) refuse(Code::gltf_malformed, fault);
  const Json& view_stride = member(view, "byteStride");
  if (!view_stride.is_null() && whole_number(view_stride) != stream.stride)
    refuse(Code::gltf_malformed, "byteStride differs from the view's");
  if (whole_number(member(view, "byteLength")) != stream.size())
    refuse(Code::gltf_malformed, "count times byteStride is not the view's byteLength");

  const auto& buffers = reader.document.buffers;
  const auto buffer = static_cast<std::size_t>(index_of(member(extension, "buffer")));
  if (buffer >= buffers.size()) refuse(Code::gltf_accessor, "there is no such buffer");
  const std::size_t present = buffers[buffer].size();
  const std::size_t offset = size("byteOffset");
  const std::size_t length = size("byteLength");
  if (offset > present || length > present - offset)
    refuse(Code::gltf_accessor,
           fmt::format("bytes {} to {} of a buffer of {}", offset, offset + length, present));
  stream.bytes = std::span<const std::uint8_t>(buffers[buffer]).subspan(offset, length);
  if (stream.size() > bytes_per_byte * length)
    refuse(Code::file_damaged, fmt::format("meshopt: {} elements of {} bytes cannot be in {} bytes",
                                           stream.count, stream.stride, length));
  return stream;
}

/// Whether the stream has a version that meshoptimizer does not know: 1 of the attribute codec.
bool is_newer(const Stream& stream) {
  constexpr std::uint8_t attributes = 0xa0;
  return stream.mode == StreamMode::attributes && !stream.bytes.empty() &&
         (stream.bytes[0] & 0xf0) == attributes && stream.bytes[0] != attributes;
}

/// Octahedral normals of four bytes each. Those of meshoptimizer differ by a step between processors.
void unfilter_normals(std::uint8_t* out, std::size_t count) {
  for (auto* n = reinterpret_cast<std::int8_t*>(out); n != reinterpret_cast<std::int8_t*>(out) + 4 * count;
       n += 4) {
    V3d normal(n[0], n[1], n[2] - std::abs(n[0]) - std::abs(n[1]));
    const double below = std::min(normal.z, 0.0);
    for (int c = 0; c < 2; ++c) normal[c] += normal[c] < 0 ? -below : below;
    const double length = std::max(normal.length(), 1e-9);
    for (int c = 0; c < 3; ++c) n[c] = static_cast<std::int8_t>(std::lround(127 * normal[c] / length));
  }
}

bool decode(const Stream& s, std::uint8_t* out) {
  using Decode = int (*)(void*, std::size_t, std::size_t, const unsigned char*, std::size_t);
  using Unfilter = void (*)(void*, std::size_t, std::size_t);
  constexpr std::array<Decode, 3> decoders{meshopt_decodeVertexBuffer, meshopt_decodeIndexBuffer,
                                           meshopt_decodeIndexSequence};
  constexpr std::array<Unfilter, 4> filters{nullptr, meshopt_decodeFilterOct, meshopt_decodeFilterQuat,
                                            meshopt_decodeFilterExp};
  const Decode decoder = decoders[static_cast<std::size_t>(s.mode)];
  if (decoder(out, s.count, s.stride, s.bytes.data(), s.bytes.size()) != 0) return false;
  if (s.filter == Filter::octahedral && s.stride == 4)
    unfilter_normals(out, s.count);
  else if (s.filter != Filter::none)
    filters[static_cast<std::size_t>(s.filter)](out, s.count, s.stride);
  return true;
}

/// Whether the view's own bytes are in the file.
bool has_plain_bytes(const GltfDocument& document, const Json& view) {
  const auto buffer = static_cast<std::size_t>(index_of(member(view, "buffer")));
  return buffer < document.buffers.size() && !document.buffers[buffer].empty();
}

/// The views of new vertices and indices with the shape of their elements, whose rows may be padded; none if
/// readers without the extension need plain bytes.
std::map<int, AccessorShape> fresh_views(const GltfDocument& document, const char* name) {
  std::map<int, AccessorShape> fresh;
  if (!document.original_encoding.required_extensions.contains(name)) return fresh;
  GltfReader reader(document);
  for (int i = 0; i < static_cast<int>(array_member(document.json, "accessors").size()); ++i) {
    const int number = index_of(member(document.json["accessors"][i], "bufferView"));
    const Json& view = root_entry(document, "bufferViews", number);
    if (!member(view, "target").is_null() && view_position(view) >= document.original_encoding.known_end)
      fresh.emplace(number, reader.accessor_shape(i, ""));
  }
  return fresh;
}

/// Floats that are whole multiples of a power of two below 2^23 of it, as the filter EXPONENTIAL takes them;
/// empty for others.
std::vector<std::uint32_t> as_multiples(std::span<const std::uint8_t> bytes) {
  std::vector<float> values(bytes.size() / sizeof(float));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  int step = 127;  // exponent of the largest step that suits all
  float largest = 0;
  for (const float value : values) {
    if (!std::isfinite(value)) return {};
    int exponent = 0;
    const auto digits = static_cast<std::int32_t>(std::ldexp(std::frexp(value, &exponent), 24));
    if (digits != 0) step = std::min(step, exponent - 24 + std::countr_zero(static_cast<unsigned>(digits)));
    largest = std::max(largest, std::abs(value));
  }
  if (step < -100 || std::ldexp(largest, -step) >= 0x1p23F) return {};
  std::vector<std::uint32_t> codes;
  for (const float value : values) {
    const auto multiple = static_cast<std::int32_t>(std::ldexp(value, -step));
    codes.push_back((static_cast<std::uint32_t>(step) << 24U) |
                    (static_cast<std::uint32_t>(multiple) & 0xffffffU));
  }
  return codes;
}

/// The stream of a new view; `extension` gets what describes it.
Bytes encode(std::span<const std::uint8_t> bytes, const Json& view, const AccessorShape& shape,
             Json& extension) {
  const bool triangles = view["target"] == 34963;
  const std::size_t stride = whole_number(member(view, "byteStride")).value_or(shape.element_size());
  const std::size_t count = bytes.size() / stride;
  extension["mode"] = triangles ? StreamMode::triangles : StreamMode::attributes;
  extension["count"] = count;
  extension["byteStride"] = stride;
  Bytes stream;
  if (!triangles) {
    std::vector<std::uint32_t> multiples;
    if (shape.component_type == 5126) multiples = as_multiples(bytes);
    if (!multiples.empty()) extension["filter"] = Filter::exponential;
    const void* const rows = multiples.empty() ? static_cast<const void*>(bytes.data()) : multiples.data();
    stream.resize(meshopt_encodeVertexBufferBound(count, stride));
    stream.resize(meshopt_encodeVertexBuffer(stream.data(), stream.size(), rows, count, stride));
    return stream;
  }
  std::vector<unsigned> indices(count);
  for (std::size_t i = 0; i < count; ++i) std::memcpy(&indices[i], bytes.data() + i * stride, stride);
  meshopt_encodeIndexVersion(1);  // the only one of the extension
  stream.resize(meshopt_encodeIndexBufferBound(count, count));
  stream.resize(meshopt_encodeIndexBuffer(stream.data(), stream.size(), indices.data(), count));
  return stream;
}

}  // namespace

void expand_meshopt(GltfDocument& document) {
  GltfReader reader(document);
  const std::size_t views = array_member(document.json, "bufferViews").size();
  std::size_t budget = 0;  // views that share their bytes do not multiply them
  for (const Bytes& buffer : document.buffers) budget += bytes_per_byte * buffer.size();
  Bytes decoded;
  const std::size_t target = document.buffers.size();
  for (std::size_t i = 0; i < views; ++i) {
    Json& view = document.json["bufferViews"][i];
    const char* name = extension_of(view);
    if (name == nullptr) continue;
    const std::string place = fmt::format("/bufferViews/{}/extensions/{}", i, name);
    const Stream stream = stream_of(reader, view, view["extensions"][name], place);
    if (!is_newer(stream) || !has_plain_bytes(document, view)) {
      if (stream.size() > budget) reader.fail(Code::file_too_large, place, "meshopt: too many bytes");
      if (is_newer(stream))
        reader.fail(Code::gltf_unsupported, place,
                    fmt::format("meshopt: version {} of the attribute codec", stream.bytes[0] & 0x0f));
      budget -= stream.size();
      decoded.resize((decoded.size() + 15) / 16 * 16);
      document.original_encoding.meshopt_views.emplace(BufferPosition(target, decoded.size()), view);
      view["buffer"] = target;
      view["byteOffset"] = decoded.size();
      decoded.resize(decoded.size() + stream.size());
      if (!decode(stream, decoded.data() + decoded.size() - stream.size()))
        reader.fail(Code::file_damaged, place, "meshopt: the stream is damaged");
    }
    erase_extension(view, name);
  }
  for (std::size_t b = 0; b < target; ++b) {
    Json& buffer = document.json["buffers"][b];
    while (const char* name = extension_of(buffer)) erase_extension(buffer, name);
  }
  if (!decoded.empty()) {
    document.json["buffers"].push_back(Json{{"byteLength", decoded.size()}});
    document.buffers.push_back(std::move(decoded));
  }
  for (const char* name : {meshopt, khr_meshopt}) unlist_encoding(document, name);
}

std::vector<std::uint32_t> order_triangles(std::vector<std::uint32_t>& indices, std::size_t vertices) {
  std::vector<std::uint32_t> ordered(indices.size());
  meshopt_optimizeVertexCacheStrip(ordered.data(), indices.data(), indices.size(), vertices);
  std::vector<std::uint32_t> numbers(vertices);
  std::vector<std::uint32_t> former(
      meshopt_optimizeVertexFetchRemap(numbers.data(), ordered.data(), ordered.size(), vertices));
  meshopt_remapIndexBuffer(indices.data(), ordered.data(), ordered.size(), numbers.data());
  for (std::uint32_t i = 0; i < vertices; ++i)
    if (numbers[i] != ~0U) former[numbers[i]] = i;
  return former;
}

void repack_meshopt(GltfDocument& document) {
  const std::map<BufferPosition, Json>& packed = document.original_encoding.meshopt_views;
  if (packed.empty() && !document.original_encoding.required_extensions.contains(meshopt)) return;
  const char* const name = packed.empty() ? meshopt : extension_of(packed.begin()->second);
  const std::map<int, AccessorShape> fresh = fresh_views(document, name);
  const std::size_t fallback = document.buffers.size();
  Bytes streams;
  std::size_t declared = 0;
  for (int i = 0; i < static_cast<int>(array_member(document.json, "bufferViews").size()); ++i) {
    const auto was = packed.find(view_position(document.json["bufferViews"][i]));
    const auto shape = fresh.find(i);
    if (was == packed.end() && shape == fresh.end()) continue;
    // Moves the document's members.
    relist_encoding(document, was != packed.end() ? extension_of(was->second) : name);
    Json& view = document.json["bufferViews"][i];
    if (was != packed.end()) {
      view = was->second;
      if (has_plain_bytes(document, view)) continue;
    } else {
      Json& extension = view["extensions"][name];
      const Bytes stream = encode(GltfReader(document).view_bytes(i, ""), view, shape->second, extension);
      extension["buffer"] = fallback + 1;
      extension["byteOffset"] = streams.size();
      extension["byteLength"] = stream.size();
      streams.insert(streams.end(), stream.begin(), stream.end());
    }
    view["buffer"] = fallback;
    view["byteOffset"] = declared;
    declared += (whole_number(view["byteLength"]).value_or(0) + 15) / 16 * 16;
  }
  if (declared == 0) return;
  document.json["buffers"].push_back(
      Json{{"byteLength", declared}, {"extensions", {{name, {{"fallback", true}}}}}});
  document.json["buffers"].push_back(Json{{"byteLength", streams.size()}});
  document.buffers.emplace_back();
  document.buffers.push_back(std::move(streams));
}

}  // namespace selvedge
