#include "viewer/hybrid/curved_cloth.h"

#include <cmath>

#include "tests/format/yarn_data.h"
#include "tests/viewer/small_frames.h"

namespace selvedge::test {
namespace {

constexpr double radius_mm = 20;  // of the cylinder
constexpr int facets = 360;       // on that quarter

/// A quarter of a cylinder about the x axis, from the point that faces +z to a little beyond its outline at
/// y = radius; u rises around it, v falls along +x by one repeat of `period` mm.
ScenePrimitive quarter(double period) {
  ScenePrimitive p;
  const double angle = std::numbers::pi / 2;
  for (int i = 0; i <= facets * 11 / 10; ++i) {
    const double phi = angle * i / facets;
    const V3d n(0, std::sin(phi), std::cos(phi));
    for (int side = 0; side < 2; ++side) {
      p.positions.emplace_back(n * (radius_mm / 1000) + V3d(side * period / 1000, 0, 0));
      p.normals.emplace_back(n);
      p.tex_coords[0].emplace_back(radius_mm * phi, side);
    }
    const auto at = static_cast<std::uint32_t>(2 * i);
    if (i > 0) p.indices.insert(p.indices.end(), {at - 2, at - 1, at, at, at - 1, at + 1});
  }
  return p;
}

/// Rods along x, one in a repeat: their axis at the height of their radius.
Fabric rods(double period, double radius, double plane) {
  Fabric fabric = lambert_fabric(1, V3f(0.5F, 0.5F, 0.5F));
  fabric.period_mm = V2f(1, static_cast<float>(period));
  YarnData data = straight(1, static_cast<float>(radius));
  for (V3f& node : data.nodes) node.y = static_cast<float>(period / 2);
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(data), fabric.period_mm));
  fabric.reference_height = static_cast<float>(plane);
  return fabric;
}

}  // namespace

TEST_CASE("the outline of a cylinder of rings is the rings' outline, as far as the mesh reaches") {
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::shader}) {
    for (const double period : {0.8, 2.0}) {
      for (const double share : {0.25, 0.4}) {
        for (const double top : {2.0, 1.8}) {
          CAPTURE(path_names[static_cast<std::size_t>(path)]);
          CAPTURE(period);
          CAPTURE(share);
          CAPTURE(top);
          const double radius = share * period;
          Scene scene;
          add(scene, quarter(period), material(0));
          scene.fabrics.resize(1);
          RenderOptions options;
          options.path = path;
          options.width = options.height = 200;
          options.layers = 1;
          options.lights = {{V3d(0, 0, 1), V3f(1, 1, 1)}};
          options.levels = best_levels;
          const double middle = radius_mm + radius * (1 - top);  // of the rings' section
          Camera camera;
          camera.projection = Projection::parallel;
          camera.window_half = V2d(period, period) * 0.5 / 1000;
          camera.position = V3d(period / 2, middle, 100) / 1000;
          const Frame frame = render_or_fail(scene, {rods(period, radius, top * radius)}, camera, options);
          double cut = 0;
          double ours = 0;
          for (int j = 0; j < options.height; ++j) {
            const double y = period * (0.5 - (j + 0.5) / options.height);
            for (int i = 0; i < options.width; ++i) {
              const double x = period * ((i + 0.5) / options.width - 0.5);
              const bool in_mesh = y < radius_mm - middle;
              const bool in_rings = std::abs(x) < radius && y < std::sqrt(radius * radius - x * x);
              const double expected = in_mesh && in_rings ? 1 : 0;
              ours += std::abs(static_cast<double>(frame.pixels[j * options.width + i].w) - expected);
              cut += std::abs((in_mesh && std::abs(x) < radius ? 1.0 : 0.0) - expected);
            }
          }
          CHECK(ours < 0.1 * cut);
          CHECK(ours < 0.002 * options.width * options.height);
        }
      }
    }
  }
}

TEST_CASE("a ray that grazes reaches as deep as a parabola that leaves its tangent plane") {
  for (const float bend : {0.01F, 0.05F, 0.3F}) {
    for (const float slope : {0.02F, 0.1F, 0.5F, 3.0F}) {
      const V3f view = V3f(0.6F, -0.8F, slope).normalized();
      float deepest = 0;
      for (int i = 1; i <= 4000; ++i) {
        const float way = 2 * slope / bend * static_cast<float>(i) / 4000;
        deepest = std::max(deepest, slope * way - 0.5F * bend * way * way);
      }
      CHECK(grazing_depth(view, bend, 0.5F) == doctest::Approx(deepest));
    }
  }
  const V3f view = V3f(0.6F, -0.8F, 0.1F).normalized();
  for (const float bend : {0.0F, -0.1F}) CHECK(std::isinf(grazing_depth(view, bend, 0.5F)));
  CHECK(std::isinf(grazing_depth(V3f(0, 0, 1), 0.1F, 0.5F)));
  CHECK(grazing_depth(V3f(0.6F, -0.8F, -0.1F).normalized(), 0.1F, 0.5F) == 0);
}

TEST_CASE("the curvature of a triangle on a cylinder is the cylinder's across its axis, and zero along it") {
  const float radius = 7;
  CurvedTriangle triangle;
  const std::array<V2f, 3> corners{V2f(0.1F, 0.2F), V2f(0.9F, 0.25F), V2f(0.3F, 0.6F)};
  const V2f period(3, 2);
  for (std::size_t k = 0; k < 3; ++k) {
    const float angle = corners[k].x * period.x / radius;  // u goes around
    triangle.uv[k] = corners[k];
    triangle.normals[k] = V3f(std::sin(angle), 0, std::cos(angle));
  }
  const float middle = 0.43F * period.x / radius;
  const V3f around(std::cos(middle), 0, -std::sin(middle));
  CHECK(curvature_along(triangle, period, V2f(1, 0), around, 1) == doctest::Approx(1 / radius).epsilon(0.01));
  CHECK(curvature_along(triangle, period, V2f(0, 1), V3f(0, 1, 0), 1) == doctest::Approx(0).epsilon(1e-6));
  const float half = std::sqrt(0.5F);
  CHECK(curvature_along(triangle, period, V2f(half, half), (around + V3f(0, 1, 0)) * half, 1) ==
        doctest::Approx(0.5F / radius).epsilon(0.01));
  triangle.uv[2] = triangle.uv[1];
  CHECK(curvature_along(triangle, period, V2f(1, 0), around, 1) == 0);
}

}  // namespace selvedge::test
