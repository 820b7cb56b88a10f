#include "format/gltf.h"

#include <fmt/format.h>

// Pictures, animations and the like are never shown to tinygltf, so it needs no decoders for them.
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <exception>
#include <filesystem>
#include <optional>
#include <string_view>

#include "format/atomic_file.h"
#include "format/gltf_access.h"
#include "format/gltf_draco.h"
#include "format/names.h"

namespace selvedge {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF's numbers are little-endian");

/// The two parts of a file: JSON text, and the binary chunk of a GLB.
struct Container {
  std::string_view json;
  std::optional<std::string_view> binary;
};

std::uint32_t word(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

Result<Container> split(std::string_view bytes, const std::string& file) {
  if (bytes.substr(0, 4) != "glTF") return Container{bytes, std::nullopt};
  if (bytes.size() < 20) return fail(Code::file_damaged, file, "header", "cut short");
  if (word(bytes, 4) != 2) {
    return fail(Code::gltf_unsupported, file, "header", fmt::format("GLB version {}", word(bytes, 4)));
  }
  const std::size_t length = word(bytes, 8);
  if (length > bytes.size()) {
    return fail(Code::file_damaged, file, "header",
                fmt::format("cut short: {} of {} bytes", bytes.size(), length));
  }
  Container container;
  bool first = true;
  for (std::size_t at = 12; at < length;) {
    if (length - at < 8) return fail(Code::file_damaged, file, fmt::format("byte {}", at), "chunk cut short");
    const std::size_t size = word(bytes, at);
    const std::uint32_t type = word(bytes, at + 4);
    if (size > length - at - 8) {
      return fail(Code::file_damaged, file, fmt::format("byte {}", at),
                  "chunk reaches beyond the end of the file");
    }
    const std::string_view data = bytes.substr(at + 8, size);
    if (first != (type == 0x4E4F534A)) {
      return fail(Code::gltf_malformed, file, fmt::format("byte {}", at), "chunks are out of order");
    }
    if (first) container.json = data;
    if (type == 0x004E4942 && !container.binary) container.binary = data;
    first = false;
    at += 8 + size;
  }
  if (first) return fail(Code::file_damaged, file, "header", "no JSON chunk");
  return container;
}

/// Deep nesting would exhaust the stack of whoever walks over the JSON recursively.
int nesting_of(std::string_view text) {
  int depth = 0;
  int deepest = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      deepest = std::max(deepest, ++depth);
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return deepest;
}

Result<Json> parse(std::string_view text, const std::string& file, const GltfLimits& limits) {
  if (nesting_of(text) > limits.nesting) {
    return fail(Code::gltf_malformed, file, "",
                fmt::format("JSON is nested deeper than {} levels", limits.nesting));
  }
  try {
    Json json = Json::parse(text.begin(), text.end());
    if (!json.is_object()) return fail(Code::gltf_malformed, file, "", "the JSON is not an object");
    return json;
  } catch (const nlohmann::json::exception& error) {
    return fail(Code::json_malformed, file, "", error.what());
  }
}

bool is_read(std::string_view extension) {
  // Looks only: the geometry is the same without them.
  constexpr std::array<std::string_view, 6> looks{"KHR_materials_", "KHR_texture_", "EXT_texture_",
                                                  "KHR_lights_",    "EXT_lights_",  "SELVEDGE_"};
  return extension == names::gltf::draco || extension == "KHR_mesh_quantization" ||
         extension == "KHR_animation_pointer" ||
         std::any_of(looks.begin(), looks.end(),
                     [&](std::string_view prefix) { return extension.substr(0, prefix.size()) == prefix; });
}

Result<void> check_root(const GltfDocument& document) {
  const Json& version = member(member(document.json, "asset"), "version");
  if (!version.is_string()) {
    return fail(Code::gltf_malformed, document.file, "/asset/version", "no glTF version");
  }
  if (version.get_ref<const std::string&>().substr(0, 2) != "2.") {
    return fail(Code::gltf_unsupported, document.file, "/asset/version",
                "glTF version " + version.get<std::string>());
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

/// What tinygltf gets to see: the geometry. Its own Draco decoder trusts the file, and it refuses compressed
/// index lists without one, so those are hidden; each buffer's URI is its number, see `read_buffer`.
Json geometry_of(const Json& json) {
  Json lean = Json::object();
  for (const char* key :
       {"asset", "scene", "scenes", "nodes", "meshes", "accessors", "bufferViews", "buffers"}) {
    if (json.contains(key)) lean[key] = json[key];
  }
  if (member(lean, "buffers").is_array()) {
    for (std::size_t i = 0; i < lean["buffers"].size(); ++i) {
      if (lean["buffers"][i].is_object()) lean["buffers"][i]["uri"] = std::to_string(i);
    }
  }
  if (member(lean, "meshes").is_array()) {
    for (Json& mesh : lean["meshes"]) {
      if (!member(mesh, "primitives").is_array()) continue;
      for (Json& primitive : mesh["primitives"]) {
        if (!member(member(primitive, "extensions"), names::gltf::draco).is_null()) {
          primitive.erase("indices");
        }
      }
    }
  }
  write_integers_as_such(lean);
  return lean;
}

struct BufferSource {
  const GltfDocument* document;
  std::optional<std::string_view> binary;
  std::optional<Error> error;
};

/// tinygltf's callback: the bytes of the buffer whose number is the file name, cut to its byteLength (files
/// may be longer than that; tinygltf would refuse them).
bool read_buffer(std::vector<unsigned char>* out, std::string*, const std::string& path, void* user) {
  auto& source = *static_cast<BufferSource*>(user);
  const int index = std::stoi(path.substr(path.find_last_of('/') + 1));
  const std::string place = fmt::format("/buffers/{}", index);
  const Json& buffer = source.document->json["buffers"][static_cast<std::size_t>(index)];
  const Json& uri = member(buffer, "uri");
  const Json& length = member(buffer, "byteLength");
  const auto refuse = [&](Code code, std::string message) {
    source.error = Error{code, source.document->file, place, std::move(message)};
    return false;
  };
  const std::optional<std::size_t> size = size_of(length);
  if (!size) return refuse(Code::gltf_malformed, "no byteLength");
  if (uri.is_string()) {
    Result<std::vector<std::uint8_t>> bytes = read_uri(*source.document, uri.get<std::string>(), place);
    if (!bytes) {
      source.error = std::move(bytes.error());
      return false;
    }
    *out = std::move(*bytes);
  } else if (index == 0 && source.binary) {
    out->assign(source.binary->begin(), source.binary->end());
  } else {
    return refuse(Code::gltf_malformed, "neither a uri nor a binary chunk");
  }
  if (out->size() < *size) {
    return refuse(Code::file_damaged, fmt::format("cut short: {} of {} bytes", out->size(), *size));
  }
  out->resize(*size);
  return true;
}

Result<void> load_buffers(GltfDocument& document, std::optional<std::string_view> binary) {
  BufferSource source{&document, binary, std::nullopt};
  tinygltf::Model model;
  std::string errors;
  std::string warnings;
  bool good = false;
  try {
    tinygltf::TinyGLTF loader;
    loader.SetFsCallbacks({[](const std::string&, void*) { return true; },
                           [](const std::string& path, void*) { return path; }, read_buffer, nullptr,
                           &source});
    const std::string text = geometry_of(document.json).dump();
    good = loader.LoadASCIIFromString(&model, &errors, &warnings, text.data(),
                                      static_cast<unsigned int>(text.size()), "");
  } catch (const std::exception& error) {
    errors += error.what();
  }
  if (source.error) return tl::unexpected<Error>(std::move(*source.error));
  if (!good) {
    while (!errors.empty() && (errors.back() == '\n' || errors.back() == '.')) errors.pop_back();
    return fail(Code::gltf_malformed, document.file, "", errors.empty() ? "not a glTF document" : errors);
  }
  for (tinygltf::Buffer& buffer : model.buffers) document.buffers.push_back(std::move(buffer.data));
  return {};
}

}  // namespace

Result<GltfDocument> load_gltf(const std::string& path, const GltfLimits& limits) {
  const Result<std::string> bytes = read_file(path, limits.file_bytes);
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  const Result<Container> container = split(*bytes, path);
  if (!container) return tl::unexpected<Error>(container.error());
  Result<Json> json = parse(container->json, path, limits);
  if (!json) return tl::unexpected<Error>(std::move(json.error()));

  GltfDocument document;
  document.file = path;
  document.folder = std::filesystem::path(path).parent_path().string();
  document.json = std::move(*json);
  if (Result<void> good = check_root(document); !good) return tl::unexpected<Error>(std::move(good.error()));
  if (Result<void> good = load_buffers(document, container->binary); !good) {
    return tl::unexpected<Error>(std::move(good.error()));
  }
  if (Result<void> good = expand_draco(document); !good) {
    return tl::unexpected<Error>(std::move(good.error()));
  }
  return document;
}

Result<std::string> resolve_uri(const GltfDocument& document, const std::string& uri,
                                const std::string& place) {
  const std::size_t colon = uri.find(':');
  if (colon != std::string::npos && colon < uri.find('/')) {
    return fail(Code::gltf_unsupported, document.file, place, "a URI with a scheme: " + uri.substr(0, 40));
  }
  const std::filesystem::path relative(tinygltf::dlib::urldecode(uri));
  return (std::filesystem::path(document.folder) / relative).lexically_normal().string();
}

Result<std::vector<std::uint8_t>> read_uri(const GltfDocument& document, const std::string& uri,
                                           const std::string& place) {
  if (uri.substr(0, 5) == "data:") {
    const std::size_t comma = uri.find(',');
    if (comma == std::string::npos || uri.substr(0, comma).find(";base64") == std::string::npos) {
      return fail(Code::gltf_malformed, document.file, place, "a data URI that is not base64");
    }
    const std::string text = uri.substr(comma + 1);
    const std::string bytes = tinygltf::base64_decode(text);
    const std::size_t digits = text.find_last_not_of('=') + 1;
    // The decoder stops silently at the first character that is not base64.
    if (bytes.size() != digits * 3 / 4) {
      return fail(Code::gltf_malformed, document.file, place, "a data URI with broken base64");
    }
    return std::vector<std::uint8_t>(bytes.begin(), bytes.end());
  }
  const Result<std::string> path = resolve_uri(document, uri, place);
  if (!path) return tl::unexpected<Error>(path.error());
  const Result<std::string> bytes = read_file(*path);
  if (!bytes) {
    return fail(bytes.error().code, document.file, place,
                fmt::format("{}: {}", uri.substr(0, 200), bytes.error().message));
  }
  return std::vector<std::uint8_t>(bytes->begin(), bytes->end());
}

}  // namespace selvedge
