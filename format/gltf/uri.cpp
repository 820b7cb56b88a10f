#include "format/gltf/uri.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>

#include "format/base/atomic_file.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

/// "%20" becomes a space; "+" stays as it is.
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

/// Nothing if the text is not base64; the padding at the end may be missing.
std::optional<Bytes> base64_decoded(std::string_view text) {
  constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::size_t digits = std::min(text.find_first_not_of(alphabet), text.size());
  if (digits % 4 == 1 || text.find_first_not_of('=', digits) != std::string_view::npos) return std::nullopt;
  Bytes bytes;
  bytes.reserve(digits / 4 * 3 + 2);
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < digits; ++i) {
    bits = bits << 6U | static_cast<std::uint32_t>(alphabet.find(text[i]));
    if (i % 4 != 0) bytes.push_back(static_cast<std::uint8_t>(bits >> (6 - 2 * (i % 4))));
  }
  return bytes;
}

fs::path canonical(const std::string& folder) {
  std::error_code ignored;
  // Absolute first: a relative path that does not exist yet would stay relative.
  return fs::weakly_canonical(fs::absolute(folder.empty() ? fs::path(".") : fs::path(folder)), ignored);
}

}  // namespace

Result<std::string> resolve_uri(const GltfDocument& document, const std::string& uri,
                                const std::string& place) {
  const std::size_t colon = uri.find(':');
  if (colon != std::string::npos && colon < uri.find('/')) {
    return fail(Code::gltf_unsupported, document.file, place, "a URI with a scheme: " + uri.substr(0, 40));
  }
  return (fs::path(document.folder) / percent_decoded(uri)).lexically_normal().string();
}

Bytes read_uri(GltfReader& reader, const std::string& uri, const std::string& place, std::uint64_t limit) {
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string::npos) {
      reader.fail(Code::gltf_malformed, place, "a data URI without a comma");
      return {};
    }
    const std::string text = percent_decoded(uri.substr(comma + 1));
    if (!uri.substr(0, comma).ends_with(";base64")) return {text.begin(), text.end()};
    std::optional<Bytes> bytes = base64_decoded(text);
    if (!bytes) reader.fail(Code::gltf_malformed, place, "a data URI with broken base64");
    return std::move(bytes).value_or(Bytes());
  }
  const std::string path = reader.take(resolve_uri(reader.document, uri, place));
  if (!reader.document.external_files)
    reader.fail(Code::gltf_unsupported, place, "other files are not to be opened");
  if (reader.fault) return {};
  const Result<std::string> file = read_file(path, limit);
  if (file) return {file->begin(), file->end()};
  reader.fail(file.error().code, place, fmt::format("{}: {}", uri.substr(0, 200), file.error().message));
  return {};
}

Result<Bytes> read_image_bytes(const GltfDocument& document, int image, std::uint64_t limit) {
  GltfReader reader(document);
  const std::string place = fmt::format("/images/{}", image);
  const Json& json = reader.entry("images", image, place);
  const std::string uri = string_of(member(json, names::gltf::uri));
  Bytes bytes;
  if (!uri.empty()) {
    bytes = read_uri(reader, uri, place, limit);
  } else {
    const auto view = reader.bytes(index_of(member(json, names::gltf::buffer_view)), place);
    bytes.assign(view.begin(), view.end());
  }
  if (bytes.size() > limit) reader.fail(Code::file_too_large, place, "the pictures are too large");
  return reader.result(std::move(bytes));
}

std::string relative_uri(const std::string& target, const std::string& folder) {
  const std::string path = canonical(target).lexically_relative(canonical(folder)).generic_string();
  std::string uri;
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = std::isalnum(byte) != 0 || std::strchr("-._~/", c) != nullptr;
    uri += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return uri;
}

void move_document(GltfDocument& document, const std::string& folder) {
  const auto move = [&](Json& entry) {
    const std::string uri = string_of(member(entry, names::gltf::uri));
    if (uri.empty() || uri.starts_with("data:")) return;
    // An address on the network stays as it is.
    const Result<std::string> path = resolve_uri(document, uri, "");
    if (path) entry[names::gltf::uri] = relative_uri(*path, folder);
  };
  if (canonical(document.folder) != canonical(folder)) {
    const std::string fabrics =
        fmt::format("/extensions/{}/{}", names::gltf::fabric_extension, names::gltf::fabrics);
    for (const Json::json_pointer& list :
         {Json::json_pointer("/buffers"), Json::json_pointer("/images"), Json::json_pointer(fabrics)}) {
      if (!document.json.contains(list) || !document.json[list].is_array()) continue;
      for (Json& entry : document.json[list]) move(entry);
    }
    // The mirrors of the materials' references hold the same URIs.
    for (std::size_t i = 0; i < array_of(document.json, "materials").size(); ++i) {
      Json& material = document.json["materials"][i];
      if (member(member(material, "extras"), names::gltf::fabric_extension).is_null()) continue;
      move(material["extras"][names::gltf::fabric_extension]);
    }
  }
  document.folder = folder;
}

}  // namespace selvedge
