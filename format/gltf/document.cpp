#include "format/gltf/document.h"

#include <fmt/format.h>

// Pictures, animations and the like are never shown to tinygltf, so it needs no decoders for them. Another
// name for its namespace: a program that links with us may have a tinygltf of its own.
#define tinygltf tinygltf_of_selvedge
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <filesystem>
#include <string_view>

#include "format/base/atomic_file.h"
#include "format/gltf/access.h"
#include "format/gltf/container.h"
#include "format/gltf/draco.h"
#include "format/gltf/meshopt.h"
#include "format/gltf/names.h"

namespace selvedge {

bool is_read(std::string_view extension) {
  // Materials only: the geometry is the same without them.
  constexpr std::array<std::string_view, 6> looks{"KHR_materials_", "KHR_texture_", "EXT_texture_",
                                                  "KHR_lights_",    "EXT_lights_",  "SELVEDGE_"};
  constexpr std::array<std::string_view, 6> geometry{names::gltf::draco,       names::gltf::meshopt,
                                                     names::gltf::khr_meshopt, names::gltf::gpu_instancing,
                                                     "KHR_mesh_quantization",  "KHR_animation_pointer"};
  return std::find(geometry.begin(), geometry.end(), extension) != geometry.end() ||
         std::any_of(looks.begin(), looks.end(),
                     [&](std::string_view prefix) { return extension.substr(0, prefix.size()) == prefix; });
}

namespace {

Result<void> check_root(const GltfDocument& document) {
  const Json& version = member(member(document.json, "asset"), "version");
  if (!version.is_string()) {
    return fail(Code::gltf_malformed, document.file, "/asset/version", "no glTF version");
  }
  if (version.get_ref<const std::string&>().substr(0, 2) != "2.") {
    return fail(Code::gltf_unsupported, document.file, "/asset/version",
                "glTF version " + version.get<std::string>());
  }
  const Json& least = member(member(document.json, "asset"), "minVersion");
  if (!least.is_null() && least != "2.0") {
    return fail(Code::gltf_unsupported, document.file, "/asset/minVersion", "at least glTF " + least.dump());
  }
  const Json& required = member(document.json, "extensionsRequired");
  for (std::size_t i = 0; required.is_array() && i < required.size(); ++i) {
    const std::string place = fmt::format("/extensionsRequired/{}", i);
    if (!required[i].is_string()) return fail(Code::gltf_malformed, document.file, place, "not a string");
    const std::string name = required[i].get<std::string>();
    if (!is_read(name)) {
      return fail(Code::gltf_unsupported, document.file, place, fmt::format("{} is required", name));
    }
  }
  return {};
}

/// JSON has one kind of number: 24.0 is as good a count as 24, but not to tinygltf.
void write_integers_as_such(Json& json) {
  if (json.is_number_float()) {
    const double value = json.get<double>();
    if (value == std::floor(value) && std::abs(value) < 1e15) json = static_cast<std::int64_t>(value);
  } else if (json.is_structured()) {
    for (Json& child : json) write_integers_as_such(child);
  }
}

/// What tinygltf gets to see: the geometry. It refuses index lists that are compressed or all zeros, so those
/// are hidden, and empty buffers, which get a byte; each buffer's URI is its number, see `hand_over_buffer`.
Json geometry_of(const GltfDocument& document) {
  const Json& json = document.json;
  Json lean = Json::object();
  for (const char* key :
       {"asset", "scene", "scenes", "nodes", "meshes", "accessors", "bufferViews", "buffers"}) {
    if (json.contains(key)) lean[key] = json[key];
  }
  if (member(lean, "buffers").is_array()) {
    for (std::size_t i = 0; i < lean["buffers"].size(); ++i) {
      lean["buffers"][i]["uri"] = std::to_string(i);
      lean["buffers"][i]["byteLength"] = std::max<std::size_t>(document.buffers[i].size(), 1);
    }
  }
  if (member(lean, "meshes").is_array()) {
    for (Json& mesh : lean["meshes"]) {
      if (!member(mesh, "primitives").is_array()) continue;
      for (Json& primitive : mesh["primitives"]) {
        if (primitive.is_object()) primitive.erase("indices");
      }
    }
  }
  write_integers_as_such(lean);
  return lean;
}

struct BufferShelf {
  std::vector<std::vector<std::uint8_t>>& buffers;
};

/// tinygltf's callback: the bytes of the buffer whose number is the file name. They have been read already.
bool hand_over_buffer(std::vector<unsigned char>* out, std::string*, const std::string& path, void* user) {
  auto& shelf = *static_cast<BufferShelf*>(user);
  *out = std::move(shelf.buffers[std::stoul(path.substr(path.find_last_of('/') + 1))]);
  if (out->empty()) out->push_back(0);
  return true;
}

/// A second opinion on what our own checks have passed.
Result<void> pass_tinygltf(GltfDocument& document) {
  std::vector<std::size_t> sizes;
  for (const std::vector<std::uint8_t>& buffer : document.buffers) sizes.push_back(buffer.size());
  BufferShelf shelf{document.buffers};
  tinygltf::Model model;
  std::string errors;
  std::string warnings;
  bool good = false;
  try {
    tinygltf::TinyGLTF loader;
    loader.SetFsCallbacks({[](const std::string&, void*) { return true; },
                           [](const std::string& path, void*) { return path; }, hand_over_buffer, nullptr,
                           &shelf});
    const std::string text = geometry_of(document).dump();
    good = loader.LoadASCIIFromString(&model, &errors, &warnings, text.data(),
                                      static_cast<unsigned int>(text.size()), "");
  } catch (const std::exception& error) {
    errors += error.what();
  }
  if (!good) {
    while (!errors.empty() && (errors.back() == '\n' || errors.back() == '.')) errors.pop_back();
    return fail(Code::gltf_malformed, document.file, "", errors.empty() ? "not a glTF document" : errors);
  }
  for (std::size_t i = 0; i < document.buffers.size(); ++i) {
    if (sizes[i] > 0) document.buffers[i] = std::move(model.buffers[i].data);
  }
  return {};
}

}  // namespace

Result<GltfDocument> load_gltf(const std::string& path, const GltfLimits& limits) {
  const Result<std::string> bytes = read_file(path, limits.file_bytes);
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  return load_gltf({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()}, path, limits);
}

Result<GltfDocument> load_gltf(std::span<const std::uint8_t> bytes, const std::string& path,
                               const GltfLimits& limits) {
  Issues issues;
  std::optional<GltfContainer> container = read_container(bytes, path, limits, issues);
  for (Error& issue : issues) {
    if (severity_of(issue.code) == Severity::error) return tl::unexpected<Error>(std::move(issue));
  }
  GltfDocument document = document_of(path, std::move(container->json), limits);
  if (Result<void> good = check_root(document); !good) return tl::unexpected<Error>(std::move(good.error()));
  const Json& buffers = member(document.json, "buffers");
  std::uint64_t room = limits.buffer_bytes;
  for (std::size_t i = 0; buffers.is_array() && i < buffers.size(); ++i) {
    auto buffer = read_buffer(document, *container, static_cast<int>(i), room);
    if (!buffer) return tl::unexpected<Error>(std::move(buffer.error()));
    document.buffers.push_back(std::move(*buffer));
  }
  for (Result<void> (*step)(GltfDocument&) : {expand_meshopt, expand}) {
    if (Result<void> good = step(document); !good) return tl::unexpected<Error>(std::move(good.error()));
  }
  return document;
}

GltfDocument document_of(const std::string& path, Json json, const GltfLimits& limits) {
  GltfDocument document;
  document.file = path;
  document.folder = std::filesystem::path(path).parent_path().string();
  document.external_files = limits.external_files;
  document.json = std::move(json);
  return document;
}

Result<void> expand(GltfDocument& document) {
  if (Result<void> good = pass_tinygltf(document); !good) return good;
  return expand_draco(document);
}

namespace {

/// "%20" becomes a space; "+" stays what it is.
std::string percent_decoded(const std::string& text) {
  const auto digit = [&](std::size_t at) {
    const char c = at < text.size() ? text[at] : '\0';
    if (c >= '0' && c <= '9') return c - '0';
    const char lower = static_cast<char>(c | 0x20);
    return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
  };
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && digit(i + 1) >= 0 && digit(i + 2) >= 0) {
      decoded += static_cast<char>(digit(i + 1) * 16 + digit(i + 2));
      i += 2;
    } else {
      decoded += text[i];
    }
  }
  return decoded;
}

}  // namespace

Result<std::string> resolve_uri(const GltfDocument& document, const std::string& uri,
                                const std::string& place) {
  const std::size_t colon = uri.find(':');
  if (colon != std::string::npos && colon < uri.find('/')) {
    return fail(Code::gltf_unsupported, document.file, place, "a URI with a scheme: " + uri.substr(0, 40));
  }
  const std::filesystem::path relative(percent_decoded(uri));
  return (std::filesystem::path(document.folder) / relative).lexically_normal().string();
}

Result<std::vector<std::uint8_t>> read_uri(const GltfDocument& document, const std::string& uri,
                                           const std::string& place, std::uint64_t limit) {
  if (uri.substr(0, 5) == "data:") {
    const std::size_t comma = uri.find(',');
    if (comma == std::string::npos) {
      return fail(Code::gltf_malformed, document.file, place, "a data URI without a comma");
    }
    const std::string text = percent_decoded(uri.substr(comma + 1));
    if (!uri.substr(0, comma).ends_with(";base64"))
      return std::vector<std::uint8_t>(text.begin(), text.end());
    constexpr const char* alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const std::size_t digits = std::min(text.find_first_not_of(alphabet), text.size());
    // The decoder stops silently at the first character that is not base64.
    if (digits % 4 == 1 || text.find_first_not_of('=', digits) != std::string::npos) {
      return fail(Code::gltf_malformed, document.file, place, "a data URI with broken base64");
    }
    const std::string bytes = tinygltf::base64_decode(text);
    return std::vector<std::uint8_t>(bytes.begin(), bytes.end());
  }
  const Result<std::string> path = resolve_uri(document, uri, place);
  if (!path) return tl::unexpected<Error>(path.error());
  if (!document.external_files) {
    return fail(Code::gltf_unsupported, document.file, place, "other files are not to be opened");
  }
  const Result<std::string> bytes = read_file(*path, limit);
  if (!bytes) {
    return fail(bytes.error().code, document.file, place,
                fmt::format("{}: {}", uri.substr(0, 200), bytes.error().message));
  }
  return std::vector<std::uint8_t>(bytes->begin(), bytes->end());
}

}  // namespace selvedge
