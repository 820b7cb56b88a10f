#include "format/scene/pixel_cover.h"

#include <Imath/ImathBox.h>

#include <algorithm>
#include <array>

#include "format/scene/footprint.h"

namespace selvedge {
namespace {

/// Singular values of the map from the plane of a triangle to its texture, units per metre.
struct Stretch {
  double min = HUGE_VAL;  ///< infinite without area: no pixel sees the triangle
  double max = 0;
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

/// Bounds of a pixel's footprint on a triangle, m, not negative: of the shorter axis, and of the longer one.
struct Spans {
  double min_short = HUGE_VAL;  ///< infinite: no pixel sees the triangle
  double max_short = 0;
  double max_long = 0;
  bool front = false;  ///< may be seen; both sides if rounding decides between them
  bool back = false;
};

/// Error of the sine of the angle between a triangle's plane and a ray of length `distance`, with positions
/// in single precision.
double plane_error(const std::array<V3d, 3>& p, const V3d& normal, double distance) {
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

/// Squared tangent of the largest angle between a ray of the frame and the axis.
double max_slope2(const V2d& window_centre, const V2d& window_half) {
  const V2d farthest(std::abs(window_centre.x) + window_half.x, std::abs(window_centre.y) + window_half.y);
  return farthest.length2();
}

class CameraSpans {
 public:
  CameraSpans(const Camera& camera, int height)
      : camera_(camera),
        clip_(clip_matrix(camera, V3d(0, 0, 0))),
        pixel_(2 * camera.window_half.y / height),
        max_slope2_(max_slope2(camera.window_centre, camera.window_half)) {}

  Spans operator()(const std::array<V3d, 3>& p) const {
    double nearest = HUGE_VAL;
    double farthest = 0;
    double distance = 0;
    double slope2 = 0;  // squared tangent of the angle between the axis and the ray to a corner
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
    // Both sides of a triangle count if it is not finite or nearly edge on.
    const double error = plane_error(p, cross, distance);
    const auto has_front = [&](double sine) { return !(sine < -error); };
    const auto has_back = [&](double sine) { return !(sine > error); };
    if (camera_.projection == Projection::parallel) {
      const V3d towards = camera_.to_viewer.normalized();
      const double cosine = normal.dot(towards);
      return {pixel_ * std::abs(towards.dot(camera_.back())), pixel_, pixel_ / std::abs(cosine),
              has_front(cosine), has_back(cosine)};
    }
    // The footprint is the projection of the pixel's disc along the ray: never smaller than the disc, and
    // longest in the plane of ray and normal.
    if (!(nearest > 0) || !(slope2 < max_slope2_)) slope2 = max_slope2_;
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
  double max_slope2_;
};

class OrbitSpans {
 public:
  OrbitSpans(const Orbit& orbit, int height)
      : orbit_(orbit),
        pixel_(2 * orbit.window_half.y / height),
        max_slope2_(max_slope2(orbit.window_centre, orbit.window_half)) {}

  Spans operator()(const std::array<V3d, 3>& p) const {
    double radius = 0;
    for (const V3d& corner : p) radius = std::max(radius, (corner - orbit_.middle).length());
    if (orbit_.projection == Projection::parallel)
      return {pixel_ * orbit_.nearest, pixel_ * orbit_.farthest, HUGE_VAL, true, true};
    // Bounds of depth and distance from the axis, for slices of points by their distance before the middle.
    constexpr int slices = 16;
    double min_depth = HUGE_VAL;
    for (int i = 0; i < slices; ++i) {
      const double behind = radius * (2.0 * i / slices - 1);
      const double before = radius * (2.0 * (i + 1) / slices - 1);
      const double depth = std::max(orbit_.nearest - before, 0.0);
      const V2d aside = orbit_.reach - orbit_.slope * behind;
      const double slope2 = std::min(aside.length2() / (depth * depth), max_slope2_);
      min_depth = std::min(min_depth, depth > 0 ? depth / std::sqrt(1 + slope2) : 0.0);
    }
    return {pixel_ * min_depth, pixel_ * (orbit_.farthest + radius), HUGE_VAL, true, true};
  }

 private:
  const Orbit& orbit_;
  double pixel_;
  double max_slope2_;
};

template <class SpansOf>
void add_cover(const SpansOf& spans_of, const Scene& scene, const SceneInstance& instance, const V2d& unit,
               PixelCover& cover) {
  const ScenePrimitive& primitive = scene.primitives[instance.primitive];
  const FabricReference& fabric = *scene.materials[primitive.material].fabric;
  const bool double_sided = scene.materials[primitive.material].double_sided;
  const auto& tex_coords = primitive.tex_coords;
  const int set = fabric.tex_coord;
  if (set >= std::ssize(tex_coords) || tex_coords[set].size() != primitive.positions.size()) {
    cover |= PixelCover{0, HUGE_VAL, true, double_sided};  // the renderer names the fault
    return;
  }
  const bool mirrored = instance.world.determinant() < 0;
  for (std::size_t k = 0; k + 2 < primitive.indices.size(); k += 3) {
    std::array<V3d, 3> p;
    std::array<V2d, 3> at;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t vertex = primitive.indices[k + i];
      instance.world.multVecMatrix(V3d(primitive.positions[vertex]), p[i]);
      at[i] = fabric.transform.apply(tex_coords[set][vertex]) * unit;
    }
    const Stretch stretch = stretch_of(p, at);
    if (stretch.min == HUGE_VAL) continue;
    const Spans spans = spans_of(p);
    if (spans.min_short == HUGE_VAL) continue;
    PixelCover here{stretch.min * spans.min_short,
                    stretch.max * std::max(std::sqrt(spans.max_short * spans.max_long),
                                           spans.max_long / std::sqrt(static_cast<double>(max_elongation))),
                    mirrored ? spans.back : spans.front,
                    (mirrored ? spans.front : spans.back) && double_sided};
    if (!here.fronts && !here.backs) continue;
    // NaN must not hide a level.
    if (std::isnan(here.min_size)) here.min_size = 0;
    if (std::isnan(here.max_size)) here.max_size = HUGE_VAL;
    cover |= here;
  }
}

}  // namespace

Result<Orbit> make_orbit(std::span<const V3d> points, double aspect, double nearest, double farthest,
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
  Orbit orbit;
  orbit.nearest = nearest;
  orbit.farthest = farthest;
  orbit.middle = bounds.center();
  orbit.projection = options.projection;
  orbit.window_half = camera->window_half;
  orbit.window_centre = camera->window_centre;
  // Of the frame before zooming, in which make_camera() centres the points.
  orbit.slope = camera->window_half * options.zoom;
  double radius = 0;
  for (const V3d& point : points) radius = std::max(radius, (point - orbit.middle).length());
  orbit.reach = V2d(radius * std::sqrt(1 + orbit.slope.x * orbit.slope.x),
                    radius * std::sqrt(1 + orbit.slope.y * orbit.slope.y));
  return orbit;
}

PixelCover& PixelCover::operator|=(const PixelCover& other) {
  min_size = std::min(min_size, other.min_size);
  max_size = std::max(max_size, other.max_size);
  fronts = fronts || other.fronts;
  backs = backs || other.backs;
  return *this;
}

StepBound step_bound(const Camera& camera, int height) {
  return [spans_of = CameraSpans(camera, height)](const std::array<V3d, 3>& points,
                                                  const std::array<V2d, 3>& at) {
    const Stretch stretch = stretch_of(points, at);
    const Spans spans = spans_of(points);
    if (stretch.min == HUGE_VAL || spans.min_short == HUGE_VAL) return HUGE_VAL;
    // The longer of two columns is at least the longest image of the unit circle, over the root of two.
    const double step = stretch.max * spans.min_short / std::sqrt(2.0);
    return std::isnan(step) ? 0.0 : step;
  };
}

std::vector<PixelCover> pixel_covers(const Scene& scene, const Viewpoints& viewpoints, int height,
                                     std::span<const V2d> units) {
  std::vector<PixelCover> covers(scene.materials.size());
  const auto add_all = [&](const auto& spans_of) {
    for (const SceneInstance& instance : scene.instances) {
      const int material = scene.primitives[instance.primitive].material;
      if (material < 0 || !scene.materials[material].fabric) continue;
      add_cover(spans_of, scene, instance, units[material], covers[material]);
    }
  };
  if (const Camera* camera = std::get_if<Camera>(&viewpoints)) {
    add_all(CameraSpans(*camera, height));
  } else {
    add_all(OrbitSpans(std::get<Orbit>(viewpoints), height));
  }
  return covers;
}

}  // namespace selvedge
