#include "viewer/light/picture_textures.h"

#include <algorithm>
#include <cmath>

#include "format/base/mip.h"
#include "format/gltf/memory.h"
#include "viewer/gl/objects.h"
#include "viewer/light/step_bound.h"

namespace selvedge {
namespace {

/// A mapping of a surface in texels of pictures of one size.
struct Mapped {
  int mapping = 0;
  V2i size{1, 1};
  double step = HUGE_VAL;  ///< StepBound
  std::vector<int> pictures;
};

std::vector<Mapped> mapped_pictures(const PbrMaterial& pbr, const std::vector<MaterialPicture>& pictures) {
  std::vector<Mapped> result;
  for (const MaterialTexture* texture : textures_of(pbr)) {
    if (texture->image < 0) continue;
    const V2i size = pictures[texture->image].size;
    auto found = std::ranges::find_if(
        result, [&](const Mapped& other) { return other.mapping == texture->mapping && other.size == size; });
    if (found == result.end()) found = result.insert(found, {texture->mapping, size, HUGE_VAL, {}});
    found->pictures.push_back(texture->image);
  }
  return result;
}

V2d uv_of(const MergedSurfaces& mesh, std::uint32_t vertex, int mapping) {
  if (mapping > 0) return V2d(mesh.more_uvs[mapping - 1][vertex]);
  const auto& [normal_u, tangent_v] = mesh.attributes[vertex];
  return {normal_u[3], tangent_v[3]};
}

std::uint64_t pixels_of(const V2i& size, int halvings) {
  return std::uint64_t{1} * static_cast<std::uint64_t>(halved_size(size.x, halvings)) *
         static_cast<std::uint64_t>(halved_size(size.y, halvings));
}

}  // namespace

std::vector<int> halvings_shown(const MergedSurfaces& mesh, const Materials& materials, const V3d& origin,
                                const Camera& camera, int height) {
  std::vector<int> halvings(materials.pictures.size(), not_shown);
  if (halvings.empty() || !materials.needs_pbr()) return halvings;
  const StepBound step = step_bound(camera, height);
  for (const TriangleSpan& span : spans_of(mesh)) {
    std::vector<Mapped> all = mapped_pictures(materials.pbr[span.surface], materials.pictures);
    if (all.empty()) continue;
    for (std::size_t t = span.first; t < span.end; ++t) {
      const auto& corners = mesh.triangles[t].corners;
      std::array<V3d, 3> points;
      for (std::size_t k = 0; k < 3; ++k) points[k] = V3d(mesh.positions[corners[k]]) + origin;
      for (Mapped& mapped : all) {
        if (mapped.step < 2) continue;  // whole already
        std::array<V2d, 3> at;
        for (std::size_t k = 0; k < 3; ++k)
          at[k] = uv_of(mesh, corners[k], mapped.mapping) * V2d(mapped.size);
        mapped.step = std::min(mapped.step, step(points, at));
      }
    }
    for (const Mapped& mapped : all) {
      if (mapped.step == HUGE_VAL) continue;
      const int last = level_count(mapped.size.x, mapped.size.y) - 1;
      const int level = mapped.step < 2 ? 0 : std::min(std::ilogb(mapped.step), last);
      for (const int picture : mapped.pictures) halvings[picture] = std::min(halvings[picture], level);
    }
  }
  return halvings;
}

PictureTextures::~PictureTextures() {
  gl_.DeleteTextures(static_cast<GLsizei>(textures_.size()), textures_.data());
}

bool PictureTextures::fits(const std::vector<int>& halvings,
                           const std::vector<MaterialPicture>& pictures) const {
  std::uint64_t sum = 0;
  std::uint64_t largest = 0;
  std::uint64_t encoded = 0;
  for (std::size_t i = 0; i < halvings.size(); ++i) {
    if (halvings[i] == not_shown) continue;
    const std::uint64_t pixels = pixels_of(pictures[i].size, halvings[i]);
    sum += pixels;
    largest = std::max(largest, pixels);
    encoded = std::max(encoded, pixels_of(pictures[i].size, 0));
  }
  MemoryAccount account(memory_);
  return take_textures(account, sum, largest, encoded);
}

Result<void> PictureTextures::make(const std::vector<int>& halvings, std::vector<MaterialPicture>& pictures,
                                   const std::string& file, std::vector<std::string>& remarks) {
  made_.resize(pictures.size(), not_shown);
  textures_.resize(pictures.size(), 0);
  std::vector<int> wanted = halvings;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i] == not_shown) wanted[i] = made_[i];
  }
  if (!fits(wanted, pictures)) wanted = halvings;
  if (!fits(wanted, pictures))
    return tl::unexpected(beyond_memory(file, "", "the pictures that the frame shows", memory_));
  const auto changes = [&](std::size_t i) { return wanted[i] != made_[i] && pictures[i].bytes != nullptr; };
  // All that go before the first that comes.
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (!changes(i)) continue;
    gl_.DeleteTextures(1, &textures_[i]);
    pictures[i].texture = textures_[i] = 0;
    made_[i] = not_shown;
  }
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (!changes(i)) continue;
    MaterialPicture& picture = pictures[i];
    const ImageLimits limits{std::max(picture.size.x, picture.size.y),
                             static_cast<std::int64_t>(pixels_of(picture.size, 0))};
    const Result<Image> image =
        decode_image(*picture.bytes, picture.name, picture.transfer, limits, wanted[i]);
    made_[i] = wanted[i];
    if (image) {
      picture.texture = textures_[i] = make_colour_texture(gl_, *image);
    } else {
      remarks.push_back(to_line(image.error()) + "; drawn without it");
      picture.bytes.reset();
    }
  }
  return {};
}

}  // namespace selvedge
