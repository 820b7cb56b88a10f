#include "format/gltf/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>

#include "format/base/atomic_file.h"
#include "format/gltf/access.h"
#include "format/gltf/container.h"
#include "format/gltf/draco.h"
#include "format/gltf/meshopt.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

/// Whether a document that requires the extension can be read.
bool is_read(std::string_view extension) {
  // Materials only: the geometry is the same without them.
  constexpr std::array<std::string_view, 6> materials{"KHR_materials_", "KHR_texture_", "EXT_texture_",
                                                      "KHR_lights_",    "EXT_lights_",  "SELVEDGE_"};
  constexpr std::array<std::string_view, 6> geometry{names::gltf::draco,       names::gltf::meshopt,
                                                     names::gltf::khr_meshopt, names::gltf::gpu_instancing,
                                                     "KHR_mesh_quantization",  "KHR_animation_pointer"};
  return std::find(geometry.begin(), geometry.end(), extension) != geometry.end() ||
         std::any_of(materials.begin(), materials.end(),
                     [&](std::string_view prefix) { return extension.starts_with(prefix); });
}

void check_version(const Json& asset, IssueSink& issues) {
  const Json& version = member(asset, "version");
  const Json& least = member(asset, "minVersion");
  if (!version.is_string()) {
    issues.add(Code::gltf_malformed, "/asset/version", "no glTF version");
  } else if (!string_of(version).starts_with("2.")) {
    issues.add(Code::gltf_unsupported, "/asset/version", "glTF version " + string_of(version));
  } else if (!least.is_null() && string_of(least) != "2.0") {
    issues.add(Code::gltf_unsupported, "/asset/minVersion", "at least glTF " + least.dump());
  }
}

/// That the root's lists are lists: the code that edits a document appends to them.
void check_lists(const Json& root, IssueSink& issues) {
  constexpr std::array objects{"accessors", "bufferViews", "buffers",  "cameras", "images", "materials",
                               "meshes",    "nodes",       "samplers", "scenes",  "skins",  "textures"};
  constexpr std::array names{"extensionsUsed", "extensionsRequired"};
  const auto check = [&](const char* list, const char* kind, bool (Json::*is_kind)() const noexcept) {
    const Json& entries = member(root, list);
    if (!entries.is_null() && !entries.is_array())
      issues.add(Code::gltf_malformed, fmt::format("/{}", list), "is not an array");
    for (std::size_t i = 0; entries.is_array() && i < entries.size(); ++i) {
      if (!(entries[i].*is_kind)())
        issues.add(Code::gltf_malformed, fmt::format("/{}/{}", list, i), fmt::format("is not {}", kind));
    }
  };
  for (const char* list : objects) check(list, "an object", &Json::is_object);
  for (const char* list : names) check(list, "a string", &Json::is_string);
  const Json& required = array_of(root, "extensionsRequired");
  for (std::size_t i = 0; i < required.size(); ++i) {
    const std::string name = string_of(required[i]);
    if (!name.empty() && !is_read(name)) {
      issues.add(Code::gltf_unsupported, fmt::format("/extensionsRequired/{}", i), name + " is required");
    }
  }
}

}  // namespace

Result<GltfDocument> load_gltf(const std::string& path, const GltfLimits& limits) {
  const Result<std::string> bytes = read_file(path, limits.file_bytes);
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
  std::optional<GltfContainer> container = read_container(bytes, path, limits, issues);
  if (!container) return std::nullopt;
  GltfDocument document;
  document.file = path;
  document.folder = std::filesystem::path(path).parent_path().string();
  document.external_files = limits.external_files;
  document.json = std::move(container->json);
  check_version(member(document.json, "asset"), issues);
  check_lists(document.json, issues);
  std::uint64_t room = limits.buffer_bytes;
  for (int i = 0; i < static_cast<int>(array_of(document.json, "buffers").size()); ++i) {
    auto buffer = read_buffer(document, *container, i, room);
    if (!buffer) issues.add(buffer.error());
    document.buffers.push_back(buffer ? std::move(*buffer) : std::vector<std::uint8_t>());
  }
  for (Result<void> (*expand)(GltfDocument&) : {expand_meshopt, expand_draco}) {
    if (issues.has_error()) return std::nullopt;
    if (Result<void> good = expand(document); !good) issues.add(good.error());
  }
  if (issues.has_error()) return std::nullopt;
  return document;
}

}  // namespace selvedge
