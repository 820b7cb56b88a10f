// The worked example of spec/brdf.md, evaluated.
#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "format/fabric/evaluate.h"
#include "tests/spec/spec_text.h"

using namespace selvedge;
using namespace selvedge::test;
using nlohmann::json;

namespace {

V3f vector_of(const json& list) { return {list.at(0), list.at(1), list.at(2)}; }

// Six decimals are printed.
void check_near(const V3f& value, const json& printed) {
  for (unsigned i = 0; i < 3; ++i) CHECK(std::abs(value[i] - printed.at(i).get<float>()) < 1e-6F);
}

}  // namespace

TEST_CASE("the worked example has the radiance and the opacity that the page states") {
  const auto blocks = code_blocks(page("brdf.md"), "json");
  REQUIRE(blocks.size() == 1);
  const json example = json::parse(blocks[0]);

  Fabric fabric;
  fabric.views = {example["views"]["columns"], example["views"]["rows"]};
  FabricLevel& level = fabric.levels.emplace_back();
  level.width = level.height = 1;
  Layer lobes{15, {}};
  for (const json& rho : example["rho"]) {
    lobes.values.push_back(rho);
    for (const char* p : {"cx", "cy", "cz", "n"}) lobes.values.push_back(example["lobe"][p]);
  }
  level.set_layer(LayerKind::lobes, lobes);
  level.add_layer(LayerKind::frame, 6);
  level.frame()[0] = {vector_of(example["normal"]), vector_of(example["tangent"])};
  level.add_layer(LayerKind::table, 3 * fabric.views.count());
  for (std::size_t i = 0; i < example["table"].size(); ++i)
    level.view_table()[i] = vector_of(example["table"][i]);
  level.set_layer(LayerKind::opacity, {fabric.views.count(), example["opacity"].get<std::vector<float>>()});

  const V3f light = vector_of(example["light"]);
  const V3f view = vector_of(example["view"]);
  const Shading shading = evaluate(fabric, 0, 0, 0, light, view);
  check_near(shading.radiance, example["f"]);
  CHECK(std::abs(shading.alpha - example["alpha"].get<float>()) < 1e-6F);

  // The steps on the way.
  const V2d square = hemisphere_to_square(V3d(view));
  CHECK(std::abs(square.x - example["squarePosition"][0].get<double>()) < 1e-6);
  CHECK(std::abs(square.y - example["squarePosition"][1].get<double>()) < 1e-6);
  const V3f n = level.frame()[0].normal;
  const V3f t = level.frame()[0].tangent;
  const V3f b = n.cross(t);
  check_near({light.dot(t), light.dot(b), light.dot(n)}, example["localLight"]);
  check_near({view.dot(t), view.dot(b), view.dot(n)}, example["localView"]);
}
