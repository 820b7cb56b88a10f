#include "viewer/index_pass.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "format/evaluate.h"
#include "tests/viewer/shapes.h"
#include "viewer/camera.h"

namespace selvedge {
namespace {

/// The index pass over a scene whose surfaces all have fabric 0.
struct Drawn {
  PixelLayer layer;
  bool any = false;
};

Drawn draw(const Scene& scene, const Fabric& fabric, const Camera& camera, const IndexPassOptions& options,
           int first_row = 0) {
  const Result<std::unique_ptr<GraphicsContext>> context = make_osmesa_context();
  test::require(context);
  REQUIRE((*context)->make_current());
  const Result<GlFunctions> gl = load_gl_functions(**context);
  test::require(gl);
  const Result<std::vector<Surface>> surfaces = build_surfaces(scene, V3d(0, 0, 0));
  REQUIRE(surfaces);
  SurfaceLook look;
  look.fabric = 0;
  const std::vector<SurfaceLook> looks(surfaces->size(), look);
  const Result<std::unique_ptr<IndexPass>> pass =
      IndexPass::create(*gl, *surfaces, looks, {&fabric, 1}, {}, options);
  test::require(pass);
  Drawn drawn;
  const Result<bool> any = (*pass)->draw(clip_matrix(camera, V3d(0, 0, 0)), first_row, 0, {});
  test::require(any);
  drawn.any = *any;
  (*pass)->read(drawn.layer);
  return drawn;
}

Camera tilted(double aspect) {
  CameraOptions options;
  options.elevation = 35;
  options.azimuth = 25;
  options.zoom = 1.7;
  const std::vector<V3d> points{V3d(-1, -1, 0), V3d(1, -1, 0), V3d(1, 1, 0), V3d(-1, 1, 0)};
  const Result<Camera> camera = make_camera(points, aspect, options);
  REQUIRE(camera);
  return *camera;
}

/// Texture coordinates of test::square seen at a pixel (row 0 at the bottom), by meeting the plane z = 0.
V2d uv_at(const Camera& camera, double x, double y, int width, int height, double repeats) {
  const V3d away = -view_direction(camera, V2d((2 * x + 1) / width - 1, (2 * y + 1) / height - 1));
  const V3d p = camera.position - away * (camera.position.z / away.z);
  return V2d((p.x + 1) / 2, (1 - p.y) / 2) * repeats;
}

double to_edge(double texels) { return std::abs(texels - std::round(texels)); }

TEST_CASE("every pixel names the texel that its texture coordinates lie in") {
  constexpr int width = 240;
  constexpr int height = 180;
  for (const V2i& size : {V2i(16, 16), V2i(5, 3)}) {
    const Fabric fabric = test::random_fabric(size.x, size.y, 1);
    for (const double repeats : {1.0, 7.0, 300.0}) {
      Scene scene;
      test::add(scene, test::square(repeats), test::material(0));
      const Camera camera = tilted(static_cast<double>(width) / height);
      const Drawn drawn = draw(scene, fabric, camera, {width, height, height, false, 0});
      int compared = 0;
      int wrong = 0;
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const V2d uv = uv_at(camera, x, y, width, height, repeats);
          const std::size_t i = static_cast<std::size_t>(y * width + x);
          if (drawn.layer.marks[i][0] == 0) continue;
          // Float texture coordinates of up to 300 repeats are good to some 1e-3 of a texel.
          if (to_edge(uv.x * size.x) < 0.01 || to_edge(uv.y * size.y) < 0.01) continue;
          ++compared;
          if (drawn.layer.texels[i][0] != wrap_texel(uv.x, size.x) ||
              drawn.layer.texels[i][1] != wrap_texel(uv.y, size.y))
            ++wrong;
        }
      }
      CHECK(compared > 10000);
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("the level follows the logarithm of the footprint") {
  constexpr int width = 256;
  constexpr int height = 256;
  const Fabric fabric = test::random_fabric(64, 64, 1);
  for (const double repeats : {4.0, 20.0, 60.0}) {
    Scene scene;
    test::add(scene, test::square(repeats), test::material(0));
    CameraOptions options;
    options.elevation = 50;
    const std::vector<V3d> points{V3d(-1, -1, 0), V3d(1, 1, 0)};
    const Result<Camera> camera = make_camera(points, 1, options);
    REQUIRE(camera);
    const Drawn drawn = draw(scene, fabric, *camera, {width, height, height, true, -1});
    double worst = 0;
    int compared = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y * width + x);
        if (drawn.layer.marks[i][0] == 0) continue;
        const V2d across = uv_at(*camera, x + 0.5, y, width, height, repeats) -
                           uv_at(*camera, x - 0.5, y, width, height, repeats);
        const V2d down = uv_at(*camera, x, y + 0.5, width, height, repeats) -
                         uv_at(*camera, x, y - 0.5, width, height, repeats);
        const double footprint = 64 * std::max(across.length(), down.length());
        const double expected = std::clamp(std::log2(footprint), 0.0, 6.0);
        const double level = drawn.layer.marks[i][1] + drawn.layer.normal[i].w;
        worst = std::max(worst, std::abs(level - expected));
        ++compared;
      }
    }
    CAPTURE(repeats);
    CHECK(compared > 5000);
    // Mesa's logarithm and blend are off by up to 0.05 each; derivatives are taken over two pixels.
    CHECK(worst < 0.15);
  }
}

TEST_CASE("both levels of a blend name the texel at the same texture coordinates") {
  constexpr int width = 200;
  constexpr int height = 200;
  const Fabric fabric = test::random_fabric(20, 12, 1);
  Scene scene;
  test::add(scene, test::square(12), test::material(0));
  const Camera camera = tilted(1);
  const Drawn drawn = draw(scene, fabric, camera, {width, height, height, true, -1});
  int compared = 0;
  int wrong = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y * width + x);
      const auto& marks = drawn.layer.marks[i];
      if (marks[0] == 0) continue;
      REQUIRE(marks[2] == std::min(marks[1] + 1, 4));
      const V2d uv = uv_at(camera, x, y, width, height, 12);
      for (std::size_t k = 0; k < 2; ++k) {
        const FabricLevel& level = fabric.levels[marks[1 + k]];
        if (to_edge(uv.x * level.width) < 0.01 || to_edge(uv.y * level.height) < 0.01) continue;
        ++compared;
        if (drawn.layer.texels[i][2 * k] != wrap_texel(uv.x, level.width) ||
            drawn.layer.texels[i][2 * k + 1] != wrap_texel(uv.y, level.height))
          ++wrong;
      }
    }
  }
  CHECK(compared > 10000);
  CHECK(wrong == 0);
}

TEST_CASE("levels that a fabric does not have are never chosen") {
  Fabric fabric = test::random_fabric(32, 32, 1);
  fabric.levels.resize(2);
  Scene scene;
  test::add(scene, test::square(1000), test::material(0));
  for (const bool blend : {false, true}) {
    for (const int forced : {-1, 5}) {
      const Drawn drawn = draw(scene, fabric, tilted(1), {64, 64, 64, blend, forced});
      CHECK(drawn.any);
      for (const auto& marks : drawn.layer.marks) {
        CHECK(marks[1] <= 1);
        CHECK(marks[2] <= 1);
      }
    }
  }
}

TEST_CASE("a band of rows is what the whole frame has there") {
  constexpr int width = 50;
  constexpr int height = 46;
  const Fabric fabric = test::random_fabric(16, 16, 1);
  Scene scene;
  test::add(scene, test::sphere(20, 10, V2d(9, 5)), test::material(0));
  const Camera camera = tilted(static_cast<double>(width) / height);
  const Drawn whole = draw(scene, fabric, camera, {width, height, height, true, -1});
  for (int first = 0; first < height; first += 12) {
    CAPTURE(first);
    const Drawn band = draw(scene, fabric, camera, {width, height, 12, true, -1}, first);
    const std::size_t count = static_cast<std::size_t>(std::min(12, height - first)) * width;
    int covered = 0;
    int other_coverage = 0;
    int other_texel = 0;
    float worst = 0;
    for (std::size_t i = 0; i < band.layer.marks.size(); ++i) {
      const std::size_t j = static_cast<std::size_t>(first) * width + i;
      const int expected = i < count ? whole.layer.marks[j][0] : 0;
      if (band.layer.marks[i][0] != expected) ++other_coverage;
      if (expected == 0) continue;
      ++covered;
      if (band.layer.texels[i] != whole.layer.texels[j]) ++other_texel;
      const V4f d = band.layer.surface[i] - whole.layer.surface[j];
      worst = std::max(worst, std::sqrt(d.dot(d)));
    }
    CHECK(other_coverage == 0);
    // Interpolation starts from another corner: values agree to float rounding, and so do texels but at
    // their very edges.
    CHECK(worst < 1e-5F);
    CHECK(other_texel * 100 <= covered);
  }
}

}  // namespace
}  // namespace selvedge
