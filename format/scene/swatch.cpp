#include "format/scene/swatch.h"

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

constexpr double field_of_view = 10 * radians_per_degree;

struct Place {
  double elevation;  ///< degrees above the cloth
  double azimuth;    ///< degrees from the courses; not 0, where a picture would show one column of texels
  double repeats;    ///< of the longer period
  bool across;       ///< the repeats fill the width at the middle of the frame, not the height
};

/// In the order of SwatchView.
constexpr std::array places{Place{60, 20, 2, false}, Place{45, -50, 6, false}, Place{72, 130, 64, false},
                            Place{12, 70, 6, true}};

}  // namespace

std::string_view name_of(SwatchView view) { return swatch_view_names[static_cast<int>(view)]; }

SwatchShot swatch_shot(SwatchView view, const V2d& period_mm, int width, int height) {
  const Place& place = places[static_cast<int>(view)];
  const double azimuth = place.azimuth * radians_per_degree;
  const double elevation = place.elevation * radians_per_degree;
  const double aspect = static_cast<double>(width) / height;
  const double extent = place.repeats * std::max(period_mm.x, period_mm.y) / 1000;
  SwatchShot shot;
  shot.width = width;
  shot.height = height;
  Camera& camera = shot.camera;
  camera.window_half_size.y = std::tan(field_of_view / 2);
  camera.window_half_size.x = camera.window_half_size.y * aspect;
  const double distance = extent / 2 / (place.across ? camera.window_half_size.x : camera.window_half_size.y);
  const V3d back(std::cos(elevation) * std::sin(azimuth), -std::cos(elevation) * std::cos(azimuth),
                 std::sin(elevation));
  camera.right = V3d(std::cos(azimuth), std::sin(azimuth), 0);
  camera.up = back.cross(camera.right).normalized();
  camera.to_viewer = back;
  camera.position = back * distance;
  camera.near = distance * 0.01;
  camera.far = distance * 100;
  shot.lights = key_and_fill_lights();
  return shot;
}

Scene swatch_scene(const V2d& period_mm, const V2i& first, const V2i& end) {
  ScenePrimitive primitive;
  primitive.name = "swatch/0";
  primitive.material = 0;
  for (const V2i& corner : {first, V2i(end.x, first.y), end, V2i(first.x, end.y)}) {
    const V2d at = V2d(corner) * period_mm / 1000.0;
    // v grows downwards.
    primitive.positions.emplace_back(static_cast<float>(at.x), static_cast<float>(-at.y), 0.0F);
    primitive.normals.emplace_back(0.0F, 0.0F, 1.0F);
    primitive.tex_coords[0].emplace_back(corner);
  }
  primitive.indices = {0, 3, 2, 0, 2, 1};
  Scene scene;
  scene.file = "swatch";
  scene.primitives.push_back(std::move(primitive));
  scene.instances.emplace_back();
  SceneMaterial material;
  material.name = "swatch";
  material.fabric = FabricReference{};
  material.alpha_mode = AlphaMode::blend;
  material.double_sided = true;
  scene.materials.push_back(material);
  return scene;
}

Scene swatch_scene(const V2d& period_mm, const SwatchShot& shot) {
  V2d low(0, 0);
  V2d high(0, 0);
  for (const double s : {-1.0, 1.0}) {
    for (const double t : {-1.0, 1.0}) {
      const auto ray = find_swatch_hit(shot.camera, {s, t});
      if (!ray) continue;
      const V2d repeats = ray->point_m * 1000.0 / period_mm * V2d(1, -1);
      low = V2d(std::min(low.x, repeats.x), std::min(low.y, repeats.y));
      high = V2d(std::max(high.x, repeats.x), std::max(high.y, repeats.y));
    }
  }
  // One repeat more on each side: footprints of pixels at the border extend beyond it.
  return swatch_scene(period_mm,
                      V2i(static_cast<int>(std::floor(low.x)) - 1, static_cast<int>(std::floor(low.y)) - 1),
                      V2i(static_cast<int>(std::ceil(high.x)) + 1, static_cast<int>(std::ceil(high.y)) + 1));
}

std::optional<SwatchHit> find_swatch_hit(const Camera& camera, const V2d& image_point) {
  SwatchHit ray{.view = view_direction(camera, image_point)};
  V3d from = camera.position;
  if (camera.projection == Projection::parallel) {
    const V2d p = camera.window_centre + image_point * camera.window_half_size;
    from += camera.right * p.x + camera.up * p.y;
  }
  if (!(ray.view.z > 0)) return std::nullopt;
  ray.distance = from.z / ray.view.z;
  if (camera.projection == Projection::perspective && !(ray.distance > 0)) return std::nullopt;
  const V3d point = from - ray.view * ray.distance;
  ray.point_m = V2d(point.x, point.y);
  return ray;
}

}  // namespace selvedge
