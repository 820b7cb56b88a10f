#include "converter/dress/check.h"

#include <doctest/doctest.h>

#include "converter/dress/dress.h"
#include "format/fabric/file.h"
#include "format/gltf/read_scene.h"
#include "format/picture/image.h"
#include "tests/converter/fabrics.h"
#include "tests/format/garments.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

/// A square metre of `fabric` (of 5 x 4 mm), with its fallback.
Scene dressed(const Folder& folder, const Fabric& fabric) {
  REQUIRE(write_garment(folder / "plain.glb", test::square()));
  REQUIRE(write_fabric(folder / "fabric.exr", fabric));
  const DressOptions everything{.all = true};
  REQUIRE(dress(folder / "plain.glb", folder / "fabric.exr", folder / "dressed.glb", everything));
  return test::need(read_scene(folder / "dressed.glb"));
}

}  // namespace

TEST_CASE("dressed check: what dress writes is right, with holes and without") {
  const Folder folder;
  CHECK(check_dressed(dressed(folder, test::net_fabric())).empty());
  CHECK(check_dressed(dressed(folder, test::lambert_fabric(V2d(5, 4), 8, V3f(0.9F, 0.4F, 0.1F)))).empty());
}

TEST_CASE("dressed check: a fallback of another colour is a warning") {
  const Folder folder;
  Scene scene = dressed(folder, test::lambert_fabric(V2d(5, 4), 8, V3f(0.5F, 0.4F, 0.3F)));
  scene.materials[0].base_color = V4f(1, 0.8F, 1, 1);  // 0.4 becomes 0.32
  const Issues issues = check_dressed(scene);
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].code == Code::gltf_fallback);
  CHECK(issues[0].place == "/materials/0/pbrMetallicRoughness/baseColorTexture");
  scene.materials[0].base_color = V4f(1, 0.9F, 1, 1);
  CHECK(check_dressed(scene).empty());
}

TEST_CASE("dressed check: repeats of another size than the fabric's are a warning, turned or not") {
  const Folder folder;
  Scene scene = dressed(folder, test::net_fabric(V2d(5, 4)));
  UvTransform& transform = scene.materials[0].fabric->transform;
  CHECK(transform.scale == V2d(200, 250));
  transform.scale = V2d(200, 125);
  const Issues issues = check_dressed(scene);
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].code == Code::gltf_advice);
  CHECK(issues[0].message.starts_with("a repeat is 5 x 8 mm"));
  transform.scale = V2d(-200, 250);  // mirrored, of the same size
  CHECK(check_dressed(scene).empty());
  transform.rotation = 0.7;
  CHECK(check_dressed(scene).empty());
  transform.scale = V2d(100, 125);
  CHECK(check_dressed(scene).size() == 1);
}
