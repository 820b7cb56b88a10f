#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/gltf/document.h"
#include "format/gltf/draco.h"
#include "format/gltf/edit.h"
#include "format/gltf/meshopt.h"
#include "format/gltf/names.h"
#include "format/gltf/uri.h"
#include "format/picture/picture_type.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

/// Views keep their place modulo this when they move: more than any component type needs.
constexpr std::size_t alignment = 16;

/// A range of a buffer, and the object that refers to it by "buffer", "byteOffset" and "byteLength": a buffer
/// view, or a similar object of an extension.
struct Range {
  Json* view = nullptr;
  std::size_t buffer = 0;
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Whether the entry of "buffers" declares places of decoded bytes (repack_meshopt), which the file lacks.
bool is_declared_only(const Json& buffer) {
  const Json& extensions = member(buffer, "extensions");
  const auto is_fallback = [](const Json& extension) { return member(extension, "fallback") == true; };
  return is_fallback(member(extensions, names::gltf::meshopt)) ||
         is_fallback(member(extensions, names::gltf::khr_meshopt));
}

/// Finds the ranges in `json`; each gets a "byteOffset", so that the pointers to it stay valid. Views of a
/// buffer that is only declared get it as the second one.
void find_ranges(const GltfDocument& document, Json& json, std::vector<Range>& ranges) {
  const auto buffer = static_cast<std::size_t>(index_of(member(json, "buffer")));
  if (buffer < document.buffers.size() && is_declared_only(document.json["buffers"][buffer])) {
    json["buffer"] = 1;
  } else if (buffer < document.buffers.size()) {
    const std::size_t size = document.buffers[buffer].size();
    const auto begin = static_cast<std::size_t>(std::max(0, index_of(member(json, "byteOffset"))));
    if (begin <= size) {
      json["byteOffset"] = begin;
      // Without a length of its own, an unknown extension's range may reach to the end.
      const std::size_t length = whole_number(member(json, "byteLength")).value_or(size);
      ranges.push_back({&json, buffer, begin, begin + std::min(length, size - begin)});
    }
  }
  if (!json.is_structured()) return;
  for (Json& child : json) find_ranges(document, child, ranges);
}

/// Merges all buffers into one, which is returned, without unused bytes. Overlapping ranges stay together. A
/// buffer that is only declared stays behind it.
Bytes merge_buffers(GltfDocument& document) {
  if (document.buffers.empty()) return {};
  std::vector<Range> ranges;
  find_ranges(document, document.json, ranges);
  std::ranges::sort(ranges, [](const Range& a, const Range& b) {
    return std::pair(a.buffer, a.begin) < std::pair(b.buffer, b.begin);
  });
  Bytes whole;
  for (std::size_t i = 0; i < ranges.size();) {
    const Range first = ranges[i];
    whole.resize(whole.size() + (first.begin % alignment + alignment - whole.size() % alignment) % alignment);
    const std::size_t moved_to = whole.size();
    std::size_t end = first.end;
    do {
      Json& view = *ranges[i].view;
      view["buffer"] = 0;
      view["byteOffset"] = moved_to + (ranges[i].begin - first.begin);
      end = std::max(end, ranges[i].end);
      ++i;
    } while (i < ranges.size() && ranges[i].buffer == first.buffer && ranges[i].begin < end);
    const auto bytes = std::span(document.buffers[first.buffer]).subspan(first.begin, end - first.begin);
    whole.insert(whole.end(), bytes.begin(), bytes.end());
  }
  if (whole.empty()) {
    document.json.erase("buffers");
  } else {
    Json& buffers = document.json["buffers"];
    Json json = buffers[0];
    json.erase("uri");
    json["byteLength"] = whole.size();
    Json merged = Json::array({std::move(json)});
    const auto declared = std::ranges::find_if(buffers, is_declared_only);
    if (declared != buffers.end()) merged.push_back(std::move(*declared));
    buffers = std::move(merged);
  }
  document.buffers.clear();
  return whole;
}

/// Embeds pictures that have a URI; missing ones, and files that are no picture, keep it.
void embed_images(GltfDocument& document) {
  for (std::size_t i = 0; i < array_member(document.json, "images").size(); ++i) {
    const std::string address = string_of(member(document.json["images"][i], "uri"));
    if (address.empty()) continue;
    const bool inlined = address.starts_with("data:");
    const Result<Bytes> bytes = read_image_bytes(document, static_cast<int>(i));
    if (!bytes) continue;
    const int view = append_view(document, *bytes);
    Json& image = document.json["images"][i];
    if (!image.contains("mimeType")) image["mimeType"] = picture_type(*bytes);
    if (!inlined && !image.contains("name")) image["name"] = fs::path(address).stem().string();
    image.erase("uri");
    image["bufferView"] = view;
  }
}

Bytes glb_of(std::string json, Bytes binary) {
  const auto padded = [](std::size_t size) { return (size + 3) / 4 * 4; };
  json.resize(padded(json.size()), ' ');
  binary.resize(padded(binary.size()));
  const std::size_t size = 20 + json.size() + (binary.empty() ? 0 : 8 + binary.size());
  Bytes file;
  file.reserve(size);
  const auto append_words = [&](std::initializer_list<std::size_t> values) {
    for (const std::size_t value : values)
      for (unsigned shift = 0; shift < 32; shift += 8)
        file.push_back(static_cast<std::uint8_t>(value >> shift));
  };
  append_words({0x46546C67, 2, size, json.size(), 0x4E4F534A});
  file.insert(file.end(), json.begin(), json.end());
  if (binary.empty()) return file;
  append_words({binary.size(), 0x004E4942});
  file.insert(file.end(), binary.begin(), binary.end());
  return file;
}

/// "<stem>.bin", unless that is a file the input still needs.
fs::path buffer_path(const GltfDocument& document, const std::set<fs::path>& inputs, const fs::path& output) {
  std::error_code ignored;
  if (fs::equivalent(document.file, output, ignored)) return fs::path(output).replace_extension(".bin");
  for (int i = 0;; ++i) {
    const std::string suffix = i == 0 ? ".bin" : fmt::format("-{}.bin", i);
    fs::path path = output.parent_path() / (output.stem().string() + suffix);
    const bool needed = std::ranges::any_of(
        inputs, [&](const fs::path& input) { return fs::equivalent(input, path, ignored); });
    if (!needed) return path;
  }
}

/// The whole document as one .glb file; `path` names it in messages.
Result<Bytes> pack(GltfDocument& document, const std::string& path) {
  embed_images(document);
  Bytes buffer = merge_buffers(document);
  Bytes file = glb_of(document.json.dump(), std::move(buffer));
  if (file.size() > 0xFFFFFFFF) return fail(Code::file_too_large, path, "", "more than 4 GB");
  return file;
}

Result<StagedGltf> stage(GltfDocument& document, const std::string& path) {
  const fs::path output(path);
  const bool binary = has_ending(output.filename().string(), ".glb");
  if (!binary && !has_ending(output.filename().string(), ".gltf"))
    return fail(Code::option_out_of_range, path, "", "the output has to end in .glb or .gltf");
  std::set<fs::path> inputs;
  for (const Json& buffer : array_member(document.json, "buffers")) {
    const std::string uri = string_of(member(buffer, "uri"));
    const auto input = resolve_uri(document, uri, "");
    if (!uri.empty() && input) inputs.insert(*input);
  }
  document.remarks.clear();
  repack_draco(document);
  repack_meshopt(document);
  rebase_uris(document, output.parent_path().string());
  StagedGltf staged;
  staged.remarks = std::move(document.remarks);
  if (binary) {
    const Bytes file = value_or_throw(pack(document, path));
    staged.byte_count = file.size();
    staged.files.push_back(value_or_throw(stage_file(path, file)));
    return staged;
  }
  Bytes buffer = merge_buffers(document);
  const std::string target = buffer.empty() ? "" : buffer_path(document, inputs, output).string();
  if (!buffer.empty()) document.json["buffers"][0]["uri"] = relative_uri(target, document.folder);
  const std::string text = document.json.dump(2) + "\n";
  AtomicFile file =
      value_or_throw(stage_file(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
  if (!buffer.empty()) staged.files.push_back(value_or_throw(stage_file(target, buffer)));
  staged.files.push_back(std::move(file));
  staged.byte_count = buffer.size() + text.size();
  return staged;
}

}  // namespace

Result<StagedGltf> stage_gltf(GltfDocument document, const std::string& path) {
  return catch_exceptions(path, [&] { return stage(document, path); });
}

Result<std::vector<std::uint8_t>> pack_glb(GltfDocument document) {
  return catch_exceptions(document.file, [&] { return pack(document, document.file); });
}

Result<std::uint64_t> save_gltf(GltfDocument document, const std::string& path) {
  Result<StagedGltf> staged = stage_gltf(std::move(document), path);
  if (!staged) return tl::unexpected(std::move(staged.error()));
  return commit_all(std::move(staged->files)).map([&] { return staged->byte_count; });
}

}  // namespace selvedge
