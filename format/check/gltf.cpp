#include "format/check/gltf.h"

#include <fmt/format.h>

#include <set>

#include "format/base/atomic_file.h"
#include "format/check/gltf_parts.h"
#include "format/gltf/access.h"
#include "format/gltf/container.h"
#include "format/gltf/meshopt.h"
#include "format/gltf/names.h"
#include "format/gltf/read_scene.h"

namespace selvedge {
namespace {

void check_asset(const Json& root, IssueSink& issues) {
  const Json& version = member(member(root, "asset"), "version");
  const Json& least = member(member(root, "asset"), "minVersion");
  const auto is_version = [](const std::string& text) {
    const std::size_t dot = text.find('.');
    return dot != std::string::npos && dot > 0 && dot + 1 < text.size() &&
           text.find_first_not_of("0123456789.") == std::string::npos &&
           text.find('.', dot + 1) == std::string::npos;
  };
  for (const Json* text : {&version, &least}) {
    const char* place = text == &version ? "/asset/version" : "/asset/minVersion";
    if (!text->is_string()) continue;
    const std::string value = text->get<std::string>();
    if (!is_version(value)) {
      issues.add(Code::gltf_malformed, place, fmt::format("\"{}\" is no version", value));
    } else if (!value.starts_with("2.")) {
      issues.add(Code::gltf_unsupported, place, fmt::format("glTF version {}", value));
    } else if (value != "2.0" && text == &least) {
      issues.add(version == least ? Code::gltf_unsupported : Code::gltf_malformed, place,
                 fmt::format("at least glTF {} is wanted", value));
    }
  }
}

/// What a data URI of a buffer says of itself: "data:TYPE;NAME=VALUE;base64,".
void check_data_uri(const std::string& uri, const std::string& place, IssueSink& issues) {
  const std::string head = uri.substr(5, std::min(uri.find(','), uri.size()) - 5);
  const std::string type = head.substr(0, head.find(';'));
  if (type != "application/octet-stream" && type != "application/gltf-buffer") {
    issues.add(Code::gltf_malformed, place, fmt::format("\"{}\" is no media type of a buffer", type));
  }
  for (std::size_t at = type.size(); at < head.size();) {
    const std::size_t end = std::min(head.find(';', at + 1), head.size());
    const std::string part = head.substr(at + 1, end - at - 1);
    if (part.find('=') == std::string::npos && (part != "base64" || end != head.size())) {
      issues.add(Code::gltf_malformed, place, fmt::format("a data URI with the parameter \"{}\"", part));
    }
    at = end;
  }
}

void check_buffers(GltfDocument& document, GltfContainer& container, std::uint64_t room, IssueSink& issues) {
  const Json& buffers = member(document.json, "buffers");
  for (std::size_t i = 0; buffers.is_array() && i < buffers.size(); ++i) {
    const std::string place = fmt::format("/buffers/{}", i);
    const Json& uri = member(buffers[i], "uri");
    if (uri.is_string() && uri.get_ref<const std::string&>().starts_with("data:")) {
      check_data_uri(uri.get<std::string>(), place + "/uri", issues);
    }
    auto bytes = read_buffer(document, container, static_cast<int>(i), room);
    if (!bytes) {
      issues.add(bytes.error());
    } else if (bytes->empty() && !is_meshopt_fallback(document.json, static_cast<int>(i))) {
      issues.add(Code::gltf_advice, place, "says nowhere where its bytes are");
    }
    document.buffers.push_back(bytes ? std::move(*bytes) : std::vector<std::uint8_t>());
  }
}

/// The lists of extensions, and every extension that is used.
class ExtensionCheck {
 public:
  ExtensionCheck(const Json& root, IssueSink& issues) : issues_(issues) {
    collect(root, "extensionsUsed", used_);
    std::set<std::string> required;
    collect(root, "extensionsRequired", required);
    for (const std::string& name : required) {
      if (!used_.contains(name)) {
        issues_.add(Code::gltf_malformed, "/extensionsRequired", name + " is not in extensionsUsed");
      } else if (!is_read(name)) {
        issues_.add(Code::gltf_unsupported, "/extensionsRequired", name + " is required");
      }
    }
    walk(root, "");
  }

 private:
  void collect(const Json& root, const char* list, std::set<std::string>& names) {
    const Json& array = member(root, list);
    for (std::size_t i = 0; array.is_array() && i < array.size(); ++i) {
      if (array[i].is_string()) names.insert(array[i].get<std::string>());
    }
  }

  void walk(const Json& json, const std::string& place) {
    if (json.is_array()) {
      for (std::size_t i = 0; i < json.size(); ++i) {
        if (json[i].is_structured()) walk(json[i], fmt::format("{}/{}", place, i));
      }
    } else if (json.is_object()) {
      for (const auto& [name, value] : json.items()) {
        if (name == "extras" || !value.is_structured()) continue;
        const std::string below = pointer_to(place, name);
        if (name == "extensions") check_names(value, below);
        walk(value, below);
      }
    }
  }

  void check_names(const Json& extensions, const std::string& place) {
    if (!extensions.is_object()) return;
    for (const auto& [name, value] : extensions.items()) {
      if (used_.contains(name) || !reported_.insert(name).second) continue;
      const bool ours = name == names::gltf::fabric_extension;
      issues_.add(ours ? Code::gltf_extension : Code::gltf_malformed, pointer_to(place, name),
                  "the extension is not in extensionsUsed");
    }
  }

  IssueSink& issues_;
  std::set<std::string> used_;
  std::set<std::string> reported_;
};

}  // namespace

std::string excerpt(const Json& value) {
  constexpr std::size_t most = 40;
  std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() <= most) return text;
  std::size_t end = most - 3;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;  // whole characters
  return text.substr(0, end) + "...";
}

Issues check_gltf(const std::string& path, const GltfCheckLimits& limits, Scene* scene) {
  const Result<std::string> file = read_file(path, limits.read.file_bytes);
  if (!file) return {file.error()};
  return check_gltf({reinterpret_cast<const std::uint8_t*>(file->data()), file->size()}, path, limits, scene);
}

Issues check_gltf(std::span<const std::uint8_t> bytes, const std::string& path, const GltfCheckLimits& limits,
                  Scene* scene) {
  Issues outer;
  std::optional<GltfContainer> container = read_container(bytes, path, limits.read, outer);
  IssueSink issues(path, limits.issues);
  issues.add(outer);
  if (!container) return issues.take();

  GltfDocument document = document_of(path, std::move(container->json), limits.read);
  check_asset(document.json, issues);
  check_schema(document.json, issues);
  const ExtensionCheck extensions(document.json, issues);
  check_buffers(document, *container, limits.read.buffer_bytes, issues);
  if (!issues.has_error()) {  // else decoding would name the same faults again
    if (Result<void> good = expand_meshopt(document); !good) issues.add(good.error());
  }
  check_data(document, issues);
  check_meshes(document, issues);
  check_nodes(document, issues);
  check_images(document, issues);
  check_fabrics(document, issues);
  if (issues.has_error()) return issues.take();

  // What is left can only be seen by reading it: compressed data, and tinygltf's opinion.
  if (Result<void> good = expand(document); !good) {
    issues.add(good.error());
  } else if (Result<Scene> read = read_scene(document); !read) {
    issues.add(read.error());
  } else if (scene != nullptr) {
    *scene = std::move(*read);
  }
  return issues.take();
}

}  // namespace selvedge
