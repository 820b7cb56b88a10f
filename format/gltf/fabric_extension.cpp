#include "format/gltf/fabric_extension.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "format/base/colour_difference.h"
#include "format/base/guard.h"
#include "format/gltf/edit.h"
#include "format/gltf/names.h"
#include "format/gltf/uri.h"

namespace selvedge {

using namespace names::gltf;

namespace {

const Json& entries_of(const GltfDocument& document) {
  return array_member(member(member(document.json, "extensions"), fabric_extension), fabrics);
}

V2d pair_of(const Json& value, const V2d& otherwise) {
  if (!value.is_array() || value.size() != 2) return otherwise;
  return {number_or(value[0], otherwise.x), number_or(value[1], otherwise.y)};
}

}  // namespace

TextureMapping read_texture_mapping(const Json& texture_info) {
  const Json& json = member(member(texture_info, "extensions"), texture_transform);
  const int overriding = index_of(member(json, tex_coord));
  TextureMapping placement;
  placement.tex_coord = overriding >= 0 ? overriding : std::max(0, index_of(member(texture_info, tex_coord)));
  UvTransform& transform = placement.transform;
  transform.offset = pair_of(member(json, offset), transform.offset);
  transform.rotation = number_or(member(json, rotation), 0);
  transform.scale = pair_of(member(json, scale), transform.scale);
  return placement;
}

std::optional<Error> unreached_variant(const std::string& file, const std::string& place, const V3f& albedo,
                                       const V3f& tint) {
  constexpr double max_difference = 5;
  // Light that the surface of fibres reflects, at right angles and by an index of 1.5: no dye colours it.
  constexpr float gloss = 0.04F;
  const V3f wanted = albedo * tint;
  V3f reached = wanted;
  for (int c = 0; c < 3; ++c) reached[c] -= std::max(tint[c] - 1, 0.0F) * std::min(gloss, albedo[c]);
  const double difference = ciede2000(wanted, reached);
  if (difference <= max_difference) return std::nullopt;
  return Error{
      Code::variant_unreached, file, place,
      fmt::format("the fabric, which reflects {:.2f} {:.2f} {:.2f}, reaches {:.2f} {:.2f} {:.2f} without "
                  "its gloss, not {:.2f} {:.2f} {:.2f}: a difference of {:.0f} (CIEDE2000)",
                  albedo.x, albedo.y, albedo.z, reached.x, reached.y, reached.z, wanted.x, wanted.y, wanted.z,
                  difference)};
}

const Json& fabric_extension_member(const GltfDocument& document, int material, const char* part) {
  const Json& json = root_entry(document, "materials", material);
  return member(member(member(json, "extensions"), fabric_extension), part);
}

std::optional<TransformFault> transform_range_fault(const UvTransform& transform) {
  using Limits = std::numeric_limits<float>;
  const auto largest = [](const V2d& pair) { return std::max(std::abs(pair.x), std::abs(pair.y)); };
  for (const auto& [which, value] : {std::pair{offset, largest(transform.offset)},
                                     {rotation, std::abs(transform.rotation)},
                                     {scale, largest(transform.scale)}})
    if (!(value <= double{Limits::max()}))
      return TransformFault{which, fmt::format("{:g} is beyond 32-bit floats", value)};
  return std::nullopt;
}

std::optional<TransformFault> fabric_transform_fault(const UvTransform& transform) {
  if (std::optional<TransformFault> fault = transform_range_fault(transform)) return fault;
  const double smallest = std::min(std::abs(transform.scale.x), std::abs(transform.scale.y));
  if (smallest >= double{std::numeric_limits<float>::min()}) return std::nullopt;
  return TransformFault{scale, fmt::format("scale {:g}: the texture transform is singular", smallest)};
}

Json texture_info(int number, int set, const UvTransform& transform) {
  Json json{{index, number}};
  if (set != 0) json[tex_coord] = set;
  if (transform != UvTransform()) {
    Json& values = json["extensions"][texture_transform];
    if (transform.offset != V2d(0, 0)) values[offset] = {transform.offset.x, transform.offset.y};
    if (transform.rotation != 0) values[rotation] = transform.rotation;
    values[scale] = {transform.scale.x, transform.scale.y};
  }
  return json;
}

int fabric_count(const GltfDocument& document) { return static_cast<int>(entries_of(document).size()); }

Result<SceneFabric> read_fabric_entry(const GltfDocument& document, int number) {
  return catch_failure([&] {
    GltfReader reader(document);
    const Json& entry = entries_of(document)[number];
    const std::string place = fmt::format("/extensions/{}/{}/{}", fabric_extension, fabrics, number);
    const std::string where = place + "/" + uri;
    const std::string address = string_of(member(entry, uri));
    SceneFabric read;
    read.name = string_of(member(entry, name));
    if (!entry.is_object()) reader.fail(Code::gltf_extension, place, "is not an object");
    if (entry.contains(uri) == entry.contains(buffer_view))
      reader.fail(Code::gltf_extension, place, "needs either a uri or a bufferView");
    if (entry.contains(buffer_view)) {
      const auto bytes = reader.view_bytes(index_of(entry[buffer_view]), place + "/" + buffer_view);
      read.bytes.assign(bytes.begin(), bytes.end());
    } else if (address.empty()) {
      reader.fail(Code::gltf_extension, where, "is not a string, or empty");
    } else if (address.starts_with("data:")) {
      read.bytes = read_uri(reader, address, where);
    } else {
      read.path = value_or_throw(resolve_uri(document, address, where));
    }
    return read;
  });
}

Result<std::vector<SceneFabric>> read_fabric_entries(const GltfDocument& document) {
  return catch_failure([&] {
    std::vector<SceneFabric> read;
    for (int i = 0; i < fabric_count(document); ++i)
      read.push_back(value_or_throw(read_fabric_entry(document, i)));
    return read;
  });
}

Result<std::optional<FabricReference>> read_fabric_reference(const GltfDocument& document, int material,
                                                             int fabrics_present) {
  const std::string place = fmt::format("/materials/{}/extensions/{}", material, fabric_extension);
  const auto refuse = [&](const std::string& within, std::string why) {
    return fail(Code::gltf_extension, document.file, place + within, std::move(why));
  };
  const Json& json = root_entry(document, "materials", material);
  const Json& extension = member(member(json, "extensions"), fabric_extension);
  if (extension.is_null()) return std::optional<FabricReference>();
  const Json& info = member(extension, fabric);
  const auto [set, transform] = read_texture_mapping(info);
  const FabricReference reference{index_of(member(info, index)), set, transform};
  if (reference.fabric < 0) return refuse("/fabric/index", "is not an index");
  if (reference.fabric >= fabrics_present)
    return refuse("/fabric/index", fmt::format("there is no fabric {}", reference.fabric));
  if (const std::optional<TransformFault> fault = fabric_transform_fault(reference.transform))
    return refuse(fmt::format("/{}/extensions/{}/{}", fabric, texture_transform, fault->member),
                  fault->reason);
  return std::optional(reference);
}

Result<int> add_fabric(GltfDocument& document, const FabricSource& source) {
  const Result<std::vector<SceneFabric>> present = read_fabric_entries(document);
  if (!present) return tl::unexpected<Error>(present.error());
  for (std::size_t i = 0; i < present->size(); ++i) {
    const std::string address = string_of(member(entries_of(document)[i], uri));
    if (source.uri.empty() ? (*present)[i].bytes == source.bytes : address == source.uri)
      return static_cast<int>(i);
  }
  Json entry = Json::object();
  if (!source.name.empty()) entry[name] = source.name;
  entry[mime_type] = fabric_mime_type;
  if (source.uri.empty()) {
    entry[buffer_view] = append_view(document, source.bytes);
  } else {
    entry[uri] = source.uri;
    allow_file(document, source.uri);
  }
  document.json["extensions"][fabric_extension][fabrics].push_back(std::move(entry));
  list_extension(document.json, fabric_extension);
  return static_cast<int>(present->size());
}

void set_fabric_reference(GltfDocument& document, int material, const FabricReference& reference) {
  Json& json = document.json["materials"][material];
  Json info = texture_info(reference.fabric, reference.tex_coord, reference.transform);
  if (info.contains("extensions")) list_extension(document.json, texture_transform);
  json["extensions"][fabric_extension][fabric] = std::move(info);
}

}  // namespace selvedge
