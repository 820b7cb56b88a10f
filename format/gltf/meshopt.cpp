#include "format/gltf/meshopt.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include <cstring>
#include <span>

#include "format/gltf/edit.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

using names::gltf::khr_meshopt;
using names::gltf::meshopt;

/// The attribute codec spends at least 2 bits on 16 bytes, the index codecs a byte on an index or a triangle.
constexpr std::size_t bytes_per_byte = 64;

enum class Mode { attributes, triangles, indices };
enum class Filter { none, octahedral, quaternion, exponential };

/// What the extension says of a view.
struct Stream {
  Mode mode = Mode::attributes;
  Filter filter = Filter::none;
  std::size_t count = 0;
  std::size_t stride = 0;
  std::span<const std::uint8_t> bytes;
};

const char* extension_of(const Json& object) {
  for (const char* name : {meshopt, khr_meshopt}) {
    if (!member(member(object, "extensions"), name).is_null()) return name;
  }
  return nullptr;
}

/// Why the numbers of a stream break a rule of the extension; nullptr where they do not.
const char* fault_of(const Stream& s) {
  if (s.count == 0) return "count is not a positive integer";
  if (s.mode == Mode::attributes && (s.stride == 0 || s.stride > 256 || s.stride % 4 != 0))
    return "byteStride is no multiple of 4 up to 256";
  if (s.mode != Mode::attributes && s.stride != 2 && s.stride != 4) return "byteStride is neither 2 nor 4";
  if (s.mode != Mode::attributes && s.filter != Filter::none) return "a filter on indices";
  if (s.mode == Mode::triangles && s.count % 3 != 0) return "count is no multiple of 3";
  if (s.filter == Filter::octahedral && s.stride != 4 && s.stride != 8)
    return "byteStride is neither 4 nor 8 for filter OCTAHEDRAL";
  if (s.filter == Filter::quaternion && s.stride != 8) return "byteStride is not 8 for filter QUATERNION";
  return nullptr;
}

Result<Stream> stream_of(const GltfDocument& document, const Json& view, const Json& extension,
                         const std::string& place) {
  const auto refuse = [&](Code code, std::string message) {
    return fail(code, document.file, place, std::move(message));
  };
  Stream stream;
  const std::string mode = string_of(member(extension, "mode"));
  const std::string filter = string_of(member(extension, "filter"));
  if (mode == "TRIANGLES") {
    stream.mode = Mode::triangles;
  } else if (mode == "INDICES") {
    stream.mode = Mode::indices;
  } else if (mode != "ATTRIBUTES") {
    return refuse(Code::gltf_malformed, "unknown mode");
  }
  if (filter == "OCTAHEDRAL") {
    stream.filter = Filter::octahedral;
  } else if (filter == "QUATERNION") {
    stream.filter = Filter::quaternion;
  } else if (filter == "EXPONENTIAL") {
    stream.filter = Filter::exponential;
  } else if (!member(extension, "filter").is_null() && filter != "NONE") {
    return refuse(Code::gltf_unsupported, fmt::format("filter \"{}\"", filter));
  }
  stream.count = size_of(member(extension, "count")).value_or(0);
  stream.stride = size_of(member(extension, "byteStride")).value_or(0);
  if (const char* fault = fault_of(stream)) return refuse(Code::gltf_malformed, fault);
  const Json& view_stride = member(view, "byteStride");
  if (!view_stride.is_null() && size_of(view_stride) != stream.stride)
    return refuse(Code::gltf_malformed, "byteStride is not that of the view");
  if (size_of(member(view, "byteLength")) != stream.count * stream.stride)
    return refuse(Code::gltf_malformed, "count times byteStride is not the view's byteLength");

  const auto buffer = static_cast<std::size_t>(index_of(member(extension, "buffer")));
  if (buffer >= document.buffers.size()) return refuse(Code::gltf_accessor, "there is no such buffer");
  const std::size_t present = document.buffers[buffer].size();
  const std::size_t offset = size_of(member(extension, "byteOffset")).value_or(0);
  const std::size_t length = size_of(member(extension, "byteLength")).value_or(0);
  if (offset > present || length > present - offset) {
    return refuse(Code::gltf_accessor,
                  fmt::format("bytes {} to {} of a buffer of {}", offset, offset + length, present));
  }
  stream.bytes = std::span<const std::uint8_t>(document.buffers[buffer]).subspan(offset, length);
  if (stream.count * stream.stride > bytes_per_byte * length) {
    return refuse(Code::file_damaged, fmt::format("meshopt: {} elements of {} bytes cannot be in {} bytes",
                                                  stream.count, stream.stride, length));
  }
  return stream;
}

/// Whether the stream is of a version that this library does not know: 1 of the attribute codec.
bool is_newer(const Stream& stream) {
  constexpr std::uint8_t attributes = 0xa0;
  return stream.mode == Mode::attributes && !stream.bytes.empty() && (stream.bytes[0] & 0xf0) == attributes &&
         stream.bytes[0] != attributes;
}

bool decode(const Stream& s, std::uint8_t* out) {
  switch (s.mode) {
    case Mode::triangles:
      return meshopt_decodeIndexBuffer(out, s.count, s.stride, s.bytes.data(), s.bytes.size()) == 0;
    case Mode::indices:
      return meshopt_decodeIndexSequence(out, s.count, s.stride, s.bytes.data(), s.bytes.size()) == 0;
    case Mode::attributes:
      break;
  }
  if (meshopt_decodeVertexBuffer(out, s.count, s.stride, s.bytes.data(), s.bytes.size()) != 0) return false;
  if (s.filter == Filter::octahedral) meshopt_decodeFilterOct(out, s.count, s.stride);
  if (s.filter == Filter::quaternion) meshopt_decodeFilterQuat(out, s.count, s.stride);
  if (s.filter == Filter::exponential) meshopt_decodeFilterExp(out, s.count, s.stride);
  return true;
}

void drop(Json& object, const char* extension) {
  object["extensions"].erase(extension);
  if (object["extensions"].empty()) object.erase("extensions");
}

/// Whether the view's own bytes are in the file.
bool has_plain_bytes(const GltfDocument& document, const Json& view) {
  const auto buffer = static_cast<std::size_t>(index_of(member(view, "buffer")));
  return buffer < document.buffers.size() && !document.buffers[buffer].empty();
}

}  // namespace

Result<void> expand_meshopt(GltfDocument& document) {
  const std::size_t views = array_of(document.json, "bufferViews").size();
  std::size_t budget = 0;  // views that share their bytes do not multiply them
  for (const std::vector<std::uint8_t>& buffer : document.buffers) budget += bytes_per_byte * buffer.size();
  std::vector<std::uint8_t> decoded;
  const std::size_t target = document.buffers.size();
  for (std::size_t i = 0; i < views; ++i) {
    Json& view = document.json["bufferViews"][i];
    const char* name = extension_of(view);
    if (name == nullptr) continue;
    const std::string place = fmt::format("/bufferViews/{}/extensions/{}", i, name);
    const Result<Stream> stream = stream_of(document, view, view["extensions"][name], place);
    if (!stream) return tl::unexpected<Error>(stream.error());
    if (!is_newer(*stream) || !has_plain_bytes(document, view)) {
      const std::size_t size = stream->count * stream->stride;
      if (size > budget) return fail(Code::file_too_large, document.file, place, "meshopt: too many bytes");
      budget -= size;
      if (is_newer(*stream)) {
        return fail(Code::gltf_unsupported, document.file, place,
                    fmt::format("meshopt: version {} of the attribute codec", stream->bytes[0] & 0x0f));
      }
      std::vector<std::uint8_t> bytes(size);
      if (!decode(*stream, bytes.data())) {
        return fail(Code::file_damaged, document.file, place, "meshopt: the stream is damaged");
      }
      decoded.resize((decoded.size() + 15) / 16 * 16);
      view["buffer"] = target;
      view["byteOffset"] = decoded.size();
      decoded.insert(decoded.end(), bytes.begin(), bytes.end());
    }
    drop(view, name);
  }
  for (std::size_t b = 0; b < target; ++b) {
    Json& buffer = document.json["buffers"][b];
    while (const char* name = extension_of(buffer)) drop(buffer, name);
  }
  if (!decoded.empty()) {
    document.json["buffers"].push_back(Json{{"byteLength", decoded.size()}});
    document.buffers.push_back(std::move(decoded));
  }
  for (const char* name : {meshopt, khr_meshopt}) drop_extension(document.json, name);
  return {};
}

}  // namespace selvedge
