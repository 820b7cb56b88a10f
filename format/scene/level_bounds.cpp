#include "format/scene/level_bounds.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace selvedge {
namespace {

/// Lowers and raises the bounds by less than a thousandth of a level, for what floats round away.
constexpr double rounding = 1e-3;

/// The stretches from the plane of a triangle to its texture, units per metre: the smaller and the larger.
struct Stretch {
  double least = HUGE_VAL;  ///< so where the triangle has no area, which no pixel sees
  double most = 0;
};

Stretch stretch_of(const std::array<V3d, 3>& p, const std::array<V2d, 3>& at) {
  const V3d a = p[1] - p[0];
  const V3d b = p[2] - p[0];
  const V3d x = a.normalized();
  const double along = b.dot(x);
  const double across = (b - x * along).length();
  const double length = a.length();
  if (!(length * across > 0)) return {};
  // Columns of the Jacobian: units per metre along x and across it.
  const V2d s = (at[1] - at[0]) / length;
  const V2d t = (at[2] - at[0] - s * along) / across;
  const double trace = s.length2() + t.length2();
  const double determinant = s.x * t.y - s.y * t.x;
  const double root = std::sqrt(std::max(trace * trace - 4 * determinant * determinant, 0.0));
  // The smaller eigenvalue without cancellation.
  return {std::sqrt(2 * determinant * determinant / (trace + root)), std::sqrt((trace + root) / 2)};
}

/// What a pixel's disc spans on a triangle: metres, along the shorter axis at least and at most, along the
/// longer at most. Not negative; nothing is seen where `least` is infinite.
struct Spans {
  double least = HUGE_VAL;
  double most = 0;
  double longest = 0;
  bool front = false;  ///< may be seen; both where rounding may decide between them
  bool back = false;
};

/// By how much the sine of the angle between a triangle's plane and a ray may be off that is `distance` long,
/// where positions are single precision.
double plane_blur(const std::array<V3d, 3>& p, const V3d& normal, double distance) {
  constexpr double rounded = 1e-6;
  double farthest = distance;
  double longest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    farthest = std::max(farthest, p[i].length());
    longest = std::max(longest, (p[(i + 1) % 3] - p[i]).length());
  }
  // Twice the area over the longest edge is the triangle's height.
  return rounded * farthest * longest / normal.length();
}

/// tan of the largest angle between a ray of the frame and the axis, squared.
double widest2(const V2d& window_centre, const V2d& window_half) {
  const V2d farthest(std::abs(window_centre.x) + window_half.x, std::abs(window_centre.y) + window_half.y);
  return farthest.length2();
}

class FromCamera {
 public:
  FromCamera(const Camera& camera, int height)
      : camera_(camera),
        clip_(clip_matrix(camera, V3d(0, 0, 0))),
        pixel_(2 * camera.window_half.y / height),
        widest2_(widest2(camera.window_centre, camera.window_half)) {}

  Spans of(const std::array<V3d, 3>& p) const {
    double nearest = HUGE_VAL;
    double farthest = 0;
    double distance = 0;
    double slope2 = 0;  // tan of the angle between the axis and the ray to a corner, squared
    std::array<int, 4> outside{};
    for (const V3d& corner : p) {
      const auto row = [&](unsigned k) {
        return corner.x * clip_[0][k] + corner.y * clip_[1][k] + corner.z * clip_[2][k] + clip_[3][k];
      };
      const double w = row(3);
      outside[0] += row(0) < -w ? 1 : 0;
      outside[1] += row(0) > w ? 1 : 0;
      outside[2] += row(1) < -w ? 1 : 0;
      outside[3] += row(1) > w ? 1 : 0;
      const V3d away = camera_.position - corner;
      const double depth = away.dot(camera_.back());
      nearest = std::min(nearest, depth);
      farthest = std::max(farthest, depth);
      distance = std::max(distance, away.length());
      slope2 = std::max(slope2, away.length2() / (depth * depth) - 1);
    }
    if (std::any_of(outside.begin(), outside.end(), [](int n) { return n == 3; })) return {};
    const V3d cross = (p[1] - p[0]).cross(p[2] - p[0]);
    const V3d normal = cross.normalized();
    // Of what is not a number, or nearly edge on, both sides count.
    const double blur = plane_blur(p, cross, distance);
    const auto has_front = [&](double sine) { return !(sine < -blur); };
    const auto has_back = [&](double sine) { return !(sine > blur); };
    if (camera_.projection == Projection::parallel) {
      const V3d towards = camera_.to_viewer.normalized();
      const double cosine = normal.dot(towards);
      return {pixel_ * std::abs(towards.dot(camera_.back())), pixel_, pixel_ / std::abs(cosine),
              has_front(cosine), has_back(cosine)};
    }
    // A pixel's disc falls on a surface along the ray through it; no surface catches less than what lies
    // across the ray, nor more than what lies along the plane of both.
    if (!(nearest > 0) || !(slope2 < widest2_)) slope2 = widest2_;
    const double depth = std::max(nearest, camera_.near);
    const double deepest = std::max(std::min(farthest, camera_.far), depth);
    const double height = normal.dot(camera_.position - p[0]);
    return {pixel_ * depth / std::sqrt(1 + slope2), pixel_ * deepest,
            pixel_ * deepest * distance / std::abs(height), has_front(height / distance),
            has_back(height / distance)};
  }

 private:
  const Camera& camera_;
  M44d clip_;
  double pixel_;
  double widest2_;
};

class FromAllAround {
 public:
  FromAllAround(const Orbit& around, int height)
      : around_(around),
        pixel_(2 * around.window_half.y / height),
        widest2_(widest2(around.window_centre, around.window_half)) {}

  Spans of(const std::array<V3d, 3>& p) const {
    double radius = 0;
    for (const V3d& corner : p) radius = std::max(radius, (corner - around_.middle).length());
    if (around_.projection == Projection::parallel)
      return {pixel_ * around_.nearest, pixel_ * around_.farthest, HUGE_VAL, true, true};
    // By how far a point lies in front of the middle, slice by slice: there it is so deep at least, and so
    // far from the axis at most.
    constexpr int slices = 16;
    double least = HUGE_VAL;
    for (int i = 0; i < slices; ++i) {
      const double behind = radius * (2.0 * i / slices - 1);
      const double before = radius * (2.0 * (i + 1) / slices - 1);
      const double depth = std::max(around_.nearest - before, 0.0);
      const V2d aside = around_.reach - around_.slope * behind;
      const double slope2 = std::min(aside.length2() / (depth * depth), widest2_);
      least = std::min(least, depth > 0 ? depth / std::sqrt(1 + slope2) : 0.0);
    }
    return {pixel_ * least, pixel_ * (around_.farthest + radius), HUGE_VAL, true, true};
  }

 private:
  const Orbit& around_;
  double pixel_;
  double widest2_;
};

template <class From>
void add_cover(const From& from, const Scene& scene, const SceneInstance& instance, int taps, const V2d& unit,
               PixelCover& cover) {
  const ScenePrimitive& primitive = scene.primitives[instance.primitive];
  const FabricReference& fabric = *scene.materials[primitive.material].fabric;
  const bool double_sided = scene.materials[primitive.material].double_sided;
  const auto set = static_cast<std::size_t>(fabric.tex_coord);
  if (set >= primitive.tex_coords.size() || primitive.tex_coords[set].size() != primitive.positions.size()) {
    cover |= PixelCover{0, HUGE_VAL, true, double_sided};  // whoever draws it says what is wrong with it
    return;
  }
  const bool mirrored = instance.world.determinant() < 0;
  for (std::size_t k = 0; k + 2 < primitive.indices.size(); k += 3) {
    std::array<V3d, 3> p;
    std::array<V2d, 3> at;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t vertex = primitive.indices[k + i];
      instance.world.multVecMatrix(V3d(primitive.positions[vertex]), p[i]);
      at[i] = fabric.transform.apply(primitive.tex_coords[set][vertex]) * unit;
    }
    const Stretch stretch = stretch_of(p, at);
    if (stretch.least == HUGE_VAL) continue;
    const Spans spans = from.of(p);
    if (spans.least == HUGE_VAL) continue;
    PixelCover here{stretch.least * spans.least, stretch.most * std::max(spans.most, spans.longest / taps),
                    mirrored ? spans.back : spans.front,
                    (mirrored ? spans.front : spans.back) && double_sided};
    if (!here.fronts && !here.backs) continue;
    // What is not a number must not hide a level.
    if (std::isnan(here.least)) here.least = 0;
    if (std::isnan(here.most)) here.most = HUGE_VAL;
    cover |= here;
  }
}

}  // namespace

Result<Orbit> look_all_around(std::span<const V3d> points, double aspect, double nearest, double farthest,
                              const CameraOptions& options) {
  const auto refuse = [](const char* option, const char* reason) {
    return fail(Code::option_out_of_range, "", option, reason);
  };
  if (!(nearest > 0 && farthest >= nearest && farthest <= 1e12))
    return refuse("--distance", "must be two distances above 0 and at most 1e12 metres, the nearer first");
  if (options.look_at)
    return refuse("--look-at", "is the scene's middle where it is looked at from all around");
  CameraOptions one = options;
  one.distance = 1;
  const Result<Camera> camera = make_camera(points, aspect, one);
  if (!camera) return tl::unexpected(camera.error());
  Imath::Box3d bounds;
  for (const V3d& point : points) bounds.extendBy(point);
  Orbit around;
  around.nearest = nearest;
  around.farthest = farthest;
  around.middle = bounds.center();
  around.projection = options.projection;
  around.window_half = camera->window_half;
  around.window_centre = camera->window_centre;
  // Before the frame was narrowed: make_camera() centres the points in the whole of it.
  around.slope = camera->window_half * options.zoom;
  double radius = 0;
  for (const V3d& point : points) radius = std::max(radius, (point - around.middle).length());
  around.reach = V2d(radius * std::sqrt(1 + around.slope.x * around.slope.x),
                     radius * std::sqrt(1 + around.slope.y * around.slope.y));
  return around;
}

PixelCover& PixelCover::operator|=(const PixelCover& other) {
  least = std::min(least, other.least);
  most = std::max(most, other.most);
  fronts = fronts || other.fronts;
  backs = backs || other.backs;
  return *this;
}

std::vector<PixelCover> pixel_covers(const Scene& scene, const Viewpoints& sight, int height, int taps,
                                     std::span<const V2d> units) {
  std::vector<PixelCover> covers(scene.materials.size());
  const auto add_all = [&](const auto& from) {
    for (const SceneInstance& instance : scene.instances) {
      const int material = scene.primitives[instance.primitive].material;
      if (material < 0 || !scene.materials[material].fabric) continue;
      const auto i = static_cast<std::size_t>(material);
      add_cover(from, scene, instance, taps, units[i], covers[i]);
    }
  };
  if (const Camera* camera = std::get_if<Camera>(&sight)) {
    add_all(FromCamera(*camera, height));
  } else {
    add_all(FromAllAround(std::get<Orbit>(sight), height));
  }
  return covers;
}

LevelRange levels_asked(const PixelCover& cover, const LevelOptions& options, int levels) {
  const auto level = [&](double texels) {
    return std::log2(std::clamp(texels, 1e-30, 1e30)) + static_cast<double>(options.bias);
  };
  const double last = levels - 1;
  const double first = std::clamp(std::floor(level(cover.least) - rounding), 0.0, last);
  const double coarsest = std::clamp(std::ceil(level(cover.most) + rounding), first, last);
  return {static_cast<int>(first), static_cast<int>(cover.most > 0 ? coarsest : last)};
}

LevelRange levels_for(const TexelDemand& demand, const V2d& texel_mm, int levels) {
  // Beside what levels_asked() spares for what is rounded away: repeats are stored rounded, too.
  constexpr double spare = 1 + 1e-3;
  PixelCover cover;
  // Whatever the directions are in which a pixel is long and short: level by level no finer than this, no
  // coarser than that.
  cover.least = demand.min_mm / std::max(texel_mm.x, texel_mm.y) / spare;
  cover.most = demand.max_mm / std::min(texel_mm.x, texel_mm.y) * spare;
  LevelOptions options;
  options.bias = static_cast<float>(demand.bias);
  return levels_asked(cover, options, levels);
}

LackingLevels& LackingLevels::operator|=(const LackingLevels& other) {
  finer = std::max(finer, other.finer);
  coarser = std::max(coarser, other.coarser);
  return *this;
}

LackingLevels lacking_levels(const FabricHeader& header, const LevelRange& asked) {
  const int first = first_level(header);
  return {std::max(first - asked.first, 0), std::max(asked.last - (first + header.levels - 1), 0)};
}

Error lacking_issue(const std::string& name, const FabricHeader& header, const LackingLevels& lacking) {
  const int first = first_level(header);
  const int last = first + header.levels - 1;
  return {Code::fabric_levels, name, "/whole",
          fmt::format("the file has {} of the whole, and {} may be asked for: the nearest there are take "
                      "their place",
                      levels_text(first, last), levels_text(first - lacking.finer, last + lacking.coarser))};
}

std::optional<Error> lacking_issue(const std::string& name, const FabricHeader& header, int wanted) {
  const int first = first_level(header);
  const int last = first + header.levels - 1;
  // What has no `whole` lacks nothing.
  const int all = header.whole ? std::max(header.whole->levels, last + 1) : last + 1;
  const int level = std::min(wanted, all - 1);
  if (level >= first && level <= last) return std::nullopt;
  return Error{
      Code::fabric_levels, name, "/whole",
      fmt::format("the file has {} of the whole, and level {} is asked for: the nearest there is takes "
                  "its place",
                  levels_text(first, last), level)};
}

std::vector<LevelRange> levels_asked(const Scene& scene, const Camera& camera, int height,
                                     const LevelOptions& options,
                                     std::span<const FabricHeader* const> headers,
                                     std::vector<LackingLevels>* lacking) {
  std::vector<V2d> units;
  for (const SceneMaterial& material : scene.materials) {
    units.push_back(material.fabric ? V2d(whole_texels(*headers[material.fabric->fabric])) : V2d(1, 1));
  }
  const std::vector<PixelCover> covers = pixel_covers(scene, camera, height, options.taps, units);
  std::vector<PixelCover> of_fabric(headers.size());
  for (std::size_t i = 0; i < covers.size(); ++i) {
    if (scene.materials[i].fabric) of_fabric[scene.materials[i].fabric->fabric] |= covers[i];
  }
  std::vector<LevelRange> ranges;
  if (lacking != nullptr) lacking->assign(headers.size(), {});
  for (std::size_t i = 0; i < headers.size(); ++i) {
    const int before = first_level(*headers[i]);
    const int last = headers[i]->levels - 1;
    const LevelRange of_whole = levels_asked(of_fabric[i], options, whole_levels(*headers[i]));
    const bool seen = of_fabric[i].fronts || of_fabric[i].backs;
    if (lacking != nullptr && seen) (*lacking)[i] = lacking_levels(*headers[i], of_whole);
    ranges.push_back(
        {std::clamp(of_whole.first - before, 0, last), std::clamp(of_whole.last - before, 0, last)});
  }
  return ranges;
}

}  // namespace selvedge
