#include "converter/dress/true_size.h"

#include <doctest/doctest.h>

#include "converter/dress/uv_scale.h"
#include "format/gltf/read_scene.h"
#include "tests/converter/workshop.h"

using namespace selvedge;
using test::Workshop;

TEST_CASE("true size: a document without scenes is scaled as one with them") {
  const Workshop workshop;
  GltfDocument document = test::need(load_gltf(workshop.garment));
  document.json.erase("scenes");
  document.json.erase("scene");
  REQUIRE(size_garment(document, 0.01, {}, {}));
  CHECK_FALSE(document.json.contains("scenes"));
  CHECK(bounds_of(test::need(read_scene(document))).size().y == doctest::Approx(0.01));
}

TEST_CASE("true size: a document without nodes is refused as it is") {
  GltfDocument document;
  document.json = Json::parse(R"({"asset":{},"scene":0,"buffers":[],"bufferViews":[],"accessors":[],
    "meshes":[],"materials":[],"scenes":[{"nodes":[0]}]})");
  REQUIRE(document.json.size() == 8);
  const Json before = document.json;
  const Error error = test::error_of(size_garment(document, 0.01, {}, {}));
  CHECK(error.code == Code::garment_empty);
  CHECK(document.json == before);
}
