// Pictures of the paper's path against the reference evaluation and the hybrid path.
#include <doctest/doctest.h>

#include <cmath>

#include "format/fabric/evaluate.h"
#include "format/scene/level_bounds.h"
#include "format/scene/lights.h"
#include "tests/format/fabrics.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"
#include "tests/viewer/paper_coding.h"
#include "tests/viewer/plain_frame.h"
#include "tests/viewer/shapes.h"
#include "viewer/render.h"
#include "viewer/renderer.h"

namespace selvedge {
namespace {

using test::code;
using test::Coding;
using test::half_step;
using test::seen;

Frame drawn(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
            RenderOptions options, RenderPath path) {
  options.path = path;
  return test::need(render(scene, fabrics, camera, options));
}

TEST_CASE("the paper's picture is within 1/255 of the reference evaluation over its own frames") {
  Scene scene;
  test::add(scene, test::sphere(48, 24, V2d(20, 10)), test::material(0));
  M44d aside;
  aside.setTranslation(V3d(0.9, 0.3, -0.4));
  SceneMaterial opaque = test::material(1);
  opaque.alpha_mode = AlphaMode::opaque;
  test::add(scene, test::square(40, 0), opaque, aside);
  const std::vector<Fabric> fabrics{test::random_fabric(32, 32, {8, 8}, 2, 1),
                                    test::random_fabric(9, 7, {4, 6}, 1, 2)};
  const V2i size(160, 120);
  const Camera camera = seen(20, 4.0 / 3);
  const std::vector<Light> lights = default_lights(camera);
  const Coding coding = code(scene, fabrics, camera, size, {});
  std::vector<V4f> pixels(static_cast<std::size_t>(size.x * size.y), V4f(0, 0, 0, 0));
  shade_round(coding.frames, coding.kinds, true,
              {camera, size.x, size.y, coding.kinds.kinds, coding.packed, lights},
              {0, size.x, size.y, pixels.data(), size.x});
  double worst = 0;
  int covered = 0;
  for (int row = 0; row < size.y; ++row) {
    for (int x = 0; x < size.x; ++x) {
      const auto i = static_cast<std::size_t>(row * size.x + x);
      const Coded& normal = coding.frames.normals[i];
      V3d sum(0, 0, 0);
      double alpha = 0;
      if (normal[3] != 0) {
        ++covered;
        const int which = decode_kind(normal[3]);
        const Fabric& fabric = fabrics[which];
        const V3d view =
            view_direction(camera, V2d((2.0 * x + 1) / size.x - 1, (2.0 * row + 1) / size.y - 1));
        const test::PlainFrame frame_of =
            test::plain_frame(V3d(decode_direction(normal)), V3d(decode_direction(coding.frames.tangents[i])),
                              1, decode_back(normal[3]) ? -1 : 1, view);
        // The finer level of alpha, the next by the centre of its texel, and blue between them.
        const Coded& texel = coding.frames.texels[i];
        const int last = static_cast<int>(fabric.levels.size()) - 1;
        const double part = std::clamp(static_cast<double>(decode_level(texel[2])) - texel[3], 0.0,
                                       texel[3] < last ? 1.0 : 0.0);
        const V2d uv((texel[0] + 0.5) / fabric.levels[texel[3]].width,
                     (texel[1] + 0.5) / fabric.levels[texel[3]].height);
        for (int k = 0; k < 2; ++k) {
          const double weight = k == 0 ? 1 - part : part;
          if (weight == 0) continue;
          const FabricLevel& level = fabric.levels[texel[3] + k];
          for (const Light& light : lights) {
            const Shading one =
                evaluate(fabric, texel[3] + k, wrap_texel(uv.x, level.width), wrap_texel(uv.y, level.height),
                         frame_of.into(light.direction), frame_of.into(view));
            sum += V3d(one.radiance * light.irradiance) * (weight * static_cast<double>(one.alpha));
            if (&light == lights.data()) alpha += weight * static_cast<double>(one.alpha);
          }
        }
        if (which == 1) {
          sum /= alpha;
          alpha = 1;
        }
      }
      const V4f& pixel = pixels[i];
      for (int c = 0; c < 3; ++c)
        worst = std::max(worst, std::abs(test::srgb(sum[c]) - test::srgb(static_cast<double>(pixel[c]))));
      worst = std::max(worst, std::abs(alpha - static_cast<double>(pixel.w)));
    }
  }
  MESSAGE("largest difference seen: " << worst * 255 << " / 255 over " << covered << " pixels");
  CHECK(covered > 5000);
  CHECK(worst * 255 <= 1);
}

TEST_CASE("Lambertian pictures are as near to those of hybrid as half a step of the normals lets them be") {
  // A sphere whose front and inside are both seen, one behind the other, and a square behind it.
  Scene scene;
  test::add(scene, test::sphere(96, 48, V2d(12, 6)), test::material(0));
  test::add(scene, test::square(9, -2), test::material(0));
  const float albedo = 0.8F;
  const float opacity = 0.5F;
  const std::vector<Fabric> fabrics{test::lambert_fabric(16, V3f(albedo), opacity)};
  RenderOptions options;
  options.width = options.height = 200;
  options.lights = {{V3d(0.48, 0.6, 0.64), V3f(2)}, {V3d(-0.6, 0, 0.8), V3f(1)}};
  const Camera camera = seen(20, 1);
  const Frame a = drawn(scene, fabrics, camera, options, RenderPath::hybrid);
  const Frame b = drawn(scene, fabrics, camera, options, RenderPath::paper);
  // A vector of at least this length, moved by at most half a step in each of three components, turns by at
  // most asin(|moved| / length); the light's cosine changes by no more than the normal does, and albedo / pi
  // times the irradiance of each light with it. A pixel's layers weigh at most 1 together.
  const double shortest = std::cos(2 * std::numbers::pi / 96);  // between two normals of the mesh, and more
  const double turned = std::asin(std::sqrt(3.0) * half_step / shortest);
  const double bound = static_cast<double>(albedo) / std::numbers::pi * 3 * turned;
  double worst = 0;
  int compared = 0;
  int other_coverage = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    // Edges of triangles: each path rounds them by itself.
    if (std::abs(a.pixels[i].w - b.pixels[i].w) > 1e-3F) {
      ++other_coverage;
      continue;
    }
    if (!(a.pixels[i].w > 0)) continue;
    // The rim of the sphere, where normals are bent towards the viewer.
    const V2d s((2.0 * static_cast<double>(i % 200) + 1) / 200 - 1,
                1 - (2.0 * static_cast<double>(i / 200) + 1) / 200);
    const V3d ray = view_direction(camera, s);
    const V3d nearest = camera.position - ray * camera.position.dot(ray);
    if (std::abs(nearest.length() - 1) < 0.02) continue;
    ++compared;
    for (int c = 0; c < 3; ++c)
      worst = std::max(worst, static_cast<double>(std::abs(a.pixels[i][c] - b.pixels[i][c])));
  }
  MESSAGE("largest difference " << worst << " where " << bound << " is allowed, " << other_coverage
                                << " pixels at edges left out");
  CHECK(compared > 15000);
  CHECK(other_coverage * 200 < compared);
  CHECK(worst <= bound);
  // 8 bits are seen.
  CHECK(worst > bound / 10);
}

TEST_CASE("a fabric of which the finer levels are left out gives the paper's frame of the whole") {
  Scene scene;
  test::add(scene, test::sphere(24, 16, V2d(9, 5)), test::material(0));
  const std::vector<Fabric> all{test::random_fabric(64, 64, 7)};
  scene.fabrics.resize(1);
  int left_out = 0;
  for (const double distance : {2.0, 8.0, 40.0, 120.0}) {
    CameraOptions options;
    options.look_at = V3d(0, 0, 0);
    options.distance = distance;
    options.elevation = 20;
    options.field_of_view = 60;
    const auto camera = test::need(make_camera(std::vector<V3d>{V3d(-1), V3d(1)}, 1.25, options));
    RenderOptions look;
    look.width = 100;
    look.height = 80;
    look.lights = default_lights(camera);
    FabricHeader header;
    header.width = header.height = 64;
    header.levels = 7;
    const std::vector<const FabricHeader*> headers{&header};
    const int finest =
        finest_for_paper(levels_asked(scene, camera, look.height, look.levels, headers)[0].first);
    left_out += finest;
    std::vector<Fabric> some = all;
    some[0].levels.erase(some[0].levels.begin(), some[0].levels.begin() + finest);
    const Frame whole = drawn(scene, all, camera, look, RenderPath::paper);
    const Frame part = drawn(scene, some, camera, look, RenderPath::paper);
    float worst = 0;
    for (std::size_t i = 0; i < whole.pixels.size(); ++i) {
      for (int c = 0; c < 4; ++c) worst = std::max(worst, std::abs(whole.pixels[i][c] - part.pixels[i][c]));
    }
    // The weights of two levels are rounded differently.
    CHECK(worst < 1e-4F);
  }
  CHECK(left_out >= 4);
  CHECK(finest_for_paper(0) == 0);
  CHECK(finest_for_paper(4) == 2);
  CHECK(coarsest_for_paper(2, 4) == 3);
  CHECK(coarsest_for_paper(3, 4) == 3);
}

TEST_CASE("the paper's path refuses what 8 bits and its model do not have, and says which path draws it") {
  Scene scene;
  test::add(scene, test::square(1), test::material(0));
  const Camera camera = seen(10, 1);
  RenderOptions options;
  options.path = RenderPath::paper;
  options.width = options.height = 20;
  const auto refused = [&](const Scene& s, const std::vector<Fabric>& f, const RenderOptions& o) {
    const Error error = test::error_of(render(s, f, camera, o));
    CHECK(error.code == Code::option_out_of_range);
    return to_line(error);
  };
  const auto names = [](const std::string& line, const char* what) {
    CAPTURE(line);
    CHECK(line.find(what) != std::string::npos);
    CHECK(line.find("--path hybrid") != std::string::npos);
  };
  const std::vector<Fabric> good{test::random_fabric(256, 4, 1)};
  RenderStats stats;
  test::need(render(scene, good, camera, options, &stats));
  CHECK(stats.remarks.empty());
  test::need(render(scene, {test::with_yarn(good.front(), 1)}, camera, options, &stats));
  REQUIRE(stats.remarks.size() == 1);
  CHECK(stats.remarks[0].find("--path paper draws level 0 in place of the yarn") != std::string::npos);
  names(refused(scene, {test::random_fabric(257, 4, 1)}, options), "257 x 4 texels");
  names(refused(scene, {test::random_product_fabric(16, 16, {4, 4}, 1, 3)}, options), "paper's model");
  Fabric lit = test::random_fabric(4, 4, 1);
  lit.lights = {1, 1};
  lit.levels[0].add(LayerKind::light, 3, 1);
  names(refused(scene, {lit}, options), "light table");

  RenderOptions near = options;
  near.lights.resize(1);
  near.lights[0].kind = LightKind::point;
  names(refused(scene, good, near), "point");
  RenderOptions linear = options;
  linear.levels = best_levels;
  CHECK(refused(scene, good, linear).find("--filter") != std::string::npos);

  Scene bare = scene;
  test::add(bare, test::square(1), test::material(-1));
  names(refused(bare, good, options), "no fabric");
}

}  // namespace
}  // namespace selvedge
