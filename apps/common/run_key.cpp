#include "apps/common/run_key.h"

#include "format/base/atomic_file.h"
#include "format/base/digest.h"
#include "format/base/option_text.h"
#include "format/gltf/document.h"
#include "format/gltf/uri.h"

namespace selvedge {
namespace {

void add(const std::string& text, Digest& digest) {
  const std::string length = std::to_string(text.size()) + ":";
  digest.update(length.data(), length.size());
  digest.update(text.data(), text.size());
}

void add_file(const std::string& path, Digest& digest) { add(read_file(path).value_or("no file"), digest); }

/// The files that the URIs below `json` name.
void add_references(const GltfDocument& document, const Json& json, Digest& digest) {
  for (const auto& [key, value] : json.items()) {
    if (value.is_structured()) add_references(document, value, digest);
    if (key != "uri" || !value.is_string()) continue;
    if (const auto path = resolve_uri(document, value.get<std::string>(), "")) add_file(*path, digest);
  }
}

}  // namespace

void RunKey::declare(Options& options) {
  options
      .flag("--if-changed", is_given_,
            "Keep an output that this option has made by the same inputs, options and version")
      .advanced();
  options.add_check([this, &options] {
    words_ = options.given_words();
    files_ = options.given_inputs();
  });
}

std::string RunKey::digest(const std::vector<std::string>& more) const {
  if (!is_given_) return {};
  Digest digest;
  add(SELVEDGE_VERSION, digest);
  add(words_, digest);
  std::vector<std::string> files = files_;
  files.insert(files.end(), more.begin(), more.end());
  for (const std::string& path : files) {
    add_file(path, digest);
    const bool is_garment = has_ending(path, ".gltf") || has_ending(path, ".glb") || has_ending(path, ".obj");
    if (!is_garment) continue;
    if (const auto document = load_gltf(path)) {
      add(document->json.dump(), digest);
      add_references(*document, document->json, digest);
    }
  }
  return digest.hex();
}

}  // namespace selvedge
