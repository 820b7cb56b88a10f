// Rules of SELVEDGE_materials_fabric and of glTF that the conformance kit does not break; its broken files
// have the rest.
#include <doctest/doctest.h>

#include "format/base/atomic_file.h"
#include "format/check/gltf.h"
#include "format/fabric/file.h"
#include "format/gltf/read_scene.h"
#include "tests/converter/fabrics.h"
#include "tests/format/gltf_square.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

const std::string fabric_place = "/materials/0/extensions/SELVEDGE_materials_fabric/fabric";
const std::string transform_place = fabric_place + "/extensions/KHR_texture_transform";

/// The same for the fabric and its fallback.
auto placed(const char* member, const Json& value) {
  return [=](Square& s) {
    for (const char* owner : {fabric_place.c_str(), "/materials/0/pbrMetallicRoughness/baseColorTexture"})
      s.at(owner)["extensions"]["KHR_texture_transform"][member] = value;
  };
}

}  // namespace

TEST_CASE(
    "gltf check: transforms of fabrics that floats cannot hold are named where they stand, and not read") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "the net.exr", net_fabric()));
  const std::string scale = transform_place + "/scale";
  const std::string rotation = transform_place + "/rotation";
  const std::vector<Case> cases{
      {"scale that is 0 as a float", placed("scale", {1e-300, 20}), Code::gltf_extension, scale.c_str()},
      {"scale beyond floats", placed("scale", {20, -1e300}), Code::gltf_extension, scale.c_str()},
      {"rotation beyond floats", placed("rotation", 1e300), Code::gltf_extension, rotation.c_str()}};
  check_cases(folder, cases, true);
  Square square;
  square.dress();
  check(folder, square);
  CHECK(read_scene(folder / "case.glb").has_value());
  cases[0].spoil(square);
  check(folder, square);
  CHECK(test::error_of(read_scene(folder / "case.glb")).place == scale);
}

TEST_CASE("gltf check: what a consumer would see wrongly is a warning") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "the net.exr", net_fabric()));
  check_cases(folder,
              {
                  {"another UV set of a texture that is not the base colour",
                   [](Square& s) {
                     s.at("/materials/0/pbrMetallicRoughness")["metallicRoughnessTexture"] = {{"index", 0}};
                   },
                   Code::gltf_transform, "/materials/0/pbrMetallicRoughness/metallicRoughnessTexture"},
                  {"another transform of the sheen",
                   [](Square& s) {
                     s.json["extensionsUsed"].push_back("KHR_materials_sheen");
                     s.material()["extensions"]["KHR_materials_sheen"]["sheenColorTexture"] = {{"index", 0}};
                   },
                   Code::gltf_transform, "/materials/0/extensions/KHR_materials_sheen/sheenColorTexture"},
                  {"mirrored fallback",
                   [](Square& s) {
                     s.json["samplers"] = Json::array({{{"wrapT", 33648}}});
                     s.at("/textures/0")["sampler"] = 0;
                   },
                   Code::gltf_fallback, "/materials/0/pbrMetallicRoughness/baseColorTexture"},
                  {"single-sided variant",
                   [](Square& s) {
                     s.wear_variants();
                     s.at("/materials/1")["doubleSided"] = false;
                   },
                   Code::gltf_advice, "/materials/1/doubleSided"},
              },
              true);
}

TEST_CASE("gltf check: issues of a fabric say which fabric, embedded or beside") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "net.exr", net_fabric()));
  std::string fabric = *read_file(folder / "net.exr");
  Square square;
  square.dress();
  fabric[fabric.size() - 40] = static_cast<char>(fabric[fabric.size() - 40] ^ 1);
  write_bytes(folder / "the net.exr", fabric);
  Issues issues = check(folder, square);
  REQUIRE_FALSE(issues.empty());
  CHECK(issues[0].file == folder / "the net.exr");

  square.root_fabrics()[0].erase("uri");
  square.root_fabrics()[0]["bufferView"] = square.add_view(fabric);
  issues = check(folder, square);
  REQUIRE_FALSE(issues.empty());
  for (const Error& issue : issues) {
    CHECK(issue.file == folder / "case.glb");
    CHECK(issue.place.starts_with("/extensions/SELVEDGE_materials_fabric/fabrics/0"));
  }
}

TEST_CASE("gltf check: textures beside the fabric may lie otherwise, and extras mean nothing") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "the net.exr", net_fabric()));
  Square square;
  square.dress();
  square.json["samplers"] = Json::parse(R"([{"wrapS":10497,"wrapT":10497},{"wrapS":33071,"wrapT":33648}])");
  square.at("/textures/0")["sampler"] = 0;
  square.json["textures"].push_back({{"source", 0}, {"sampler", 1}});
  square.material()["occlusionTexture"] = {{"index", 1}};
  square.material()["emissiveTexture"] = {{"index", 1}};
  square.material()["extras"]["SELVEDGE_materials_fabric"] = {{"index", 7}, {"uri", "../none.exr"}};
  CHECK(text_of(check(folder, square)) == "");
}

TEST_CASE("gltf check: what nothing shows, numbers of variants and joints are named where they stand") {
  const Folder folder;
  check_cases(folder,
              {
                  {"mesh of nothing in another scene",
                   [](Square& s) {
                     s.json["nodes"].push_back({{"mesh", 9}});
                     s.json["scenes"].push_back({{"nodes", {1}}});
                   },
                   Code::gltf_accessor, "/nodes/1/mesh"},
                  {"view that nothing uses beyond its buffer",
                   [](Square& s) {
                     s.json["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 999}});
                   },
                   Code::gltf_accessor, "/bufferViews/5"},
                  {"material of a variant of nothing",
                   [](Square& s) { s.wear_variants()[1]["material"] = 2; }, Code::gltf_accessor,
                   "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/1/material"},
                  {"variant of nothing", [](Square& s) { s.wear_variants()[1]["variants"] = {2}; },
                   Code::gltf_accessor,
                   "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/1/variants/0"},
                  {"joint beyond the smaller of two skins",
                   [](Square& s) {
                     s.skin();
                     s.json["nodes"].push_back({{"mesh", 0}, {"skin", 1}});
                     s.at("/scenes/0/nodes").push_back(2);
                     s.json["skins"].push_back({{"joints", {1, 2}}});
                     s.put<std::uint8_t>(204, 1);
                   },
                   Code::gltf_accessor, "/meshes/0/primitives/0/attributes/JOINTS_0"},
                  {"joint that is no node",
                   [](Square& s) {
                     s.skin();
                     s.at("/skins/0")["joints"] = {7};
                   },
                   Code::gltf_accessor, "/nodes/7"},
              },
              false);
  Square good;
  good.skin();
  good.wear_variants();
  CHECK(text_of(check(folder, good)) == "");
}
