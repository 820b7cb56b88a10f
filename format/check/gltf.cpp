#include "format/check/gltf.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "format/base/atomic_file.h"
#include "format/gltf/access.h"
#include "format/gltf/memory.h"
#include "format/gltf/read_scene.h"
#include "format/gltf/references.h"
#include "format/gltf/uri.h"
#include "format/picture/image.h"
#include "format/picture/picture_type.h"

namespace selvedge {
namespace {

/// Larger pictures are not opened at all: the largest that fits the limits of the viewer, stored raw.
constexpr std::uint64_t max_picture_bytes = std::uint64_t{1} << 30;

/// Readers go on without an unreadable picture; a garment is not complete without it.
/// `memory`: what decoding may take; 0: they are not decoded.
void check_pictures(const GltfDocument& document, std::uint64_t memory, IssueSink& issues) {
  constexpr std::array smallest{15};  // halvings
  const ImageLimits picture_limits{.memory = memory};
  const Json& images = array_member(document.json, "images");
  for (int i = 0; i < static_cast<int>(images.size()); ++i) {
    if (!images[i].contains("uri") && !images[i].contains("bufferView")) continue;  // an extension has it
    const auto bytes = read_image_bytes(document, i, max_picture_bytes);
    Result<void> good = bytes ? Result<void>() : tl::unexpected(bytes.error());
    const std::string_view type = bytes ? picture_type(*bytes) : "";
    if (memory > 0 && (type == "image/png" || type == "image/jpeg" || type == "image/webp"))
      good = decode_levels(*bytes, "", Transfer::keep, picture_limits, smallest).map([](const auto&) {});
    if (!good) issues.add(Code::image_unreadable, fmt::format("/images/{}", i), good.error().message);
  }
}

/// Nothing is drawn, planned or dressed at places that are not near.
void check_places(const Scene& scene, IssueSink& issues) {
  std::vector<Imath::Box3d> bounds(scene.primitives.size());
  for (std::size_t i = 0; i < bounds.size(); ++i)
    for (const V3f& position : scene.primitives[i].positions) bounds[i].extendBy(V3d(position));
  for (const SceneInstance& instance : scene.instances) {
    const Imath::Box3d& box = bounds[instance.primitive];
    for (int corner = 0; corner < 8 && !box.isEmpty(); ++corner) {
      const V3d place(corner % 2 == 0 ? box.min.x : box.max.x, corner / 2 % 2 == 0 ? box.min.y : box.max.y,
                      corner < 4 ? box.min.z : box.max.z);
      if (is_in_coordinate_range(place) && is_in_coordinate_range(place * instance.world)) continue;
      const ScenePrimitive& primitive = scene.primitives[instance.primitive];
      return issues.add(Code::mesh_not_finite,
                        fmt::format("/meshes/{}/primitives/{}", primitive.mesh, primitive.primitive_index),
                        "places lie beyond 10^9 m");
    }
  }
}

}  // namespace

Issues check_gltf(const std::string& path, const SceneLimits& limits, Scene* scene) {
  const Result<std::string> file = read_file(path, limits.document.file_bytes);
  if (!file) return {file.error()};
  return check_gltf({reinterpret_cast<const std::uint8_t*>(file->data()), file->size()}, path, limits, scene);
}

Issues check_gltf(std::span<const std::uint8_t> bytes, const std::string& path, const SceneLimits& limits,
                  Scene* scene) {
  IssueSink issues(path);
  const std::optional<GltfDocument> document = load_gltf(bytes, path, limits.document, issues);
  if (!document) return issues.take_issues();
  Scene read = read_whole_document(*document, limits, issues);
  read.memory_left = std::min(read.memory_left, limits.document.memory);
  bool pictures_fit = false;
  if (!issues.has_error()) {  // else it would repeat the same faults
    check_references(*document, issues);
    check_places(read, issues);
    const auto left = check_scene_memory(read, limits.document.memory);
    const Result<void> textures = left ? check_texture_memory(read, *left) : Result<void>();
    pictures_fit = left && textures;
    if (!pictures_fit) issues.add(left ? textures.error() : left.error());
  }
  check_pictures(*document, pictures_fit ? limits.document.memory : 0, issues);
  check_fabric_extension(*document, read, issues);
  if (!issues.has_error() && scene != nullptr) *scene = std::move(read);
  return issues.take_issues();
}

}  // namespace selvedge
