#include "viewer/orbit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace selvedge {
namespace {

constexpr double degrees_per_height = 180;
constexpr double factor_per_step = 0.9;

/// Half the height of the view at the distance of the orbit's point, m.
double half_height(const CameraOptions& orbit) {
  return *orbit.distance * std::tan(orbit.field_of_view * radians_per_degree / 2) / orbit.zoom;
}

V3d turned(const V3d& v, const V3d& axis, double degrees) {
  const double angle = degrees * radians_per_degree;
  return v * std::cos(angle) + axis.cross(v) * std::sin(angle) + axis * (axis.dot(v) * (1 - std::cos(angle)));
}

}  // namespace

Camera camera_axes(const CameraOptions& options) {
  CameraOptions plain;
  plain.azimuth = options.azimuth;
  plain.elevation = options.elevation;
  return make_camera(std::array{V3d(0, 0, 0)}, 1, plain).value_or(Camera{});
}

std::vector<V3d> box_corners(std::span<const V3d> points) {
  const Imath::Box3d bounds = bounding_box(points);
  std::vector<V3d> corners;
  for (const double x : {bounds.min.x, bounds.max.x})
    for (const double y : {bounds.min.y, bounds.max.y})
      for (const double z : {bounds.min.z, bounds.max.z}) corners.emplace_back(x, y, z);
  return corners;
}

Result<CameraOptions> start_orbit(std::span<const V3d> points, double aspect, const CameraOptions& options) {
  CameraOptions orbit = options;
  if (!orbit.look_at) orbit.look_at = bounding_box(points).center();
  const Result<Camera> camera = make_camera(points, aspect, orbit);
  if (!camera) return tl::unexpected(camera.error());
  if (!orbit.distance) {
    const double slope = std::tan(orbit.field_of_view * radians_per_degree / 2);
    orbit.distance = orbit.projection == Projection::perspective
                         ? (camera->position - *orbit.look_at).dot(camera->image_normal())
                         : camera->window_half_size.y * orbit.zoom / slope;
  }
  return orbit;
}

void turn(CameraOptions& orbit, const V2d& drag) {
  orbit.azimuth = std::remainder(orbit.azimuth - drag.x * degrees_per_height, 360);
  orbit.elevation = std::clamp(orbit.elevation - drag.y * degrees_per_height, -90.0, 90.0);
}

void pan(CameraOptions& orbit, const V2d& drag) {
  const Camera axes = camera_axes(orbit);
  *orbit.look_at -= (axes.right * drag.x + axes.up * drag.y) * (2 * half_height(orbit));
}

void dolly(CameraOptions& orbit, double steps, const V2d& cursor, double aspect, double size) {
  const Camera axes = camera_axes(orbit);
  const double old_height = half_height(orbit);
  orbit.distance = std::clamp(*orbit.distance * std::pow(factor_per_step, steps), 1e-4 * size, 100 * size);
  const double lost = old_height - half_height(orbit);
  *orbit.look_at += axes.right * (cursor.x * aspect * lost) + axes.up * (cursor.y * lost);
}

void orbit_about(CameraOptions& orbit, const V3d& seen) {
  if (orbit.projection == Projection::parallel) return;
  const V3d back = camera_axes(orbit).image_normal();
  const V3d eye = *orbit.look_at + back * *orbit.distance;
  const double depth = (eye - seen).dot(back);
  if (!(depth > 0)) return;
  orbit.look_at = eye - back * depth;
  orbit.distance = depth;
}

V3d turn_light(const V3d& direction, const V2d& drag) {
  const V3d around = turned(direction, V3d(0, 1, 0), drag.x * degrees_per_height);
  return turned(around, V3d(1, 0, 0), -drag.y * degrees_per_height).normalized();
}

Result<std::vector<CameraOptions>> turntable(std::span<const V3d> points, double aspect,
                                             const CameraOptions& options, int frames, bool has_top) {
  std::vector<CameraOptions> views(frames + (has_top ? 1 : 0), options);
  const Imath::Box3d box = bounding_box(points);
  double distance = 0;
  for (int i = 0; i < static_cast<int>(views.size()); ++i) {
    if (i < frames)
      views[i].azimuth += 360.0 * i / frames;
    else
      views[i].elevation = 90;
    const Result<CameraOptions> view = start_orbit(points, aspect, views[i]);
    if (!view) return tl::unexpected(view.error());
    views[i] = *view;
    distance = std::max(distance, *view->distance);
  }
  for (CameraOptions& view : views) {
    view.distance = distance;
    if (view.projection == Projection::perspective &&
        box.intersects(*view.look_at + camera_axes(view).image_normal() * distance))
      return fail(Code::option_out_of_range, "", "--distance",
                  fmt::format("the camera at azimuth {:g} is inside the garment", view.azimuth));
  }
  return views;
}

}  // namespace selvedge
