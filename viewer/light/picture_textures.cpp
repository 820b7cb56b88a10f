#include "viewer/light/picture_textures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "format/base/guard.h"
#include "format/base/mip.h"
#include "format/gltf/memory.h"
#include "viewer/gl/objects.h"

namespace selvedge {
namespace {

/// Largest singular value of the map from the plane of a triangle to its texture, units per metre;
/// infinite without area: no pixel sees the triangle.
double stretch_of(const std::array<V3d, 3>& p, const std::array<V2d, 3>& at) {
  const V3d a = p[1] - p[0];
  const V3d b = p[2] - p[0];
  const V3d x = a.normalized();
  const double along = b.dot(x);
  const double across = (b - x * along).length();
  const double length = a.length();
  if (!(length * across > 0)) return HUGE_VAL;
  // Columns of the Jacobian: units per metre along x and across it.
  const V2d s = (at[1] - at[0]) / length;
  const V2d t = (at[2] - at[0] - s * along) / across;
  const double trace = s.length2() + t.length2();
  const double determinant = s.x * t.y - s.y * t.x;
  const double root = std::sqrt(std::max(trace * trace - 4 * determinant * determinant, 0.0));
  return std::sqrt((trace + root) / 2);
}

/// Lower bounds of the step between neighbouring pixels on textures, in frames of `height` pixels.
struct StepBound {
  const Camera& camera;
  int height;
  M44d clip = clip_matrix(camera, V3d(0, 0, 0));
  double pixel = 2 * camera.window_half_size.y / height;
  /// Squared tangent of the largest angle between a ray of the frame and the axis.
  double max_slope2 = V2d(std::abs(camera.window_centre.x) + camera.window_half_size.x,
                          std::abs(camera.window_centre.y) + camera.window_half_size.y)
                          .length2();

  /// A lower bound of the step of a triangle at `points` (world, m) with texture coordinates `at`, in their
  /// units, between some pixel of it and its neighbour to the right or above, the longer of the two; infinite
  /// if no pixel shows the triangle.
  double operator()(const std::array<V3d, 3>& points, const std::array<V2d, 3>& at) const {
    const double stretch = stretch_of(points, at);
    const double span = span_of(points);
    if (stretch == HUGE_VAL || span == HUGE_VAL) return HUGE_VAL;
    // The longer of two columns is at least the longest image of the unit circle, over the root of two.
    const double step = stretch * span / std::sqrt(2.0);
    return std::isnan(step) ? 0.0 : step;
  }

  /// Length of the shorter axis of a footprint, m; infinite: no pixel sees the triangle.
  double span_of(const std::array<V3d, 3>& p) const {
    double nearest = HUGE_VAL;
    double slope2 = 0;  // squared tangent of the angle between the axis and the ray to a corner
    std::array<int, 4> outside{};
    for (const V3d& corner : p) {
      const auto row = [&](unsigned k) {
        return corner.x * clip[0][k] + corner.y * clip[1][k] + corner.z * clip[2][k] + clip[3][k];
      };
      const double w = row(3);
      outside[0] += row(0) < -w ? 1 : 0;
      outside[1] += row(0) > w ? 1 : 0;
      outside[2] += row(1) < -w ? 1 : 0;
      outside[3] += row(1) > w ? 1 : 0;
      const V3d away = camera.position - corner;
      const double depth = away.dot(camera.image_normal());
      nearest = std::min(nearest, depth);
      slope2 = std::max(slope2, away.length2() / (depth * depth) - 1);
    }
    if (std::ranges::any_of(outside, [](int n) { return n == 3; })) return HUGE_VAL;
    if (camera.projection == Projection::parallel)
      return pixel * std::abs(camera.to_viewer.normalized().dot(camera.image_normal()));
    // The footprint is the projection of the pixel's disc along the ray: never smaller than the disc.
    if (!(nearest > 0) || !(slope2 < max_slope2)) slope2 = max_slope2;
    return pixel * std::max(nearest, camera.near) / std::sqrt(1 + slope2);
  }
};

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

}  // namespace

std::vector<int> shown_halvings(const MergedSurfaces& mesh, const Materials& materials, const V3d& origin,
                                const Camera& camera, int height) {
  std::vector<int> halvings(materials.pictures.size(), halvings_of_hidden);
  if (halvings.empty() || !materials.needs_pbr()) return halvings;
  const StepBound step{camera, height};
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
          at[k] = V2d(mesh.uv(corners[k], mapped.mapping)) * V2d(mapped.size);
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
  for (const std::map<int, GLuint>& textures : made_)
    for (const auto& [halvings, texture] : textures) gl_.DeleteTextures(1, &texture);
}

bool PictureTextures::fits(const Levels& levels, const std::vector<MaterialPicture>& pictures) const {
  std::uint64_t sum = 0;
  std::uint64_t largest = 0;
  std::uint64_t encoded = 0;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    for (const int halvings : levels[i]) {
      const std::uint64_t pixels = pictures[i].pixels(halvings);
      sum += pixels;
      largest = std::max(largest, pixels);
      encoded = std::max(encoded, pictures[i].pixels(0));
    }
  }
  MemoryBudget budget(memory_);
  return try_spend_textures(budget, sum, largest, encoded);
}

void PictureTextures::make_textures(const std::vector<int>& halvings, std::vector<MaterialPicture>& pictures,
                                    const std::string& file, std::vector<std::string>& remarks) {
  // Decoding a picture of more pixels takes longer than making two textures of fewer.
  constexpr std::uint64_t large = std::uint64_t{1} << 22;
  constexpr std::uint64_t small = std::uint64_t{1} << 20;
  made_.resize(pictures.size());
  Levels needed(pictures.size());
  Levels kept(pictures.size());
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    for (const auto& [level, texture] : made_[i]) kept[i].insert(level);
    if (halvings[i] == halvings_of_hidden) continue;
    needed[i] = {halvings[i]};
    kept[i].insert(halvings[i]);
    for (int finer = std::max(halvings[i] - 2, 0); finer < halvings[i]; ++finer)
      if (made_[i].empty() && pictures[i].pixels(0) > large && pictures[i].pixels(finer) <= small)
        kept[i].insert(finer);
  }
  if (!fits(kept, pictures)) kept = needed;
  if (!fits(kept, pictures))
    throw Failure{memory_limit_error(file, "", "the pictures that the frame shows", memory_)};
  // All that go before the first that comes.
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    std::erase_if(made_[i], [&](const auto& made) {
      const bool goes = !kept[i].contains(made.first);
      if (goes) gl_.DeleteTextures(1, &made.second);
      return goes;
    });
    pictures[i].texture = 0;
  }
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    MaterialPicture& picture = pictures[i];
    if (needed[i].empty() || picture.bytes == nullptr) continue;
    GLuint& shown = made_[i][halvings[i]];
    if (shown == 0) {
      std::vector<int> fresh;
      for (const int level : kept[i])
        if (level == halvings[i] || !made_[i].contains(level)) fresh.push_back(level);
      const ImageLimits limits{std::max(picture.size.x, picture.size.y),
                               static_cast<std::int64_t>(picture.pixels(0))};
      const auto images = decode_levels(*picture.bytes, picture.name, picture.transfer, limits, fresh);
      ++decoded_;
      if (!images) {
        remarks.push_back(to_line(images.error()) + "; drawn without it");
        picture.bytes.reset();
        continue;
      }
      for (std::size_t k = 0; k < fresh.size(); ++k)
        made_[i][fresh[k]] = make_colour_texture(gl_, (*images)[k]);
    }
    picture.texture = shown;
  }
}

}  // namespace selvedge
