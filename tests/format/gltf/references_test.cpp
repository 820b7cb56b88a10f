#include "format/gltf/references.h"

#include <doctest/doctest.h>

#include "tests/format/gltf_square.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

GltfDocument document_of(const Json& json) {
  GltfDocument document;
  document.file = "garment.gltf";
  document.json = json;
  return document;
}

/// One more of each kind of entry, with the numbers that it may hold.
Json with_all_references() {
  Json json = test::Square().json;
  json.update(Json::parse(R"({
    "images":[{"bufferView":0}],"samplers":[{}],"cameras":[{}],"textures":[{"source":0,"sampler":0}],
    "skins":[{"joints":[0,1],"skeleton":0,"inverseBindMatrices":0}],
    "animations":[{"channels":[{"sampler":0,"target":{"node":0}}],"samplers":[{"input":0,"output":1}]}]})"));
  json["nodes"][0] = {{"mesh", 0}, {"skin", 0}, {"camera", 0}, {"children", {1}}};
  json["nodes"].push_back(Json::object());
  json["accessors"][0]["sparse"] = {{"indices", {{"bufferView", 4}}}, {"values", {{"bufferView", 0}}}};
  json["materials"][0] = Json::parse(R"({"normalTexture":{"index":0},
    "extensions":{"KHR_materials_sheen":{"sheenColorTexture":{"index":0}}},"extras":{"aTexture":{"index":9}}})");
  Json& primitive = json["meshes"][0]["primitives"][0];
  primitive["targets"] = Json::parse(R"([{"POSITION":0}])");
  primitive["extensions"]["KHR_materials_variants"]["mappings"] =
      Json::parse(R"([{"material":0,"variants":[0]}])");
  json["extensions"]["KHR_materials_variants"]["variants"] = Json::parse(R"([{"name":"night"}])");
  return json;
}

std::vector<std::string> faults_of(const Json& json) {
  IssueSink issues("garment.gltf");
  check_references(document_of(json), issues);
  std::vector<std::string> places;
  for (const Error& issue : issues.take_issues()) {
    CHECK(issue.code == Code::gltf_accessor);
    places.push_back(issue.place);
  }
  return places;
}

}  // namespace

TEST_CASE("references: all that are there are good, and each that is not is named where it stands") {
  const Json good = with_all_references();
  CHECK(faults_of(good).empty());
  for (const char* place : {"/scene",
                            "/scenes/0/nodes/0",
                            "/nodes/0/mesh",
                            "/nodes/0/skin",
                            "/nodes/0/camera",
                            "/nodes/0/children/0",
                            "/skins/0/joints/1",
                            "/skins/0/skeleton",
                            "/skins/0/inverseBindMatrices",
                            "/meshes/0/primitives/0/attributes/TANGENT",
                            "/meshes/0/primitives/0/indices",
                            "/meshes/0/primitives/0/material",
                            "/meshes/0/primitives/0/targets/0/POSITION",
                            "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/0/material",
                            "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/0/variants/0",
                            "/animations/0/channels/0/target/node",
                            "/animations/0/channels/0/sampler",
                            "/animations/0/samplers/0/input",
                            "/animations/0/samplers/0/output",
                            "/materials/0/normalTexture/index",
                            "/materials/0/extensions/KHR_materials_sheen/sheenColorTexture/index",
                            "/textures/0/source",
                            "/textures/0/sampler",
                            "/images/0/bufferView",
                            "/accessors/1/bufferView",
                            "/accessors/0/sparse/indices/bufferView",
                            "/accessors/0/sparse/values/bufferView"}) {
    for (const Json& number : {Json(7), Json(-1), Json("0"), Json(0.5), Json(1e300)}) {
      INFO(place, " is ", number.dump());
      Json json = good;
      json[Json::json_pointer(place)] = number;
      CHECK(faults_of(json) == std::vector<std::string>{place});
    }
  }
}

TEST_CASE("references: views that nothing uses lie within their buffers, too") {
  Json json = test::Square().json;
  json["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 999}});
  json["bufferViews"].push_back({{"buffer", 1}, {"byteLength", 1}});
  CHECK(faults_of(json) == std::vector<std::string>{"/bufferViews/5", "/bufferViews/6"});
}
