#include "format/scene/camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

Result<void> check(const CameraOptions& o) {
  const auto refuse = [](const char* option, const char* reason) -> Result<void> {
    return fail(Code::option_out_of_range, "", option, reason);
  };
  if (!std::isfinite(o.azimuth)) return refuse("--azimuth", "must be finite");
  if (!(std::abs(o.elevation) <= 90)) return refuse("--elevation", "must lie between -90 and 90 degrees");
  if (!(o.field_of_view >= 0.1 && o.field_of_view <= 170))
    return refuse("--fov", "must lie between 0.1 and 170 degrees");
  if (o.distance && !(*o.distance > 0 && *o.distance <= 1e12))
    return refuse("--distance", "must be above 0 and at most 1e12 metres");
  if (o.look_at && !std::isfinite(o.look_at->length2())) return refuse("--look-at", "must be finite");
  if (!(o.zoom > 0 && o.zoom <= 1e9)) return refuse("--zoom", "must be above 0 and at most 1e9");
  if (!(std::abs(o.zoom_centre.x - 0.5) <= 1e3 && std::abs(o.zoom_centre.y - 0.5) <= 1e3))
    return refuse("--focus", "must lie near [0, 1]");
  return {};
}

/// Narrows the frame by the zoom, around the focus.
void apply_zoom(const CameraOptions& options, Camera& camera) {
  camera.window_centre =
      V2d(2 * options.zoom_centre.x - 1, 1 - 2 * options.zoom_centre.y) * camera.window_half_size;
  camera.window_half_size /= options.zoom;
}

}  // namespace

Imath::Box3d bounding_box(std::span<const V3d> points) {
  Imath::Box3d box;
  for (const V3d& point : points) box.extendBy(point);
  return box;
}

M44d clip_matrix(const Camera& camera, const V3d& origin) {
  const V3d back = camera.image_normal();
  const V3d shift = origin - camera.position;
  // World -> camera: x right, y up, z towards the viewer.
  const M44d to_camera(camera.right.x, camera.up.x, back.x, 0,  //
                       camera.right.y, camera.up.y, back.y, 0,  //
                       camera.right.z, camera.up.z, back.z, 0,  //
                       shift.dot(camera.right), shift.dot(camera.up), shift.dot(back), 1);
  const V2d h = camera.window_half_size;
  const V2d c = camera.window_centre;
  const double n = camera.near;
  const double f = camera.far;
  if (camera.projection == Projection::perspective) {
    const M44d to_clip(1 / h.x, 0, 0, 0,                              //
                       0, 1 / h.y, 0, 0,                              //
                       c.x / h.x, c.y / h.y, -(f + n) / (f - n), -1,  //
                       0, 0, -2 * f * n / (f - n), 0);
    return to_camera * to_clip;
  }
  // Points are projected along the viewing direction onto the image plane.
  const double slant_x = camera.to_viewer.dot(camera.right) / camera.to_viewer.dot(back);
  const double slant_y = camera.to_viewer.dot(camera.up) / camera.to_viewer.dot(back);
  const M44d to_clip(1 / h.x, 0, 0, 0,                                 //
                     0, 1 / h.y, 0, 0,                                 //
                     -slant_x / h.x, -slant_y / h.y, -2 / (f - n), 0,  //
                     -c.x / h.x, -c.y / h.y, -(f + n) / (f - n), 1);
  return to_camera * to_clip;
}

V3d view_direction(const Camera& camera, const V2d& image_point) {
  if (camera.projection == Projection::parallel) return camera.to_viewer;
  const V2d p = camera.window_centre + image_point * camera.window_half_size;
  return (camera.image_normal() - camera.right * p.x - camera.up * p.y).normalized();
}

ViewDirections view_directions(const Camera& camera, int width, int height) {
  if (camera.projection == Projection::parallel) return {V3f(camera.to_viewer), V3f(0), V3f(0)};
  const V3d base =
      camera.image_normal() - camera.right * camera.window_centre.x - camera.up * camera.window_centre.y;
  return {V3f(base), V3f(camera.right * (-2 * camera.window_half_size.x / width)),
          V3f(camera.up * (-2 * camera.window_half_size.y / height))};
}

Result<Camera> make_camera(std::span<const V3d> points, double aspect, const CameraOptions& options) {
  if (const auto good = check(options); !good) return tl::unexpected(good.error());

  Camera camera{.projection = options.projection};
  const double azimuth = options.azimuth * radians_per_degree;
  const double elevation = options.elevation * radians_per_degree;
  // `right` depends on the azimuth alone, so that looking straight down is no special case.
  camera.right = V3d(std::cos(azimuth), 0, -std::sin(azimuth));
  const V3d back(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                 std::cos(elevation) * std::cos(azimuth));
  camera.up = back.cross(camera.right).normalized();
  camera.to_viewer = back;

  const Imath::Box3d bounds = bounding_box(points);
  const V3d look_at = options.look_at.value_or(bounds.center());
  const double size = std::max((bounds.max - bounds.min).length(), 1e-9);
  const double slope_y = std::tan(options.field_of_view * radians_per_degree / 2);
  const V2d slope(slope_y * aspect, slope_y);

  // Extents of the points towards the sides of the view, (right, up) and (left, down): along x + slope * z in
  // perspective, along x in parallel projection.
  const V2d slant = options.projection == Projection::perspective ? slope : V2d(0, 0);
  V2d max_extent(-HUGE_VAL, -HUGE_VAL);
  V2d min_extent(-HUGE_VAL, -HUGE_VAL);
  double nearest = -HUGE_VAL;
  double farthest = HUGE_VAL;
  for (const V3d& point : points) {
    const V3d p = point - look_at;
    const V2d in_image(p.dot(camera.right), p.dot(camera.up));
    const double z = p.dot(back);
    for (unsigned i = 0; i < 2; ++i) {
      max_extent[i] = std::max(max_extent[i], in_image[i] + slant[i] * z);
      min_extent[i] = std::max(min_extent[i], -in_image[i] + slant[i] * z);
    }
    nearest = std::max(nearest, z);
    farthest = std::min(farthest, z);
  }
  // Centres the points, unless the options name the point in the middle.
  const V2d shift = options.look_at ? V2d(0, 0) : (max_extent - min_extent) / 2.0;
  const V3d target = look_at + camera.right * shift.x + camera.up * shift.y;
  const V2d reach(std::max(max_extent.x - shift.x, min_extent.x + shift.x),
                  std::max(max_extent.y - shift.y, min_extent.y + shift.y));
  const double fit_distance = std::max(reach.x / slope.x, reach.y / slope.y);
  const double fit_half_height = std::max(reach.x / aspect, reach.y);
  constexpr double margin = 1.05;
  const double distance = options.distance.value_or(std::max(fit_distance, 1e-3 * size) * margin);
  if (options.projection == Projection::perspective) {
    camera.position = target + back * distance;
    camera.window_half_size = slope;
    camera.far = std::max(distance - farthest, 1e-9) * 1.01 + 1e-3 * size;
    camera.near = std::max({distance - nearest - 1e-3 * size, camera.far * 1e-4, 1e-12});
  } else {
    camera.position = target;
    const double half_height =
        options.distance ? *options.distance * slope_y : std::max(fit_half_height, 1e-3 * size) * margin;
    camera.window_half_size = V2d(half_height * aspect, half_height);
    camera.near = -nearest - 1e-2 * size;
    camera.far = -farthest + 1e-2 * size;
  }
  apply_zoom(options, camera);
  return camera;
}

Result<Camera> find_scene_camera(const Scene& scene, const std::string& wanted, std::span<const V3d> points,
                                 double aspect, const CameraOptions& options) {
  if (const auto good = check(options); !good) return tl::unexpected(good.error());
  const SceneCamera* found = nullptr;
  std::string present;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const SceneCamera& candidate = scene.cameras[i];
    // A name takes precedence over a number.
    if (candidate.name == wanted || (found == nullptr && fmt::format("{}", i) == wanted)) found = &candidate;
    present += fmt::format("{}{} \"{}\"", i == 0 ? "" : ", ", i, candidate.name);
  }
  if (found == nullptr)
    return fail(
        Code::option_out_of_range, scene.file, "--camera",
        fmt::format("there is no \"{}\"; the scene has {}", wanted, present.empty() ? "none" : present));
  const M44d& m = found->world;
  Camera camera{.position = V3d(m[3][0], m[3][1], m[3][2])};
  // Scales of the camera's node are ignored.
  const V3d back = V3d(m[2][0], m[2][1], m[2][2]).normalized();
  const V3d up(m[1][0], m[1][1], m[1][2]);
  camera.right = up.cross(back).normalized();
  camera.up = back.cross(camera.right);
  camera.to_viewer = back;
  if (camera.right.length() < 0.5)
    return fail(Code::gltf_malformed, scene.file, "--camera", "its node has no direction upwards");
  camera.projection = found->is_perspective ? Projection::perspective : Projection::parallel;
  V2d half = found->half_size;
  double own_aspect = half.x / half.y;
  if (found->is_perspective) {
    own_aspect = found->aspect.value_or(aspect);
    half.y = std::tan(found->yfov / 2);
  }
  half.y *= std::max(1.0, own_aspect / aspect);  // the frame contains the camera's own
  camera.window_half_size = V2d(half.y * aspect, half.y);
  double farthest = found->znear;
  for (const V3d& point : points) farthest = std::max(farthest, (camera.position - point).dot(back));
  camera.near = found->znear;
  camera.far = found->zfar.value_or(farthest * 1.01 + 1e-9);
  if (!(camera.far > camera.near)) camera.far = camera.near * 2 + 1e-9;
  apply_zoom(options, camera);
  return camera;
}

}  // namespace selvedge
