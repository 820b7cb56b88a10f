#include "converter/dress/fabric_source.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "format/base/atomic_file.h"
#include "format/base/option_text.h"
#include "format/base/printable.h"
#include "format/gltf/references.h"
#include "format/gltf/uri.h"

namespace selvedge {

Result<FabricSource> source_of(const std::string& fabric_path, const std::string& output_path, bool embed) {
  namespace fs = std::filesystem;
  FabricSource source;
  source.name = escape_invalid_utf8(fs::path(fabric_path).stem().string());  // JSON strings are UTF-8
  std::error_code ignored;
  if (!fs::is_regular_file(fabric_path, ignored))
    return fail(Code::file_missing, fabric_path, "", "no such file");
  if (fs::equivalent(fabric_path, output_path, ignored))
    return fail(Code::file_unwritable, output_path, "", "is the fabric");
  if (!embed) {
    source.uri = relative_uri(fabric_path, fs::path(output_path).parent_path().string());
    return source;
  }
  const Result<std::string> bytes = read_file(fabric_path);
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  source.bytes.assign(bytes->begin(), bytes->end());
  return source;
}

GltfDocument load_garment(const std::string& path, const std::string& output_path, const GltfLimits& limits) {
  GltfDocument document = value_or_throw(load_gltf(path, limits));
  value_or_throw(check_references(document));
  rebase_uris(document, std::filesystem::path(output_path).parent_path().string());
  return document;
}

std::vector<std::string> outside_warnings(const GltfDocument& document, const std::string& output_path) {
  IssueSink issues(output_path);
  find_outside_uris(document, issues);
  std::vector<std::string> warnings;
  for (const Error& issue : issues.take_issues()) {
    const bool moves_in = issue.place.starts_with("/buffers/") ||
                          (issue.place.starts_with("/images/") && has_ending(output_path, ".glb"));
    if (!moves_in) warnings.push_back(fmt::format("{}: {}", issue.place, issue.message));
  }
  return warnings;
}

Json& primitive_at(GltfDocument& document, const PrimitiveIndex& place) {
  return document.json["meshes"][place.first]["primitives"][place.second];
}

std::string member_pointer(const PrimitiveIndex& place) {
  return fmt::format("/meshes/{}/primitives/{}", place.first, place.second);
}

int append_accessor(GltfDocument& document, std::span<const float> values, AccessorShape shape) {
  const int type = shape.component_type;
  if (type == 5126) return append_float_accessor(document, values, shape.components, false);
  shape.count = values.size() / static_cast<std::size_t>(shape.components);
  const std::size_t size = component_size(type);
  // 1 is the greatest signed number.
  const float scale = shape.normalized ? std::exp2(8.0F * static_cast<float>(size) - 1) - 1 : 1;
  Bytes bytes;
  for (const float value : values) {
    const auto number = static_cast<unsigned>(std::lround(scale * value));
    for (std::size_t b = 0; b < size; ++b) bytes.push_back(static_cast<std::uint8_t>(number >> 8 * b));
  }
  Json accessor{{"bufferView", append_attribute_view(document, shape, bytes)},
                {"componentType", type},
                {"count", shape.count},
                {"type", fmt::format("VEC{}", shape.components)}};
  if (shape.normalized) accessor["normalized"] = true;
  return append(document.json["accessors"], std::move(accessor));
}

}  // namespace selvedge
