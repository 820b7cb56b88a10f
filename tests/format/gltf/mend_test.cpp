#include "format/gltf/mend.h"

#include <doctest/doctest.h>

#include "tests/require.h"

using namespace selvedge;

namespace {

GltfDocument document_of(const char* json) {
  GltfDocument document;
  document.file = "garment.gltf";
  document.json = Json::parse(json);
  return document;
}

}  // namespace

TEST_CASE("mend: what says nothing is left out, one line for each kind, and the rest stays") {
  GltfDocument document = document_of(R"({
    "asset":{"version":"2.0","generator":7},"accessors":[{},{},{}],"scene":0,"scenes":[],"animations":[
      {"channels":[],"samplers":[]},{"name":"walk","channels":[{"sampler":0}],"samplers":[{"input":0}]}],
    "nodes":[{"name":[1],"children":[]},{"camera":null,"extras":{"name":3,"list":[]}}],"skins":[],
    "extensions":{"ACME_things":{"name":3,"list":[]}},
    "meshes":[{"name":"square","weights":[],"primitives":[
      {"attributes":{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_01":1,"TEXCOORD_":1,"uv":1,"_OWN":2}}]}]})");
  const std::vector<std::string> lines = test::need(mend(document));
  CHECK(document.json == Json::parse(R"({
    "asset":{"version":"2.0"},"accessors":[{},{},{}],"animations":[
      {"name":"walk","channels":[{"sampler":0}],"samplers":[{"input":0}]}],
    "nodes":[{},{"extras":{"name":3,"list":[]}}],
    "extensions":{"ACME_things":{"name":3,"list":[]}},
    "meshes":[{"name":"square","primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1,"_OWN":2}}]}]})"));
  const std::string attribute = "/meshes/0/primitives/0/attributes/TEXCOORD_01";
  CHECK(lines == std::vector<std::string>{
                     "left out: /scenes, which has no items, and 3 more like it",
                     "left out: " + attribute + ", which is no attribute of glTF, and 2 more like it",
                     "left out: /asset/generator, which is no string, and 1 more like it",
                     "left out: /nodes/1/camera, which is null",
                     "left out: /animations/0, which moves nothing"});
  CHECK(test::need(mend(document)).empty());
}

TEST_CASE("mend: what has to stay and breaks a rule is refused where it stands") {
  for (const auto& [json, place, message] :
       {std::tuple(R"({"meshes":[{"primitives":[]}]})", "/meshes/0/primitives", "is empty"),
        std::tuple(R"({"skins":[{"joints":[0]},{"joints":[]}]})", "/skins/1/joints", "is empty"),
        std::tuple(R"({"meshes":[{"primitives":[{"attributes":{"TEXCOORD_0":1,"TEXCOORD_2":1}}]}]})",
                   "/meshes/0/primitives/0/attributes", "TEXCOORD_2 without TEXCOORD_1"),
        std::tuple(R"({"meshes":[{"primitives":[{"attributes":{"COLOR_1":1}}]}]})",
                   "/meshes/0/primitives/0/attributes", "COLOR_1 without COLOR_0"),
        std::tuple(R"({"meshes":[{"primitives":[{"attributes":{"TEXCOORD_2147483647":1}}]}]})",
                   "/meshes/0/primitives/0/attributes", "TEXCOORD_2147483647 without TEXCOORD_2147483646"),
        std::tuple(R"({"meshes":[{"primitives":null}]})", "/meshes/0/primitives", "is no list"),
        std::tuple(R"({"meshes":[{"name":"none"}]})", "/meshes/0/primitives", "is no list"),
        std::tuple(R"({"skins":[{"joints":null}]})", "/skins/0/joints", "is no list"),
        std::tuple(R"({"meshes":[{"primitives":[{"attributes":{"TEXCOORD_0":null,"TEXCOORD_1":1}}]}]})",
                   "/meshes/0/primitives/0/attributes", "TEXCOORD_1 without TEXCOORD_0")}) {
    GltfDocument document = document_of(json);
    const Error error = test::error_of(mend(document));
    CHECK(error.code == Code::gltf_malformed);
    CHECK(error.place == place);
    CHECK(error.message == message);
  }
}

TEST_CASE("mend: a hundred texture coordinates without a gap are as they should be") {
  GltfDocument document = document_of(R"({"meshes":[{"primitives":[{"attributes":{}}]}]})");
  document.json["accessors"] = Json::array_t(100, Json::object());
  for (int i = 0; i < 100; ++i)
    document.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_" + std::to_string(i)] = i;
  const Json before = document.json;
  CHECK(test::need(mend(document)).empty());
  CHECK(document.json == before);
}

TEST_CASE("mend: attributes of morph targets are looked at as well") {
  GltfDocument document = document_of(R"({"meshes":[{"primitives":[{"attributes":{"POSITION":0},
    "targets":[{"POSITION":1,"uv":2},{"POSITION":null,"NORMAL":3}]}]}],"accessors":[{},{},{},{}]})");
  const std::vector<std::string> lines = test::need(mend(document));
  CHECK(document.json["meshes"][0]["primitives"][0]["targets"] ==
        Json::parse(R"([{"POSITION":1},{"NORMAL":3}])"));
  const std::string target = "left out: /meshes/0/primitives/0/targets/";
  CHECK(lines == std::vector<std::string>{target + "0/uv, which is no attribute of glTF",
                                          target + "1/POSITION, which is null"});
}

TEST_CASE("mend: numbers of what is not there are refused, for dressing would put something there") {
  GltfDocument document = document_of(R"({"meshes":[{"primitives":[{"attributes":{},"material":0}]}]})");
  const Error error = test::error_of(mend(document));
  CHECK(error.code == Code::gltf_accessor);
  CHECK(error.place == "/meshes/0/primitives/0/material");
}
