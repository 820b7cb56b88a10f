#include "viewer/scene/change_fabrics.h"

#include <doctest/doctest.h>

#include <numbers>

namespace selvedge {
namespace {

/// Millimetres on the cloth where a point of the garment's coordinates lies.
V2d place_on_cloth(const Scene& scene, const Fabric& fabric, const V2d& uv) {
  return scene.materials[0].fabric->transform.apply(uv) * V2d(fabric.period_mm);
}

TEST_CASE("a fitted fabric has larger stitches, and a quarter turn is one of millimetres") {
  Fabric fabric;
  fabric.period_mm = V2f(3, 5);
  for (const double quarters : {0, 1, 2, 3}) {
    Scene scene;
    scene.materials.resize(2);
    scene.materials[0].fabric = FabricReference{};
    UvTransform& transform = scene.materials[0].fabric->transform;
    transform.offset = V2d(0.2, -0.4);
    transform.rotation = quarters * std::numbers::pi / 2;
    transform.scale = V2d(40, 30);
    scene.materials[0].garment_textures.tint = V3f(1, 0.5F, 1);
    const Scene before = scene;
    FabricFit fit;
    fit.stitch_scale = 2.5;
    fit.quarter_turns = 3;
    fit.tint = V3f(0.5F, 0.5F, 2);
    fit_fabrics(std::vector<FabricFit>{fit, {}}, std::vector<Fabric>{fabric}, scene);
    CHECK(scene.materials[0].garment_textures.tint == V3f(0.5F, 0.25F, 2));
    CHECK_FALSE(scene.materials[1].fabric.has_value());
    for (const V2d& uv : {V2d(0, 0), V2d(1, 0), V2d(0.3, 0.9)}) {
      const V2d was = place_on_cloth(before, fabric, uv);
      const V2d is = place_on_cloth(scene, fabric, uv);
      // Three turns of (x, y) -> (y, -x) are one of (x, y) -> (-y, x).
      CHECK(is.x == doctest::Approx(-was.y / 2.5));
      CHECK(is.y == doctest::Approx(was.x / 2.5));
    }
  }
}

}  // namespace
}  // namespace selvedge
