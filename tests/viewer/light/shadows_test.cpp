// Shadow maps against rays cast on the processor, closed forms, and path against path.
#include "viewer/light/shadows.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "tests/require.h"
#include "tests/viewer/paths.h"
#include "tests/viewer/ray_caster.h"
#include "viewer/renderer.h"

namespace selvedge {
namespace {

/// A sheet in folds over [-1, 1]^2, facing +z.
ScenePrimitive folded_sheet(int cells) {
  ScenePrimitive p;
  p.name = "sheet/0";
  const auto height = [](double x, double y) { return 0.12 * std::sin(6 * x + 1) * std::cos(4 * y); };
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const double x = 2.0 * i / cells - 1;
      const double y = 2.0 * j / cells - 1;
      const double e = 1e-5;
      const V3d normal((height(x - e, y) - height(x + e, y)) / (2 * e),
                       (height(x, y - e) - height(x, y + e)) / (2 * e), 1);
      p.positions.emplace_back(V3d(x, y, height(x, y)));
      p.normals.emplace_back(normal.normalized());
      p.tex_coords[0].emplace_back(x, -y);
    }
  }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (cells + 1) + i); };
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i)
      p.indices.insert(p.indices.end(),
                       {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1)});
  return p;
}

double homogeneous_coordinate(const V4f& row, const V3d& p) {
  return V3d(V3f(row.x, row.y, row.z)).dot(p) + static_cast<double>(row.w);
}

/// A ball over folds.
test::Setting ball_over_folds() {
  test::Setting setting;
  test::add(setting.scene, folded_sheet(40), test::material(0));
  M44d small;
  small.setScale(V3d(0.3));
  test::add(setting.scene, test::sphere(24, 12, V2d(1, 1)), test::material(1),
            small * M44d().setTranslation(V3d(0.1, -0.1, 0.7)));
  setting.fabrics = {test::lambert_fabric(4, V3f(1)), test::lambert_fabric(4, V3f(1))};
  setting.options.width = 120;
  setting.options.height = 90;
  setting.options.levels.forced_level = 0;
  setting.camera.elevation = 35;
  setting.camera.azimuth = 20;
  setting.options.shadow_map_size = 1024;
  return setting;
}

Light spot_at(const V3d& place, double half_angle) {
  Light spot;
  spot.kind = LightKind::spot;
  spot.position = place;
  spot.direction = place.normalized();
  spot.irradiance = V3f(8);
  spot.outer_cosine = std::cos(half_angle);
  spot.inner_cosine = std::cos(0.8 * half_angle);
  return spot;
}

/// Fractions of the light that reaches the points around `p` which the taps of a map may see: all of them the
/// same (0 or 1), else none.
std::optional<int> reaches(const test::RayCaster& rays, const V3d& p, const V3d& normal, const V3d& towards,
                           double distance, double reach) {
  const V3d l = towards.normalized();
  const double cosine = normal.dot(l);
  if (!(cosine > 0.05)) return std::nullopt;
  const V3d right = (std::abs(l.y) < 0.9 ? V3d(0, 1, 0) : V3d(1, 0, 0)).cross(l).normalized();
  const V3d up = l.cross(right);
  std::optional<int> all;
  for (int i = 0; i < 9; ++i) {
    const double turn = i * std::numbers::pi / 4;
    const V3d across = i == 8 ? V3d(0, 0, 0) : (right * std::cos(turn) + up * std::sin(turn)) * reach;
    // Along the light onto the surface's plane.
    const V3d at = p + across - l * (normal.dot(across) / cosine) + normal * 1e-3;
    const auto hit = rays.cast(at, l);
    const int lit = hit && hit->distance < distance ? 0 : 1;
    if (all && *all != lit) return std::nullopt;
    all = lit;
  }
  return all;
}

/// The fraction of pixels off the shadows' edges where the picture and a ray cast agree.
double agreement(const test::Setting& setting, RenderPath path, int& compared) {
  test::Setting open = setting;
  open.options.shadow_map_size = 0;
  const Frame with = test::drawn(setting, path);
  const Frame without = test::drawn(open, path);
  const Camera camera = test::camera_of(setting);
  const Light& light = setting.options.lights[0];
  const MergedSurfaces mesh = merge(test::need(build_surfaces(setting.scene, V3d(0, 0, 0))));
  const test::RayCaster rays(mesh, V2i(with.width, with.height), camera);
  const bool far = light.kind == LightKind::directional;
  // About 2 m in the map.
  const double texel = (far ? 2.6 : 2 * std::tan(std::acos(light.outer_cosine)) * light.position.length()) /
                       setting.options.shadow_map_size;
  int dark = 0;
  int agreed = 0;
  compared = 0;
  for (int y = 0; y < with.height; ++y) {
    for (int x = 0; x < with.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y * with.width + x);
      if (!(without.pixels[i].x > 0.02F)) continue;
      const V3d view =
          view_direction(camera, V2d((2.0 * x + 1) / with.width - 1, 1 - (2.0 * y + 1) / with.height));
      const auto hit = rays.cast(camera.position, -view);
      if (!hit) continue;
      const V3d normal = hit->normal.normalized() * (hit->normal.dot(view) > 0 ? 1.0 : -1.0);
      const V3d p = camera.position - view * hit->distance;
      const V3d towards = far ? light.direction : light.position - p;
      const auto lit = reaches(rays, p, normal, towards, far ? HUGE_VAL : towards.length(), 4 * texel);
      if (!lit) continue;
      ++compared;
      dark += 1 - *lit;
      const float fraction = with.pixels[i].x / without.pixels[i].x;
      agreed += std::abs(fraction - static_cast<float>(*lit)) < 0.01F ? 1 : 0;
    }
  }
  MESSAGE(agreed, " of ", compared, " pixels agree, ", dark, " of them dark");
  CHECK(dark > compared / 20);
  return static_cast<double>(agreed) / compared;
}

}  // namespace

TEST_CASE("a map holds the whole scene, seen along the light") {
  Random random(5, 0);
  std::vector<V3f> points;
  for (int i = 0; i < 100; ++i) points.push_back(test::any_direction(random) * 3.0F + V3f(1, 2, 0));
  const V3d origin(10, 0, 0);
  std::vector<Light> lights{{V3d(0.48, 0.6, 0.64), V3f(1)}, {V3d(0, 1, 0), V3f(1)}};
  Light spot = spot_at(V3d(0, 0, 20), 0.4);
  spot.position += origin;
  Light point;
  point.kind = LightKind::point;
  lights.insert(lights.begin(), point);
  lights.push_back(spot);
  const std::vector<ShadowView> views = shadow_views(lights, points, origin, 256);
  REQUIRE(views.size() == 3);
  CHECK(views[0].light == 1);
  for (const ShadowView& view : views) {
    for (const V3f& p : points) {
      std::array<double, 4> at{};
      for (std::size_t k = 0; k < 4; ++k) at[k] = homogeneous_coordinate(view.rows[k], V3d(p));
      CHECK(at[0] / at[3] > 3.5);
      CHECK(at[0] / at[3] < 252.5);
      CHECK(at[1] / at[3] > 3.5);
      CHECK(at[1] / at[3] < 252.5);
      CHECK(at[2] / at[3] > 0);
      CHECK(at[2] / at[3] < 1);
      // A step towards the light stays at its texel and comes nearer; one across it moves by its texels.
      const Light& light = lights[view.light];
      const V3d towards = light.kind == LightKind::spot ? light.position - origin - V3d(p) : light.direction;
      const V3d nearer = V3d(p) + towards.normalized() * 0.1;
      const V3d aside = V3d(p) + light.direction.cross(V3d(1, 0, 0)).normalized() * 0.1;
      const auto place = [&](const V3d& x, std::size_t k) {
        return homogeneous_coordinate(view.rows[k], x) / homogeneous_coordinate(view.rows[3], x);
      };
      CHECK(place(nearer, 0) == doctest::Approx(at[0] / at[3]).epsilon(1e-4));
      CHECK(place(nearer, 2) < at[2] / at[3]);
      const double moved = std::hypot(place(aside, 0) - at[0] / at[3], place(aside, 1) - at[1] / at[3]);
      CHECK(moved ==
            doctest::Approx(0.1 / (static_cast<double>(view.texel_cell_size) * at[3])).epsilon(1e-3));
    }
  }
}

TEST_CASE("a flat cloth does not shadow itself at any angle of the light") {
  test::Setting setting = ball_over_folds();
  setting.scene = {};
  test::add(setting.scene, test::square(1, 0), test::material(0));
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
    for (const double z : {1.0, 0.5, 0.1, 0.02}) {
      setting.options.lights = {{V3d(0.6, 0.3, z).normalized(), V3f(1)}, spot_at(V3d(2, 1, 5 * z), 0.6)};
      setting.options.shadow_map_size = 128;
      const Frame with = test::drawn(setting, path);
      setting.options.shadow_map_size = 0;
      const Frame without = test::drawn(setting, path);
      CAPTURE(z);
      for (std::size_t i = 0; i < with.pixels.size(); ++i)
        CHECK((with.pixels[i] - without.pixels[i]).length() <= 1e-3F * without.pixels[i].length());
    }
  }
}

TEST_CASE("shadows of a light far away agree with rays on 99 % of the pixels 4 texels off their edges") {
  test::Setting setting = ball_over_folds();
  setting.options.lights = {{V3d(0.7, 0.2, 0.5).normalized(), V3f(1)}};
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
    int compared = 0;
    CHECK(agreement(setting, path, compared) >= 0.99);
    CHECK(compared > 2000);
  }
}

TEST_CASE("hybrid and rays agree on shadows, on fabrics and on core materials") {
  test::Setting setting = ball_over_folds();
  setting.options.width = 300;
  setting.options.height = 200;
  setting.options.levels.forced_level = -1;
  SceneMaterial plain = test::material(-1, V4f(0.8F, 0.7F, 0.5F, 1));
  plain.metallic = 0;
  plain.roughness = 0.6F;
  test::add(setting.scene, test::square(1, -0.5F), plain, M44d().setScale(V3d(1.5)));
  setting.options.lights = {{V3d(0.7, 0.2, 0.5).normalized(), V3f(1)},
                            spot_at(V3d(1.5, 1, 2.5), 0.6),
                            {V3d(-0.5, 0.5, 0.7).normalized(), V3f(0.5F)}};
  CHECK(test::decibels_to_rays(setting) > 30);
}

TEST_CASE(
    "glass casts no shadow, cloth with holes a whole one, and lights at a point say that they cast none") {
  test::Setting setting = ball_over_folds();
  setting.scene = {};
  SceneMaterial glass = test::material(-1, V4f(1, 1, 1, 0.3F));
  glass.alpha_mode = AlphaMode::blend;
  // Beside what the camera sees of the lower square, which the light crosses on its way.
  test::add(setting.scene, test::square(1, 0), test::material(0));
  test::add(setting.scene, test::square(1, 1), glass, M44d().setTranslation(V3d(3, 0, 0)));
  setting.fabrics = {test::lambert_fabric(4, V3f(1)), test::lambert_fabric(4, V3f(1), 0.5F)};
  setting.camera = {};
  setting.camera.projection = Projection::parallel;
  const V3d slanted = V3d(3, 0, 1).normalized();
  Light lamp;
  lamp.kind = LightKind::point;
  lamp.position = V3d(0, 0, 1);
  lamp.irradiance = V3f(0);
  setting.options.lights = {{slanted, V3f(1)}, lamp};
  const auto middle_of_square = [&] {
    RenderStats stats;
    const Camera camera = test::camera_of(setting);
    const auto frame = test::need(render(setting.scene, setting.fabrics, camera, setting.options, &stats));
    const std::size_t remarks = setting.options.shadow_map_size > 0 ? 1 : 0;
    CHECK(stats.remarks.size() == remarks);
    // The scene spans x = -1 ... 4: its middle is at 1.5.
    const double s = (0 - 1.5) / camera.window_half_size.x;
    const auto x = static_cast<std::size_t>((s + 1) / 2 * frame.width);
    return frame.pixels[static_cast<std::size_t>(frame.height / 2 * frame.width) + x].x;
  };
  const float lit = middle_of_square();
  CHECK(static_cast<double>(lit) == doctest::Approx(slanted.z / std::numbers::pi).epsilon(1e-3));
  setting.scene.materials[1] = test::material(1);
  CHECK(middle_of_square() == 0);
  setting.options.shadow_map_size = 0;
  CHECK(middle_of_square() == lit);
}

TEST_CASE("a probe sees the shadow of the picture, on either path, and a change of the light moves it") {
  test::Setting setting = ball_over_folds();
  const Camera camera = test::camera_of(setting);
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
    setting.options.path = path;
    setting.options.context = ContextKind::osmesa;
    setting.options.lights = {{V3d(0.7, 0.2, 0.5).normalized(), V3f(1)}};
    const auto renderer = test::need(Renderer::create(setting.scene, setting.fabrics, setting.options));
    Frame frame;
    RenderStats stats;
    for (const double x : {0.7, -0.7}) {
      setting.options.lights[0].direction = V3d(x, 0.2, 0.5).normalized();
      REQUIRE(renderer->draw(camera, setting.options, frame, stats));
      for (int i = 0; i < 40; ++i) {
        const V2i pixel(20 + 2 * i, 30 + i);
        const auto probe = test::need(renderer->probe_surface(camera, setting.options, pixel));
        if (!probe.has_value()) continue;
        const V4f& seen = frame.pixels[pixel.y * frame.width + pixel.x];
        CHECK(std::abs(probe->radiance.x - seen.x) < 1e-3F + 0.01F * seen.x);
      }
      CHECK(frame.pixels == test::drawn(setting, path).pixels);
    }
  }
}

}  // namespace selvedge
