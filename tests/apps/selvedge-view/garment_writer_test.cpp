#include "apps/selvedge-view/garment_writer.h"

#include <numbers>

#include "format/base/guard.h"
#include "tests/converter/workshop.h"
#include "viewer/load.h"
#include "viewer/scene/change_fabrics.h"

namespace selvedge::test {

TEST_CASE("what the window saves is worn as it was there, embedded or beside, turned, larger and tinted") {
  Workshop shop;
  const GarmentWriter writer = make_garment_writer({});
  // A garment without a fabric is dressed first.
  const std::string dressed = writer.dress(shop.garment, shop.fabric);
  LoadedScene open = need(load_scene(dressed));
  REQUIRE(open.scene.fabrics.size() == 1);
  CHECK(open.scene.fabrics[0].path.empty());
  std::vector<Fabric> fabrics = std::move(open.fabrics);
  const std::string other = shop.folder / "other.exr";
  need(write_fabric(other, net_fabric(V2d(3, 3))));
  fabrics.push_back(need(read_fabric(other)));
  open.scene.fabrics.push_back({"other", other, {}});
  for (int chosen = 0; chosen < 2; ++chosen) {
    for (int turns = 0; turns < 4; ++turns) {
      CAPTURE(chosen);
      CAPTURE(turns);
      Scene worn = change_fabrics(open.scene, fabrics, std::vector<int>(open.scene.materials.size(), chosen));
      const std::vector<FabricFit> fits(worn.materials.size(), {1.5, turns, V3f(1, 0.5F, 0.25F)});
      fit_fabrics(fits, fabrics, worn);
      writer.save(shop.garment, worn, shop.output);
      const Scene saved = need(read_scene(shop.output));
      REQUIRE(saved.materials.size() == worn.materials.size());
      int with_fabric = 0;
      for (std::size_t i = 0; i < worn.materials.size(); ++i) {
        REQUIRE(saved.materials[i].fabric.has_value() == worn.materials[i].fabric.has_value());
        if (!worn.materials[i].fabric) continue;
        ++with_fabric;
        const UvTransform& a = worn.materials[i].fabric->transform;
        const UvTransform& b = saved.materials[i].fabric->transform;
        CHECK((a.offset - b.offset).length() < 1e-9);
        CHECK((a.scale / b.scale - V2d(1, 1)).length() < 1e-9);
        CHECK(std::abs(std::remainder(a.rotation - b.rotation, 2 * std::numbers::pi)) < 1e-9);
        CHECK((worn.materials[i].garment_textures.tint - saved.materials[i].garment_textures.tint).length() <
              1e-6F);
        const SceneFabric& fabric = saved.fabrics[saved.materials[i].fabric->fabric];
        const Fabric read = need(read_fabric(std::span(fabric.bytes), fabric.name));
        CHECK(V2d(read.period_mm) == V2d(fabrics[chosen].period_mm));
      }
      CHECK(with_fabric > 0);
    }
  }
  SUBCASE("nothing that wears a fabric is nothing to save") {
    const Scene bare = change_fabrics(open.scene, fabrics, std::vector<int>(open.scene.materials.size(), -1));
    const auto saved =
        catch_failure([&] { return writer.save(shop.garment, bare, shop.folder / "none.glb"); });
    CHECK(error_of(saved).code == Code::garment_empty);
    CHECK_FALSE(std::filesystem::exists(shop.folder / "none.glb"));
  }
}

}  // namespace selvedge::test
