#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>

#include "format/base/atomic_file.h"
#include "format/gltf/access.h"
#include "format/gltf/document.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

/// Views keep their place modulo this when they move: more than any component type asks for.
constexpr std::size_t alignment = 16;

/// Calls `visit` for every object that names a buffer by number: buffer views, and whatever an extension has
/// that is shaped like one.
void visit_ranges(Json& json, const std::function<void(Json&)>& visit) {
  if (json.is_object() && index_of(member(json, "buffer")) >= 0) visit(json);
  if (!json.is_structured()) return;
  for (Json& child : json) visit_ranges(child, visit);
}

struct Range {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::size_t moved_to = 0;
};

/// Where the ranges of one buffer that are referred to lie in the new one. Overlapping ones stay together.
std::vector<Range> pack(std::vector<Range> ranges, std::size_t& size) {
  std::sort(ranges.begin(), ranges.end(), [](const Range& a, const Range& b) { return a.begin < b.begin; });
  std::vector<Range> merged;
  for (const Range& range : ranges) {
    if (!merged.empty() && range.begin < merged.back().end) {
      merged.back().end = std::max(merged.back().end, range.end);
    } else {
      merged.push_back(range);
    }
  }
  for (Range& range : merged) {
    size += (range.begin % alignment + alignment - size % alignment) % alignment;
    range.moved_to = size;
    size += range.end - range.begin;
  }
  return merged;
}

/// All buffers become one, without the bytes that nothing refers to.
void merge_buffers(GltfDocument& document) {
  std::vector<std::vector<Range>> ranges(document.buffers.size());
  const auto length_of = [&](const Json& view, std::size_t offset, std::size_t size) {
    // Without a length of its own, an unknown extension's range may reach to the end.
    return std::min(size_of(member(view, "byteLength")).value_or(size), size - offset);
  };
  const auto known = [&](Json& view, const std::function<void(std::size_t, std::size_t, std::size_t)>& use) {
    const auto buffer = static_cast<std::size_t>(index_of(member(view, "buffer")));
    if (buffer >= document.buffers.size()) return;
    const auto offset = static_cast<std::size_t>(std::max(0, index_of(member(view, "byteOffset"))));
    if (offset <= document.buffers[buffer].size()) {
      use(buffer, offset, length_of(view, offset, document.buffers[buffer].size()));
    }
  };
  visit_ranges(document.json, [&](Json& view) {
    known(view, [&](std::size_t buffer, std::size_t offset, std::size_t length) {
      ranges[buffer].push_back({offset, offset + length, 0});
    });
  });
  std::size_t size = 0;
  for (std::vector<Range>& list : ranges) list = pack(std::move(list), size);

  if (size == 0) {
    document.json.erase("buffers");
    document.buffers.clear();
    return;
  }
  std::vector<std::uint8_t> whole(size);
  for (std::size_t b = 0; b < ranges.size(); ++b) {
    for (const Range& range : ranges[b]) {
      std::copy(document.buffers[b].begin() + static_cast<std::ptrdiff_t>(range.begin),
                document.buffers[b].begin() + static_cast<std::ptrdiff_t>(range.end),
                whole.begin() + static_cast<std::ptrdiff_t>(range.moved_to));
    }
  }
  visit_ranges(document.json, [&](Json& view) {
    known(view, [&](std::size_t buffer, std::size_t offset, std::size_t) {
      const auto found = std::find_if(ranges[buffer].begin(), ranges[buffer].end(), [&](const Range& range) {
        return offset >= range.begin && (offset < range.end || range.begin == range.end);
      });
      if (found == ranges[buffer].end()) return;
      view["buffer"] = 0;
      view["byteOffset"] = found->moved_to + (offset - found->begin);
    });
  });
  Json json = document.json["buffers"][0];
  json.erase("uri");
  json["byteLength"] = size;
  document.json["buffers"] = Json::array({std::move(json)});
  document.buffers = {std::move(whole)};
}

std::string type_by_content(const std::vector<std::uint8_t>& bytes) {
  constexpr std::array<std::uint8_t, 3> jpeg{0xFF, 0xD8, 0xFF};
  const bool is_jpeg = bytes.size() >= 3 && std::equal(jpeg.begin(), jpeg.end(), bytes.begin());
  return is_jpeg ? "image/jpeg" : "image/png";
}

std::string lower_ending(const std::string& uri) {
  std::string ending = fs::path(uri).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return ending;
}

/// Pictures with a URI go into the file; those that cannot be found keep it.
void embed_images(GltfDocument& document) {
  if (!member(document.json, "images").is_array()) return;
  for (std::size_t i = 0; i < document.json["images"].size(); ++i) {
    const Json& uri = member(document.json["images"][i], "uri");
    if (!uri.is_string()) continue;
    const std::string address = uri.get<std::string>();
    const bool inlined = address.starts_with("data:");
    const auto bytes = read_uri(document, address, "");
    if (!bytes || bytes->empty()) continue;
    const int view = append_view(document, *bytes);
    Json& image = document.json["images"][i];
    if (!image.contains("mimeType")) {
      const std::string ending = inlined ? "" : lower_ending(address);
      image["mimeType"] = ending == ".ktx2"   ? "image/ktx2"
                          : ending == ".webp" ? "image/webp"
                                              : type_by_content(*bytes);
    }
    if (!inlined && !image.contains("name")) image["name"] = fs::path(address).stem().string();
    image.erase("uri");
    image["bufferView"] = view;
  }
}

void append_word(std::vector<std::uint8_t>& bytes, std::size_t value) {
  const auto word = static_cast<std::uint32_t>(value);
  const auto at = bytes.size();
  bytes.resize(at + sizeof word);
  std::memcpy(bytes.data() + at, &word, sizeof word);
}

std::vector<std::uint8_t> glb_of(const std::string& json, const std::vector<std::uint8_t>* binary) {
  const auto padded = [](std::size_t size) { return (size + 3) / 4 * 4; };
  const std::size_t binary_chunk = binary != nullptr ? 8 + padded(binary->size()) : 0;
  std::vector<std::uint8_t> file;
  file.reserve(20 + padded(json.size()) + binary_chunk);
  append_word(file, 0x46546C67);
  append_word(file, 2);
  append_word(file, 20 + padded(json.size()) + binary_chunk);
  append_word(file, padded(json.size()));
  append_word(file, 0x4E4F534A);
  file.insert(file.end(), json.begin(), json.end());
  file.resize(20 + padded(json.size()), ' ');
  if (binary != nullptr) {
    append_word(file, padded(binary->size()));
    append_word(file, 0x004E4942);
    file.insert(file.end(), binary->begin(), binary->end());
    file.resize(padded(file.size()));
  }
  return file;
}

/// "<stem>.bin", unless that is a file the input still needs.
fs::path buffer_path(const GltfDocument& document, const std::set<fs::path>& inputs, const fs::path& output) {
  std::error_code ignored;
  if (fs::equivalent(document.file, output, ignored)) return fs::path(output).replace_extension(".bin");
  for (int i = 0;; ++i) {
    const std::string suffix = i == 0 ? ".bin" : fmt::format("-{}.bin", i);
    fs::path path = output.parent_path() / (output.stem().string() + suffix);
    const bool needed = std::any_of(inputs.begin(), inputs.end(), [&](const fs::path& input) {
      return fs::equivalent(input, path, ignored);
    });
    if (!needed) return path;
  }
}

Result<std::uint64_t> save(GltfDocument& document, const std::string& path) {
  const fs::path output(path);
  const std::string ending = lower_ending(path);
  if (ending != ".glb" && ending != ".gltf") {
    return fail(Code::option_out_of_range, path, "", "the output has to end in .glb or .gltf");
  }
  std::set<fs::path> inputs;
  for (const Json& buffer : member(document.json, "buffers")) {
    const Json& uri = member(buffer, "uri");
    if (!uri.is_string()) continue;
    if (const auto input = resolve_uri(document, uri.get<std::string>(), "")) inputs.insert(*input);
  }
  const bool binary = ending == ".glb";
  move_document(document, output.parent_path().string());
  if (binary) embed_images(document);
  if (!document.buffers.empty()) merge_buffers(document);
  const bool has_buffer = !document.buffers.empty();
  if (binary) {
    const auto file = glb_of(document.json.dump(), has_buffer ? &document.buffers[0] : nullptr);
    if (file.size() > 0xFFFFFFFF) return fail(Code::file_too_large, path, "", "more than 4 GB");
    if (Result<void> good = write_file(path, file); !good) return tl::unexpected<Error>(good.error());
    return file.size();
  }
  // Both or neither: the text is in place last, and only if the buffer could be written.
  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) return tl::unexpected<Error>(std::move(file.error()));
  const fs::path target = has_buffer ? buffer_path(document, inputs, output) : fs::path();
  if (has_buffer) document.json["buffers"][0]["uri"] = relative_uri(target.string(), document.folder);
  const std::string text = document.json.dump(2) + "\n";
  std::uint64_t size = 0;
  if (has_buffer) {
    size += document.buffers[0].size();
    if (Result<void> good = write_file(target.string(), document.buffers[0]); !good) {
      return tl::unexpected<Error>(good.error());
    }
  }
  std::ofstream stream(file->temporary(), std::ios::binary | std::ios::trunc);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (!stream) return fail(Code::file_unwritable, path, "", "cannot be written");
  if (Result<void> good = file->commit(); !good) return tl::unexpected<Error>(std::move(good.error()));
  return size + text.size();
}

}  // namespace

std::string relative_uri(const std::string& target, const std::string& folder) {
  std::error_code error;
  // Absolute first: a relative path of which nothing exists yet would stay relative.
  const fs::path from =
      fs::weakly_canonical(fs::absolute(folder.empty() ? fs::path(".") : fs::path(folder)), error);
  const fs::path to = fs::weakly_canonical(fs::absolute(target), error);
  const std::string path = to.lexically_relative(from).generic_string();
  std::string uri;
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || std::strchr("-._~/", c) != nullptr) {
      uri += c;
    } else {
      uri += fmt::format("%{:02X}", byte);
    }
  }
  return uri;
}

void move_document(GltfDocument& document, const std::string& folder) {
  std::error_code ignored;
  const auto whole = [&](const std::string& name) {
    return fs::weakly_canonical(fs::absolute(name.empty() ? fs::path(".") : fs::path(name)), ignored);
  };
  if (whole(document.folder) != whole(folder)) {
    const auto move_one = [&](Json& entry) {
      const Json& uri = member(entry, names::gltf::uri);
      if (!uri.is_string() || uri.get_ref<const std::string&>().starts_with("data:")) return;
      // An address on the network stays what it is.
      const Result<std::string> path = resolve_uri(document, uri.get<std::string>(), "");
      if (path) entry[names::gltf::uri] = relative_uri(*path, folder);
    };
    const auto move = [&](Json& entries) {
      if (!entries.is_array()) return;
      for (Json& entry : entries) move_one(entry);
    };
    for (const char* list : {"buffers", "images"}) {
      if (document.json.contains(list)) move(document.json[list]);
    }
    const Json& extension = member(member(document.json, "extensions"), names::gltf::fabric_extension);
    if (!member(extension, names::gltf::fabrics).is_null()) {
      move(document.json["extensions"][names::gltf::fabric_extension][names::gltf::fabrics]);
    }
    // The mirrors of the materials' references hold the same URIs.
    const Json& materials = member(document.json, "materials");
    for (std::size_t i = 0; materials.is_array() && i < materials.size(); ++i) {
      if (member(member(materials[i], "extras"), names::gltf::fabric_extension).is_null()) continue;
      move_one(document.json["materials"][i]["extras"][names::gltf::fabric_extension]);
    }
  }
  document.folder = folder;
}

Result<std::uint64_t> save_gltf(GltfDocument document, const std::string& path) {
  try {
    return save(document, path);
  } catch (const std::exception& error) {
    return fail(Code::file_unwritable, path, "", error.what());
  }
}

}  // namespace selvedge
