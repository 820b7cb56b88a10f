#include "format/gltf/container.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <string_view>

#include "format/base/json_text.h"
#include "format/gltf/access.h"
#include "format/gltf/uri.h"

namespace selvedge {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF's numbers are little-endian");

constexpr std::uint32_t json_chunk = 0x4E4F534A;
constexpr std::uint32_t binary_chunk = 0x004E4942;
constexpr std::size_t header_bytes = 12;
constexpr std::size_t chunk_header_bytes = 8;

std::uint32_t word(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

struct Chunks {
  std::string_view json;
  bool has_binary = false;
  std::string_view binary;
};

/// The chunks of a GLB; what is wrong is added to `issues`.
Chunks split(std::string_view bytes, IssueSink& issues) {
  constexpr std::size_t least = header_bytes + chunk_header_bytes;
  Chunks chunks;
  if (bytes.size() < least) {
    issues.add(Code::file_damaged, "header", "cut short");
    return chunks;
  }
  const std::size_t length = word(bytes, 8);
  if (word(bytes, 4) != 2) {
    issues.add(Code::gltf_unsupported, "header", fmt::format("GLB version {}", word(bytes, 4)));
    return chunks;
  }
  if (length > bytes.size() || length < least) {
    issues.add(Code::file_damaged, "header",
               fmt::format("says {} bytes, the file has {}", length, bytes.size()));
    return chunks;
  }
  if (length < bytes.size()) {
    issues.add(Code::gltf_advice, "header",
               fmt::format("{} bytes behind the end of the GLB", bytes.size() - length));
  }
  int number = 0;
  for (std::size_t at = header_bytes; at < length; ++number) {
    const std::string place = fmt::format("byte {}", at);
    if (length - at < chunk_header_bytes || word(bytes, at) > length - at - chunk_header_bytes) {
      issues.add(Code::file_damaged, place, "chunk reaches beyond the end of the file");
      return chunks;
    }
    const std::string_view data = bytes.substr(at + chunk_header_bytes, word(bytes, at));
    const std::uint32_t type = word(bytes, at + 4);
    if (data.size() % 4 != 0)
      issues.add(Code::gltf_malformed, place, fmt::format("chunk of {} bytes", data.size()));
    if ((number == 0) != (type == json_chunk)) {
      issues.add(Code::gltf_malformed, place,
                 number == 0 ? "the first chunk is not JSON" : "a second JSON chunk");
    } else if (type == json_chunk) {
      chunks.json = data;
      if (data.empty()) issues.add(Code::gltf_malformed, place, "empty JSON chunk");
    } else if (type == binary_chunk) {
      chunks.has_binary = true;
      chunks.binary = data;
      if (number != 1) issues.add(Code::gltf_malformed, place, "the binary chunk is not the second one");
    } else {
      issues.add(Code::gltf_advice, place, fmt::format("unknown chunk type 0x{:08x}", type));
    }
    at += chunk_header_bytes + data.size();
  }
  return chunks;
}

/// `begin`: where the text lies in the file; 0: it is the file.
Result<Json> parse(std::string_view text, std::size_t begin, const std::string& file,
                   const GltfLimits& limits) {
  if (text.starts_with("\xEF\xBB\xBF")) {
    return fail(Code::json_malformed, file, "", "begins with a byte order mark");
  }
  const JsonDemands demands = demands_of(text, limits.nesting);
  if (demands.nesting > limits.nesting) {
    return fail(Code::gltf_malformed, file, "",
                fmt::format("JSON is nested deeper than {} levels", limits.nesting));
  }
  if (demands.members > limits.members) {
    return fail(Code::file_too_large, file, "",
                fmt::format("a JSON object with more than {} members", limits.members));
  }
  try {
    Json json = Json::parse(text.begin(), text.end());
    if (!json.is_object()) return fail(Code::gltf_malformed, file, "", "the JSON is not an object");
    if (std::optional<std::string> place = repeated_member(text)) {
      return fail(Code::gltf_malformed, file, std::move(*place), "stands there twice");
    }
    return json;
  } catch (const nlohmann::json::parse_error& error) {
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    if (begin == 0 && (first == std::string_view::npos || text[first] != '{'))
      return fail(Code::json_malformed, file, "", "is neither glTF nor GLB");
    return fail(Code::json_malformed, file, fmt::format("byte {}", begin + error.byte - 1),
                error.byte > text.size() ? "the JSON is cut short" : "is not JSON");
  } catch (const nlohmann::json::out_of_range&) {
    return fail(Code::json_malformed, file, "", "a number that is too large");
  }
}

}  // namespace

std::optional<GltfContainer> read_container(std::span<const std::uint8_t> bytes, const std::string& name,
                                            const GltfLimits& limits, IssueSink& issues) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  Chunks parts;
  GltfContainer container;
  container.is_glb = text.starts_with("glTF");
  if (bytes.size() > limits.file_bytes) {
    issues.add(Code::file_too_large, "", fmt::format("larger than {} bytes", limits.file_bytes));
  } else if (container.is_glb) {
    parts = split(text, issues);
  } else {
    parts.json = text;
  }
  if (issues.has_error()) return std::nullopt;
  const auto begin = static_cast<std::size_t>(parts.json.data() - text.data());
  Result<Json> json = parse(parts.json, begin, name, limits);
  if (!json) {
    issues.add(std::move(json.error()));
    return std::nullopt;
  }
  container.json = std::move(*json);
  container.has_binary = parts.has_binary;
  container.binary.assign(parts.binary.begin(), parts.binary.end());
  return container;
}

Result<std::vector<std::uint8_t>> read_buffer(const GltfDocument& document, GltfContainer& container,
                                              int index, std::uint64_t& room) {
  const std::string place = fmt::format("/buffers/{}", index);
  const auto buffer = entry_of(document, "buffers", index, place);
  if (!buffer) return tl::unexpected<Error>(buffer.error());
  const Json& uri = member(**buffer, "uri");
  const std::optional<std::size_t> size = size_of(member(**buffer, "byteLength"));
  if (!size) return fail(Code::gltf_malformed, document.file, place, "no byteLength");
  std::vector<std::uint8_t> bytes;
  if (uri.is_string()) {
    Result<std::vector<std::uint8_t>> read = read_uri(document, uri.get<std::string>(), place, room);
    if (!read) return read;
    bytes = std::move(*read);
  } else if (index == 0 && container.has_binary) {
    bytes = std::move(container.binary);
  } else if (index == 0 && container.is_glb) {
    return fail(Code::gltf_malformed, document.file, place, "neither a uri nor a binary chunk");
  } else {
    return bytes;  // legal: a place for bytes that come by another way
  }
  if (bytes.size() < *size) {
    return fail(Code::file_damaged, document.file, place,
                fmt::format("cut short: {} of {} bytes", bytes.size(), *size));
  }
  bytes.resize(*size);
  room -= std::min<std::uint64_t>(room, bytes.size());
  return bytes;
}

}  // namespace selvedge
