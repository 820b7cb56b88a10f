#include "format/gltf/uri.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <optional>
#include <set>
#include <string_view>

#include "format/base/atomic_file.h"
#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/gltf/names.h"
#include "format/picture/picture_type.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

/// "%20" becomes a space; "+" stays as it is.
std::string percent_decoded(const std::string& text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned code = 0;
    const char* const end = text.data() + i + 3;
    if (text[i] == '%' && i + 2 < text.size() && std::from_chars(end - 2, end, code, 16).ptr == end) {
      decoded += static_cast<char>(code);
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

/// Empty after an error.
fs::path canonical(const std::string& path, std::error_code& error) {
  // Absolute first: a relative path that does not exist yet would stay relative.
  const fs::path absolute = fs::absolute(path.empty() ? fs::path(".") : fs::path(path), error);
  return error ? fs::path() : fs::weakly_canonical(absolute, error);
}

fs::path canonical(const std::string& path) {
  std::error_code ignored;
  return canonical(path, ignored);
}

/// Visits the objects of a document that name a file by "uri", with their JSON pointers.
template <class Root, class F>
void for_each_uri(Root& root, const F& visit) {
  for (const std::string& list :
       {std::string("/buffers"), std::string("/images"),
        fmt::format("/extensions/{}/{}", names::gltf::fabric_extension, names::gltf::fabrics)}) {
    const Json::json_pointer at(list);
    if (!root.contains(at) || !root[at].is_array()) continue;
    for (std::size_t i = 0; i < root[at].size(); ++i) visit(root[at][i], fmt::format("{}/{}", list, i));
  }
}

/// Whether a URI names a file, rather than holding its bytes.
bool names_file(const std::string& uri) { return !uri.empty() && !uri.starts_with("data:"); }

/// The path that a URI names, wherever it lies.
Result<std::string> path_of(const GltfDocument& document, const std::string& uri, const std::string& place) {
  const std::size_t colon = uri.find(':');
  if (colon != std::string::npos && colon < uri.find('/'))
    return fail(Code::gltf_unsupported, document.file, place, "a URI with a scheme: " + uri.substr(0, 40));
  const std::string decoded = percent_decoded(uri);
  // The system would take the name to end there.
  if (decoded.find('\0') != std::string::npos)
    return fail(Code::gltf_malformed, document.file, place, "a zero byte in the name of a file");
  return (fs::path(document.folder) / decoded).lexically_normal().string();
}

/// GLTF_REFERENCE for a file that does not lie in the folder.
Result<void> check_inside(const GltfDocument& document, const std::string& path, const std::string& folder,
                          const std::string& uri, const std::string& place) {
  const Result<bool> inside = is_inside(path, folder);
  if (inside && *inside) return {};
  return fail(inside ? Code::gltf_reference : inside.error().code, document.file, place,
              fmt::format("{}: {}", uri.substr(0, 200),
                          inside ? "lies outside of the document's folder (allowed by --allow-outside)"
                                 : inside.error().message));
}

}  // namespace

Result<bool> is_inside(const std::string& path, const std::string& folder) {
  std::error_code error;
  const fs::path file = canonical(path, error);
  const fs::path around = error ? fs::path() : canonical(folder, error);
  if (error) return fail(Code::file_unreadable, path, "", error.message());
  const fs::path relative = file.lexically_relative(around);
  return !relative.empty() && *relative.begin() != "..";
}

Result<std::string> resolve_uri(const GltfDocument& document, const std::string& uri,
                                const std::string& place) {
  Result<std::string> path = path_of(document, uri, place);
  if (!path || document.external_files == ExternalFiles::anywhere) return path;
  const std::vector<std::string>& named = document.allowed_files;
  if (std::ranges::find(named, canonical(*path).string()) != named.end()) return path;
  const std::string& root = document.source_folder.empty() ? document.folder : document.source_folder;
  Result<void> good = check_inside(document, *path, root, uri, place);
  if (good) return path;
  // A missing file keeps the name that it had where the document was read (rebase_uris).
  const std::string before = (fs::path(root) / percent_decoded(uri)).string();
  std::error_code ignored;
  if (!document.source_folder.empty() && !fs::exists(before, ignored) &&
      is_inside(before, root).value_or(false))
    return before;
  return tl::unexpected<Error>(std::move(good.error()));
}

void find_outside_uris(const GltfDocument& document, IssueSink& issues) {
  for_each_uri(document.json, [&](const Json& entry, const std::string& place) {
    const std::string uri = string_of(member(entry, names::gltf::uri));
    if (!names_file(uri)) return;
    const std::string where = place + "/" + names::gltf::uri;
    const Result<std::string> path = path_of(document, uri, where);
    if (!path) return;
    const Result<void> inside = check_inside(document, *path, document.folder, uri, where);
    if (!inside && inside.error().code == Code::gltf_reference) issues.add(inside.error());
  });
}

std::string find_similar_file(const GltfDocument& document, std::string name) {
  if (document.external_files == ExternalFiles::none || name.find('\0') != std::string::npos) return {};
  std::ranges::replace(name, '\\', '/');
  const fs::path around(document.folder.empty() ? "." : document.folder);
  for (const fs::path& wanted : {fs::path(name).relative_path(), fs::path(name).filename()}) {
    std::error_code error;
    fs::path found = around;
    for (const fs::path& part : wanted) {
      if (fs::exists(found / part, error)) {
        found /= part;
        continue;
      }
      std::set<fs::path> alike;
      for (fs::directory_iterator entry(found, error), end; !error && entry != end; entry.increment(error))
        if (lower_case(entry->path().filename()) == lower_case(part)) alike.insert(entry->path());
      found = alike.empty() ? fs::path() : *alike.begin();
      if (found.empty()) break;
    }
    if (!fs::is_regular_file(found, error)) continue;
    if (resolve_uri(document, relative_uri(found.string(), document.folder), "")) return found.string();
  }
  return {};
}

void redirect_missing_files(GltfDocument& document) {
  const fs::path around(document.folder.empty() ? "." : document.folder);
  for_each_uri(document.json, [&](Json& entry, const std::string& place) {
    const std::string uri = string_of(member(entry, names::gltf::uri));
    if (!names_file(uri) || uri.starts_with("http")) return;
    const Result<std::string> path = resolve_uri(document, uri, place);
    std::error_code ignored;
    if (path && fs::exists(*path, ignored)) return;
    const std::string found = find_similar_file(document, percent_decoded(uri));
    if (found.empty()) return;
    entry[names::gltf::uri] = relative_uri(found, document.folder);
    document.remarks.push_back(fmt::format("{}: there is no \"{}\"; \"{}\" is read", place,
                                           uri.substr(0, 200),
                                           fs::path(found).lexically_proximate(around).string()));
  });
}

void allow_file(GltfDocument& document, const std::string& uri) {
  const Result<std::string> path = path_of(document, uri, "");
  if (path) document.allowed_files.push_back(canonical(*path).string());
}

Bytes read_uri(GltfReader& reader, const std::string& uri, const std::string& place, std::uint64_t limit) {
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string::npos) reader.fail(Code::gltf_malformed, place, "a data URI without a comma");
    const std::string text = percent_decoded(uri.substr(comma + 1));
    if (!uri.substr(0, comma).ends_with(";base64")) return {text.begin(), text.end()};
    std::optional<Bytes> bytes = base64_decoded(text);
    if (!bytes) reader.fail(Code::gltf_malformed, place, "a data URI with broken base64");
    return std::move(*bytes);
  }
  if (reader.document.external_files == ExternalFiles::none)
    reader.fail(Code::gltf_unsupported, place, "other files are not to be opened");
  const Result<std::string> file = read_file(value_or_throw(resolve_uri(reader.document, uri, place)), limit);
  if (file) return {file->begin(), file->end()};
  reader.fail(file.error().code, place, fmt::format("{}: {}", uri.substr(0, 200), file.error().message));
}

Result<Bytes> read_image_bytes(const GltfDocument& document, int image, std::uint64_t limit) {
  return catch_failure([&] {
    GltfReader reader(document);
    const std::string place = fmt::format("/images/{}", image);
    const Json& json = reader.entry("images", image, place);
    const std::string uri = string_of(member(json, names::gltf::uri));
    if (uri.empty() && json.contains(names::gltf::uri))
      reader.fail(Code::gltf_malformed, place, "its uri is empty or no string");
    Bytes bytes;
    if (!uri.empty()) {
      bytes = read_uri(reader, uri, place, limit);
    } else {
      const auto view = reader.view_bytes(index_of(member(json, names::gltf::buffer_view)), place);
      bytes.assign(view.begin(), view.end());
    }
    if (bytes.size() > limit) reader.fail(Code::file_too_large, place, "the pictures are too large");
    if (picture_type(bytes).empty())
      reader.fail(Code::image_unreadable, place, "is no picture (PNG, JPEG, WebP, KTX2, AVIF or DDS)");
    return bytes;
  });
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

void rebase_uris(GltfDocument& document, const std::string& folder) {
  const auto move = [&](Json& entry, const std::string&) {
    const std::string uri = string_of(member(entry, names::gltf::uri));
    if (!names_file(uri)) return;
    // An address on the network stays as it is, and so does the name of a missing file.
    const Result<std::string> path = resolve_uri(document, uri, "");
    std::error_code ignored;
    if (path && fs::exists(*path, ignored)) entry[names::gltf::uri] = relative_uri(*path, folder);
  };
  if (document.source_folder.empty()) document.source_folder = canonical(document.folder).string();
  if (canonical(document.folder) != canonical(folder)) for_each_uri(document.json, move);
  document.folder = folder;
}

}  // namespace selvedge
