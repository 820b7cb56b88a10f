#include "converter/dress/true_size.h"

#include <doctest/doctest.h>

#include <map>

#include "converter/dress/uv_scale.h"
#include "format/gltf/access.h"
#include "format/gltf/read_scene.h"
#include "tests/converter/workshop.h"

using namespace selvedge;
using test::Workshop;

TEST_CASE("true size: a document without scenes is scaled as one with them") {
  const Workshop workshop;
  GltfDocument document = test::need(load_gltf(workshop.garment));
  document.json.erase("scenes");
  document.json.erase("scene");
  REQUIRE(scale_garment(document, 0.01));
  CHECK_FALSE(document.json.contains("scenes"));
  CHECK(bounds_of(test::need(read_scene(document))).size().y == doctest::Approx(0.01));
}

TEST_CASE("true size: scenes that share nodes are all scaled, and no node gets two parents") {
  const Workshop workshop;
  GltfDocument document = test::need(load_gltf(workshop.garment));
  const int shared = document.json["scenes"][0]["nodes"][0];
  const auto count = static_cast<int>(document.json["nodes"].size());
  document.json["nodes"].push_back({{"name", "alone"}});
  document.json["scenes"] = Json::parse("[{},{},{},{}]");
  document.json["scenes"][0]["nodes"] = {shared, count};
  document.json["scenes"][1]["nodes"] = {shared};
  document.json["scenes"][3]["nodes"] = {count, shared};
  REQUIRE(scale_garment(document, 0.01));
  std::map<int, int> parents;
  for (const Json& node : document.json["nodes"])
    for (const Json& child : array_member(node, "children")) ++parents[child.get<int>()];
  CHECK(parents == std::map<int, int>{{shared, 1}, {count, 1}});
  CHECK_FALSE(document.json["scenes"][2].contains("nodes"));
  for (const char* scene : {"0", "1", "3"})
    CHECK(bounds_of(test::need(read_scene(document, {}, {scene, ""}))).size().y == doctest::Approx(0.01));
}

TEST_CASE("true size: a scene that lists the child of a node is refused") {
  const Workshop workshop;
  GltfDocument document = test::need(load_gltf(workshop.garment));
  const int root = document.json["scenes"][0]["nodes"][0];
  document.json["nodes"].push_back({{"children", {root}}});
  const Error error = test::error_of(scale_garment(document, 0.01));
  CHECK(error.code == Code::gltf_malformed);
  CHECK(error.place == "/scenes/0/nodes/0");
}

TEST_CASE("true size: advice names the unit if only one makes a garment as long as garments are") {
  for (const auto& [longest, advice] : {std::pair(0.0, ""),
                                        {0.25, ""},
                                        {0.7, ""},
                                        {2.29, ""},
                                        {425.0, "--unit mm makes that 0.425 m"},
                                        {150.0, "--unit cm makes that 1.5 m"},
                                        {60.0, "(0.6 m in cm, 1.52 m in inch)"},
                                        {7.5, "--unit dm makes that 0.75 m"},
                                        {6.5, "(0.65 m in dm, 1.98 m in foot)"},
                                        {0.058, "--height METRES"},
                                        {9e9, "--height METRES"}}) {
    CAPTURE(longest);
    const std::string told = size_advice(V3d(longest / 2, longest, 0));
    CHECK(told.empty() == (*advice == '\0'));
    CHECK(told.find(advice) != std::string::npos);
  }
}
