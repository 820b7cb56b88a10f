#include "format/gltf/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "format/base/atomic_file.h"
#include "format/base/foreign.h"
#include "format/base/guard.h"
#include "format/base/json_text.h"
#include "format/gltf/draco.h"
#include "format/gltf/memory.h"
#include "format/gltf/mesh_document.h"
#include "format/gltf/meshopt.h"
#include "format/gltf/names.h"
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

/// The parts of a .gltf or .glb file.
struct Parts {
  std::string_view json;
  bool is_glb = false;
  std::optional<std::string_view> binary;  ///< may be empty
};

/// The chunks of a GLB; its faults are added to `issues`.
Parts split(std::string_view bytes, IssueSink& issues) {
  constexpr std::size_t shortest = header_bytes + chunk_header_bytes;
  Parts parts{{}, true, {}};
  const auto refuse = [&](Code code, const std::string& place, std::string message) {
    issues.add(code, place, std::move(message));
    return parts;
  };
  if (bytes.size() < shortest) return refuse(Code::file_damaged, "header", "cut short");
  const std::size_t length = word(bytes, 8);
  if (word(bytes, 4) != 2)
    return refuse(Code::gltf_unsupported, "header", fmt::format("GLB version {}", word(bytes, 4)));
  if (length > bytes.size() || length < shortest)
    return refuse(Code::file_damaged, "header",
                  fmt::format("says {} bytes, the file has {}", length, bytes.size()));
  if (length < bytes.size())
    issues.add(Code::gltf_advice, "header",
               fmt::format("{} bytes behind the end of the GLB", bytes.size() - length));
  int number = 0;
  for (std::size_t at = header_bytes; at < length; ++number) {
    const std::string place = fmt::format("byte {}", at);
    if (length - at < chunk_header_bytes || word(bytes, at) > length - at - chunk_header_bytes)
      return refuse(Code::file_damaged, place, "chunk reaches beyond the end of the file");
    const std::string_view data = bytes.substr(at + chunk_header_bytes, word(bytes, at));
    const std::uint32_t type = word(bytes, at + 4);
    if (data.size() % 4 != 0)
      issues.add(Code::gltf_malformed, place, fmt::format("chunk of {} bytes", data.size()));
    if ((number == 0) != (type == json_chunk)) {
      issues.add(Code::gltf_malformed, place,
                 number == 0 ? "the first chunk is not JSON" : "a second JSON chunk");
    } else if (type == json_chunk) {
      parts.json = data;
      if (data.empty()) issues.add(Code::gltf_malformed, place, "empty JSON chunk");
    } else if (type == binary_chunk) {
      parts.binary = data;
      if (number != 1) issues.add(Code::gltf_malformed, place, "the binary chunk is not the second one");
    } else {
      issues.add(Code::gltf_advice, place, fmt::format("unknown chunk type 0x{:08x}", type));
    }
    at += chunk_header_bytes + data.size();
  }
  return parts;
}

/// The JSON object in `text`, which begins at byte `begin` of the file (0: it is the file); null after an
/// error.
Json parse(std::string_view text, std::size_t begin, const GltfLimits& limits, MemoryBudget& budget,
           IssueSink& issues) {
  const auto refuse = [&](Code code, std::string place, std::string message) {
    issues.add(code, std::move(place), std::move(message));
    return Json();
  };
  if (text.starts_with("\xEF\xBB\xBF")) {
    issues.add(Code::gltf_advice, "", "the JSON begins with a byte order mark, which glTF forbids");
    text.remove_prefix(3);
    begin += 3;
  }
  const std::uint64_t room =
      budget.try_spend(text.size(), 1) ? budget.unspent_bytes() / bytes_per_json_value : 0;
  try {
    JsonLimits left{limits.nesting, limits.members, room};
    Json json = parse_json(text, left);
    budget.try_spend(room - left.values, bytes_per_json_value);
    if (!json.is_object()) return refuse(Code::gltf_malformed, "", "the JSON is not an object");
    return json;
  } catch (const JsonFault& fault) {
    if (fault.kind == JsonFault::Kind::repeated)
      return refuse(Code::gltf_malformed, fault.place, "duplicate member");
    if (fault.kind == JsonFault::Kind::nesting)
      return refuse(Code::gltf_malformed, "",
                    fmt::format("JSON is nested deeper than {} levels", limits.nesting));
    if (fault.kind == JsonFault::Kind::members)
      return refuse(Code::file_too_large, "",
                    fmt::format("a JSON object with more than {} members", limits.members));
    Error beyond =
        memory_limit_error("", "", fmt::format("more than {} values of JSON", room), limits.memory);
    return refuse(beyond.code, "", std::move(beyond.message));
  } catch (const nlohmann::json::parse_error& error) {
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    if (begin <= 3 && (first == std::string_view::npos || text[first] != '{'))
      return refuse(Code::json_malformed, "",
                    "is neither glTF nor GLB (garments are .gltf, .glb, .obj or .ply)");
    return refuse(Code::json_malformed, fmt::format("byte {}", begin + error.byte - 1),
                  error.byte > text.size() ? "the JSON is cut short" : "is not JSON");
  } catch (const nlohmann::json::out_of_range&) {
    return refuse(Code::json_malformed, "", "a number that is too large");
  }
}

/// The bytes of json["buffers"][index], exactly byteLength of them (files and chunks may be longer); empty
/// for a buffer without a URI whose bytes come by another way. `room`: how many bytes may still be read; less
/// afterwards.
Bytes read_buffer(const GltfDocument& document, const Parts& parts, int index, std::uint64_t& room) {
  GltfReader reader(document);
  const std::string place = fmt::format("/buffers/{}", index);
  const Json& buffer = reader.entry("buffers", index, place);
  const Json& uri = member(buffer, "uri");
  const std::optional<std::size_t> size = whole_number(member(buffer, "byteLength"));
  if (!size) reader.fail(Code::gltf_malformed, place, "no byteLength");
  Bytes bytes;
  if (uri.is_string())
    bytes = read_uri(reader, uri.get<std::string>(), place, room);
  else if (index == 0 && parts.binary)
    bytes.assign(parts.binary->begin(), parts.binary->end());
  else if (index == 0 && parts.is_glb)
    reader.fail(Code::gltf_malformed, place, "neither a uri nor a binary chunk");
  else
    return {};  // legal: a place for bytes that come by another way
  if (bytes.size() < *size)
    reader.fail(Code::file_damaged, place, fmt::format("cut short: {} of {} bytes", bytes.size(), *size));
  bytes.resize(*size);
  room -= std::min<std::uint64_t>(room, bytes.size());
  return bytes;
}

/// Whether a document that requires the extension is read.
bool is_read(std::string_view extension) {
  // Materials only: the geometry is the same without them.
  constexpr std::array<std::string_view, 6> materials{"KHR_materials_", "KHR_texture_", "EXT_texture_",
                                                      "KHR_lights_",    "EXT_lights_",  "SELVEDGE_"};
  constexpr std::array<std::string_view, 7> geometry{names::gltf::draco,          names::gltf::meshopt,
                                                     names::gltf::khr_meshopt,    names::gltf::gpu_instancing,
                                                     "KHR_mesh_quantization",     "KHR_animation_pointer",
                                                     names::gltf::node_visibility};
  return std::ranges::find(geometry, extension) != geometry.end() ||
         std::ranges::any_of(materials,
                             [&](std::string_view prefix) { return extension.starts_with(prefix); });
}

void check_version(const Json& asset, IssueSink& issues) {
  const Json& version = member(asset, "version");
  const Json& minimum = member(asset, "minVersion");
  if (!version.is_string()) {
    issues.add(Code::gltf_malformed, "/asset/version",
               asset.is_null() ? "no glTF version: the JSON is of another program" : "no glTF version");
  } else if (!string_of(version).starts_with("2.")) {
    issues.add(Code::gltf_unsupported, "/asset/version", "glTF version " + string_of(version));
  } else if (!minimum.is_null() && string_of(minimum) != "2.0") {
    issues.add(Code::gltf_unsupported, "/asset/minVersion", "at least glTF " + minimum.dump());
  }
}

/// Checks that the root's lists are lists: the code that edits a document appends to them.
void check_lists(const Json& root, IssueSink& issues) {
  constexpr std::array objects{"accessors", "bufferViews", "buffers",  "cameras", "images", "materials",
                               "meshes",    "nodes",       "samplers", "scenes",  "skins",  "textures"};
  constexpr std::array names{"extensionsUsed", "extensionsRequired"};
  const auto check = [&](const char* list, const char* kind, bool (Json::*is_kind)() const noexcept) {
    const Json& entries = member(root, list);
    if (!entries.is_null() && !entries.is_array())
      issues.add(Code::gltf_malformed, fmt::format("/{}", list), "is not an array");
    for (std::size_t i = 0; entries.is_array() && i < entries.size(); ++i)
      if (!(entries[i].*is_kind)())
        issues.add(Code::gltf_malformed, fmt::format("/{}/{}", list, i), fmt::format("is not {}", kind));
  };
  for (const char* list : objects) check(list, "an object", &Json::is_object);
  for (const char* list : names) check(list, "a string", &Json::is_string);
  const Json& required = array_member(root, "extensionsRequired");
  for (std::size_t i = 0; i < required.size(); ++i) {
    const std::string name = string_of(required[i]);
    if (!name.empty() && !is_read(name))
      issues.add(Code::gltf_unsupported, fmt::format("/extensionsRequired/{}", i), name + " is required");
  }
}

}  // namespace

Result<GltfDocument> load_gltf(const std::string& path, const GltfLimits& limits) {
  const Result<std::string> bytes = read_file(path, std::min(limits.file_bytes, limits.memory));
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  return load_gltf({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()}, path, limits);
}

Result<GltfDocument> load_gltf(std::span<const std::uint8_t> bytes, const std::string& path,
                               const GltfLimits& limits) {
  IssueSink issues(path);
  std::optional<GltfDocument> document = load_gltf(bytes, path, limits, issues);
  if (!document) return tl::unexpected<Error>(issues.first_error());
  return std::move(*document);
}

std::optional<GltfDocument> load_gltf(std::span<const std::uint8_t> bytes, const std::string& path,
                                      const GltfLimits& limits, IssueSink& issues) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  Parts parts{text, false, {}};
  MemoryBudget budget(limits.memory);
  if (bytes.size() > limits.file_bytes) {
    issues.add(Code::file_too_large, "", fmt::format("larger than {} bytes", limits.file_bytes));
  } else if (const std::string_view kind = foreign_file_message(text); !kind.empty()) {
    issues.add(Code::gltf_unsupported, "", std::string(kind));
  } else if (is_mesh_file(text, path)) {
    Result<GltfDocument> read = load_mesh_document(text, path, limits);
    if (read) return std::move(*read);
    issues.add(std::move(read.error()));
  } else if (text.starts_with("glTF")) {
    parts = split(text, issues);
  }
  if (issues.has_error()) return std::nullopt;
  GltfDocument document;
  document.file = path;
  document.folder = std::filesystem::path(path).parent_path().string();
  document.external_files = limits.external_files;
  document.json =
      parse(parts.json, static_cast<std::size_t>(parts.json.data() - text.data()), limits, budget, issues);
  if (issues.has_error()) return std::nullopt;
  check_version(member(document.json, "asset"), issues);
  check_lists(document.json, issues);
  if (limits.external_files == ExternalFiles::in_folder) find_outside_uris(document, issues);
  if (issues.has_error()) return std::nullopt;
  redirect_missing_files(document);
  for (const std::string& remark : document.remarks) issues.add(Code::gltf_advice, "", remark);
  std::uint64_t room = std::min(limits.buffer_bytes, budget.unspent_bytes());
  for (int i = 0; i < static_cast<int>(array_member(document.json, "buffers").size()); ++i) {
    auto buffer = catch_failure([&] { return read_buffer(document, parts, i, room); });
    if (!buffer) issues.add(std::move(buffer.error()));
    document.buffers.push_back(std::move(buffer).value_or(Bytes()));
  }
  for (const auto expand : {expand_meshopt, expand_draco}) {
    if (issues.has_error()) return std::nullopt;
    if (const auto good = catch_failure([&] { expand(document); }); !good) issues.add(good.error());
  }
  if (issues.has_error()) return std::nullopt;
  std::uint64_t bytes_held = 0;
  for (const Bytes& buffer : document.buffers) bytes_held += buffer.size();
  if (!budget.try_spend(bytes_held, 1)) {
    issues.add(memory_limit_error(path, "/buffers", "its buffers", limits.memory));
    return std::nullopt;
  }
  if (!document.buffers.empty())
    document.original_encoding.known_end = {document.buffers.size() - 1, document.buffers.back().size()};
  document.memory_used = limits.memory - budget.unspent_bytes();
  return document;
}

}  // namespace selvedge
