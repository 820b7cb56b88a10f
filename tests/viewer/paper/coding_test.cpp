// The paper's frames in 8 bits: normals, tangents, places and levels against rays.
#include <doctest/doctest.h>

#include <cmath>

#include "format/fabric/evaluate.h"
#include "tests/require.h"
#include "tests/viewer/paper_coding.h"
#include "tests/viewer/ray_caster.h"

namespace selvedge {
namespace {

using test::code;
using test::Coding;
using test::half_step;
using test::seen;

/// body(i, x, y, triangle) for every covered pixel whose centre is not at a triangle's edge, where a
/// rasteriser rounds to 1/256 of a pixel: its number, its centre, and what a ray through it meets first.
template <class Body>
void each_ray(const Coding& coding, const test::RayCaster& rays, const Body& body) {
  for (int row = 0; row < coding.size.y; ++row) {
    for (int column = 0; column < coding.size.x; ++column) {
      const auto i = static_cast<std::size_t>(row * coding.size.x + column);
      if (coding.frames.normals[i][3] == 0) continue;
      const double x = column + 0.5;
      const double y = row + 0.5;
      const std::optional<test::RayHit> hit = rays.cast(x, y);
      bool within = hit.has_value();
      for (const V2d& d : {V2d(0.01, 0), V2d(-0.01, 0), V2d(0, 0.01), V2d(0, -0.01)})
        within = within && rays.inside(hit->triangle, x + d.x, y + d.y) >= 0;
      if (within) body(i, x, y, hit->triangle);
    }
  }
}

V3d vector_of(const std::array<double, 4>& group) { return {group[0], group[1], group[2]}; }

double largest(const V3d& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

TEST_CASE("normals and tangents in colours of 8 bits are within half a step of those that a ray meets") {
  Scene scene;
  M44d mirror;
  mirror.setScale(V3d(-1, 1, 1));
  test::add(scene, test::sphere(24, 12, V2d(5, 3)), test::material(0), mirror);
  const std::vector<Fabric> fabrics{test::random_fabric(16, 16, 1)};
  const Coding coding = code(scene, fabrics, seen(30, 1), V2i(160, 160), {});
  const test::RayCaster rays(coding.mesh, coding.size, coding.camera);
  int compared = 0;
  each_ray(coding, rays, [&](std::size_t i, double x, double y, std::size_t triangle) {
    const V3d normal(decode_direction(coding.frames.normals[i]));
    const V3d tangent(decode_direction(coding.frames.tangents[i]));
    CHECK(largest(normal - vector_of(rays.attributes(triangle, x, y, 0))) <= half_step);
    CHECK(largest(tangent - vector_of(rays.attributes(triangle, x, y, 1))) <= half_step);
    CHECK(coding.frames.tangents[i][3] == (coding.mesh.triangles[triangle].handedness < 0 ? 0 : 255));
    CHECK(coding.frames.normals[i][3] == code_kind(0, false));
    ++compared;
  });
  CHECK(compared > 8000);
}

/// Texel and level of every pixel against a ray; `blend` is that of the options.
void check_texels(const Scene& scene, const Fabric& fabric, const Camera& camera,
                  const LevelOptions& options) {
  const Coding coding = code(scene, {fabric}, camera, V2i(240, 180), options);
  const test::RayCaster rays(coding.mesh, coding.size, camera);
  const V2d size(fabric.levels[0].width, fabric.levels[0].height);
  const double last = static_cast<double>(fabric.levels.size()) - 1;
  // Half a step of the texture's code and half a step of the frame's, in levels; and what Mesa's logarithm
  // and its blend are off.
  const double slack = 1 / static_cast<double>(paper_level_step) + 0.05;
  int compared = 0;
  int wrong = 0;
  int levels = 0;
  double worst = 0;
  each_ray(coding, rays, [&](std::size_t i, double x, double y, std::size_t triangle) {
    const Coded& texel = coding.frames.texels[i];
    const V2d uv = rays.uv(triangle, x, y);
    const FabricLevel& level = fabric.levels[texel[3]];
    if (options.forced < 0) {
      // OpenGL wants a level between those of the greater and of the sum of the greatest changes (4.5
      // core, 8.14.1); Mesa takes differences over two pixels, whose own change is that of the level from one
      // to the next.
      ++levels;
      double low = 30;
      double high = -30;
      for (const V2d& at : {V2d(x - 1, y - 1), V2d(x + 1, y - 1), V2d(x - 1, y + 1), V2d(x + 1, y + 1)}) {
        const V2d right = (rays.uv(triangle, at.x + 0.5, at.y) - rays.uv(triangle, at.x - 0.5, at.y)) * size;
        const V2d up = (rays.uv(triangle, at.x, at.y + 0.5) - rays.uv(triangle, at.x, at.y - 0.5)) * size;
        const double u = std::max(std::abs(right.x), std::abs(up.x));
        const double v = std::max(std::abs(right.y), std::abs(up.y));
        low = std::min(low, std::log2(std::max(u, v)));
        high = std::max(high, std::log2(u + v));
      }
      const double lower = std::clamp(low, 0.0, last);
      const double upper = std::clamp(high, 0.0, last);
      const double blue = static_cast<double>(decode_level(texel[2]));
      if (options.blend) {
        worst = std::max({worst, lower - slack - blue, blue - upper - slack});
        CHECK(std::abs(blue - std::clamp(blue, static_cast<double>(texel[3]), texel[3] + 1.0)) <= slack);
      } else {
        CHECK(std::lround(blue) == texel[3]);
        CHECK(texel[3] >= std::floor(lower - slack + 0.5));
        CHECK(texel[3] <= std::ceil(upper + slack + 0.5));
      }
    } else {
      CHECK(texel[3] == std::min(options.forced, static_cast<int>(last)));
    }
    if (test::to_edge(uv.x * level.width) < 0.02 || test::to_edge(uv.y * level.height) < 0.02) return;
    ++compared;
    if (texel[0] != wrap_texel(uv.x, level.width) || texel[1] != wrap_texel(uv.y, level.height)) ++wrong;
  });
  MESSAGE(wrong << " of " << compared << " texels differ, of " << levels << " levels some by " << worst);
  CHECK(worst <= 0);
  CHECK(compared > 5000);
  CHECK(wrong * 1000 <= compared);
}

TEST_CASE("places in red and green are those of a ray, levels in blue are within what OpenGL leaves open") {
  for (const V2i& size : {V2i(16, 16), V2i(256, 256), V2i(64, 24), V2i(5, 3)}) {
    const Fabric fabric = test::random_fabric(size.x, size.y, 1);
    for (const double repeats : {1.0, 7.0, 40.0}) {
      CAPTURE(size.x);
      CAPTURE(repeats);
      Scene scene;
      test::add(scene, test::square(repeats), test::material(0));
      const Camera camera = seen(35, 4.0 / 3, 1.7);
      check_texels(scene, fabric, camera, {});
      LevelOptions nearest;
      nearest.blend = false;
      check_texels(scene, fabric, camera, nearest);
      LevelOptions forced;
      forced.forced = 1;
      check_texels(scene, fabric, camera, forced);
    }
  }
}

TEST_CASE("a band of rows is what the whole of the paper's frame has there") {
  Scene scene;
  // Askew: a component of 0 is halfway between two steps, and either is right.
  M44d askew;
  askew.setEulerAngles(V3d(0.3, 0.2, 0.1));
  test::add(scene, test::sphere(20, 10, V2d(9, 5)), test::material(0), askew);
  const std::vector<Fabric> fabrics{test::random_fabric(16, 16, 1)};
  const V2i size(50, 48);
  const Coding whole = code(scene, fabrics, seen(10, 1), size, {});
  int covered = 0;
  int other = 0;
  for (int first = 0; first < size.y; first += 12) {
    const Coding band = code(scene, fabrics, whole.camera, size, {}, first, 12);
    for (std::size_t i = 0; i < band.frames.normals.size(); ++i) {
      const std::size_t j = static_cast<std::size_t>(first * size.x) + i;
      CHECK(band.frames.normals[i][3] == whole.frames.normals[j][3]);
      if (band.frames.normals[i][3] == 0) continue;
      ++covered;
      const bool same = band.frames.normals[i] == whole.frames.normals[j] &&
                        band.frames.tangents[i] == whole.frames.tangents[j] &&
                        band.frames.texels[i] == whole.frames.texels[j];
      other += same ? 0 : 1;
    }
  }
  CHECK(covered > 1000);
  // Interpolation starts from another corner: what floats round shows where a step of 8 bits or a texel ends.
  CHECK(other * 100 <= covered);
}

}  // namespace
}  // namespace selvedge
