// Poses, lights and cameras of nodes while nothing is animated: closed forms.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "format/gltf/read_scene.h"
#include "tests/format/gltf_square.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

Result<Scene> read(const Square& square, const SceneChoice& choice = {}) {
  return load(square).and_then(
      [&](const GltfDocument& document) { return read_scene(document, {}, choice); });
}

Scene good(const Square& square, const SceneChoice& choice = {}) {
  Result<Scene> scene = read(square, choice);
  if (!scene) FAIL(to_line(scene.error()));
  return std::move(*scene);
}

}  // namespace

TEST_CASE("rest: morph targets add their differences by the node's weights, else by the mesh's") {
  Square square;
  const auto up = square.add_accessor(bytes_of<float>({0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4}), 5126, 4, "VEC3");
  const auto tilt =
      square.add_accessor(bytes_of<float>({2, 0, 0, 2, 0, 0, 2, 0, 0, 2, 0, 0}), 5126, 4, "VEC3");
  square.primitive()["targets"] = {{{"POSITION", up}, {"NORMAL", tilt}}, {{"POSITION", up}}};
  square.json["meshes"][0]["weights"] = {0.5, 0};
  const Scene by_mesh = good(square);
  CHECK(by_mesh.primitives[0].positions[3] == V3f(0, 1, 2));
  const float half = std::sqrt(0.5F);
  CHECK((by_mesh.primitives[0].normals[0] - V3f(half, 0, half)).length() < 1e-6F);  // (1, 0, 1), made unit
  square.json["nodes"][0]["weights"] = {0, -1};
  const Scene by_node = good(square);
  CHECK(by_node.primitives[0].positions[3] == V3f(0, 1, -4));
  CHECK(by_node.primitives[0].normals[0] == V3f(0, 0, 1));
}

TEST_CASE("rest: two nodes with other weights show two meshes, equal ones share theirs") {
  Square square;
  const auto up = square.add_accessor(bytes_of<float>({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}), 5126, 4, "VEC3");
  square.primitive()["targets"] = {{{"POSITION", up}}};
  square.json["nodes"] = Json::parse(R"([{"mesh":0},{"mesh":0,"weights":[1]},{"mesh":0}])");
  square.json["scenes"][0]["nodes"] = {0, 1, 2};
  const Scene scene = good(square);
  CHECK(scene.primitives.size() == 2);
  REQUIRE(scene.instances.size() == 3);
  CHECK(scene.instances[0].primitive == scene.instances[2].primitive);
}

TEST_CASE("rest: a skin puts its vertices where the joints are, wherever the mesh's node stands") {
  Square square;
  square.skin();
  // The joint: a quarter turn about z and a step; its bind pose was another step.
  square.json["nodes"][0]["translation"] = {100, 100, 100};
  square.json["nodes"][1] =
      Json::parse(R"({"translation":[5,0,0],"rotation":[0,0,0.7071067811865476,0.7071067811865476]})");
  const auto inverse =
      square.add_accessor(bytes_of<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 7, 1}), 5126, 1, "MAT4");
  square.json["skins"][0]["inverseBindMatrices"] = inverse;
  const Scene scene = good(square);
  REQUIRE(scene.instances.size() == 1);
  CHECK(scene.instances[0].world == M44d());
  // (1, 0, 0) -> (1, 0, 7) -> turned (0, 1, 7) -> (5, 1, 7)
  CHECK((scene.primitives[0].positions[1] - V3f(5, 1, 7)).length() < 1e-5F);
  CHECK((scene.primitives[0].normals[1] - V3f(0, 0, 1)).length() < 1e-6F);
  const V4f& t = scene.primitives[0].tangents[1];
  CHECK((V3f(t.x, t.y, t.z) - V3f(0, 1, 0)).length() < 1e-6F);
}

TEST_CASE("rest: two joints share a vertex by their weights, and normals follow the inverse transpose") {
  Square square;
  square.skin();
  square.json["nodes"][1] = Json::parse(R"({"scale":[2,1,1]})");
  square.json["nodes"].push_back(Json::parse(R"({"translation":[0,0,8]})"));
  square.json["scenes"][0]["nodes"].push_back(2);
  square.json["skins"][0]["joints"] = {1, 2};
  std::string joints;
  std::string weights;
  for (int v = 0; v < 4; ++v) {
    joints += std::string("\0\1\0\0", 4);
    weights += bytes_of<float>({1, 3, 0, 0});  // add up to 4: made 1
  }
  const auto number = square.add_accessor(joints, 5121, 4, "VEC4");
  square.primitive()["attributes"]["JOINTS_0"] = number;
  square.primitive()["attributes"]["WEIGHTS_0"] = square.add_accessor(weights, 5126, 4, "VEC4");
  square.put<float>(48, 0.6F);  // a normal aslant
  square.put<float>(56, 0.8F);
  const Scene scene = good(square);
  // x: 1 -> a quarter of 2 and three quarters of 1; z: three quarters of 8.
  CHECK((scene.primitives[0].positions[2] - V3f(1.25F, 1, 6)).length() < 1e-5F);
  const V3f normal = V3f(0.6F / 1.25F, 0, 0.8F).normalized();
  CHECK((scene.primitives[0].normals[0] - normal).length() < 1e-5F);
}

TEST_CASE("rest: joints in a ring are refused, not followed") {
  Square square;
  square.skin();
  square.json["nodes"].push_back({{"children", {3}}});
  square.json["nodes"].push_back({{"children", {2}}});
  square.json["skins"][0]["joints"] = {3};
  CHECK(test::error_of(read(square)).code == Code::gltf_malformed);
}

TEST_CASE("rest: instances stand at translation, rotation and scale before the node's own transform") {
  Square square;
  square.json["nodes"][0] = Json::parse(R"({"mesh":0,"translation":[0,10,0]})");
  Json& attributes = square.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  attributes["TRANSLATION"] = square.add_accessor(bytes_of<float>({1, 2, 3, -1, -2, -3}), 5126, 2, "VEC3");
  attributes["SCALE"] = square.add_accessor(bytes_of<float>({1, 1, 1, 2, 2, 2}), 5126, 2, "VEC3");
  // A quarter turn about z, as normalised shorts.
  attributes["ROTATION"] =
      square.add_accessor(bytes_of<std::int16_t>({0, 0, 0, 32767, 0, 0, 23170, 23170}), 5122, 2, "VEC4");
  square.json["accessors"].back()["normalized"] = true;
  square.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  square.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  const Scene scene = good(square);
  REQUIRE(scene.instances.size() == 2);
  CHECK((V3d(1, 0, 0) * scene.instances[0].world - V3d(2, 12, 3)).length() < 1e-9);
  CHECK((V3d(1, 0, 0) * scene.instances[1].world - V3d(-1, 10, -3)).length() < 1e-9);
  attributes["SCALE"] = square.add_accessor(bytes_of<float>({1, 1, 1}), 5126, 1, "VEC3");
  CHECK(test::error_of(read(square)).place == "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/SCALE");
}

TEST_CASE("scenes: one may be chosen by name or number, what is not there is refused") {
  Square square;
  square.json["scenes"] = Json::parse(R"([{"nodes":[0]},{"name":"empty"}])");
  CHECK(good(square).instances.size() == 1);
  CHECK(good(square, {.scene = "empty", .variant = ""}).instances.empty());
  CHECK(good(square, {.scene = "1", .variant = ""}).instances.empty());
  const Error error = test::error_of(read(square, {.scene = "full", .variant = ""}));
  CHECK(error.code == Code::option_out_of_range);
  CHECK(error.place == "--scene");
  CHECK(error.message.find("1 \"empty\"") != std::string::npos);
}

TEST_CASE("variants: the primitives wear the material of the one that is chosen") {
  Square square;
  square.dress();
  square.wear_variants();
  CHECK(good(square).primitives[0].material == 0);
  CHECK(good(square, {.scene = "", .variant = "b"}).primitives[0].material == 1);
  CHECK(good(square, {.scene = "", .variant = "0"}).primitives[0].material == 0);
  CHECK(test::error_of(read(square, {.scene = "", .variant = "c"})).place == "--variant");
}

TEST_CASE("lights: they stand and shine as their nodes do, whatever their scale") {
  Square square;
  square.json["extensionsUsed"] = {"KHR_lights_punctual"};
  square.json["extensions"]["KHR_lights_punctual"]["lights"] = Json::parse(
      R"([{"type":"spot","name":"key","color":[1,0.5,0],"intensity":40,"range":9,"spot":{"innerConeAngle":0.1}},
          {"type":"area"},{"type":"directional"}])");
  // Half a turn about y: it looks along +z.
  square.json["nodes"].push_back(Json::parse(
      R"({"translation":[1,2,3],"rotation":[0,1,0,0],"scale":[3,3,3],"extensions":{"KHR_lights_punctual":{"light":0}}})"));
  square.json["nodes"].push_back(Json::parse(R"({"extensions":{"KHR_lights_punctual":{"light":1}}})"));
  square.json["nodes"].push_back(Json::parse(R"({"extensions":{"KHR_lights_punctual":{"light":2}}})"));
  square.json["scenes"][0]["nodes"] = {0, 1, 2, 3};
  const Scene scene = good(square);
  REQUIRE(scene.lights.size() == 2);
  const SceneLight& key = scene.lights[0];
  CHECK(key.kind == LightKind::spot);
  CHECK(key.name == "key");
  CHECK(key.color == V3f(1, 0.5F, 0));
  CHECK(key.intensity == 40);
  CHECK(key.range == 9);
  CHECK(key.inner_cone == 0.1);
  CHECK(key.outer_cone == doctest::Approx(std::numbers::pi / 4));
  CHECK((key.position - V3d(1, 2, 3)).length() < 1e-12);
  CHECK((key.direction - V3d(0, 0, 1)).length() < 1e-12);
  CHECK(scene.lights[1].direction == V3d(0, 0, -1));
  REQUIRE(scene.remarks.size() == 1);
  CHECK(scene.remarks[0] == "/extensions/KHR_lights_punctual/lights/1: unknown type; left out");
}

TEST_CASE("cameras: lenses and places are read, one that shows nothing is remarked") {
  Square square;
  square.json["cameras"] = Json::parse(
      R"([{"type":"perspective","perspective":{"yfov":0.7,"znear":0.01,"aspectRatio":1.5}},
          {"type":"orthographic","orthographic":{"xmag":2,"ymag":1,"znear":0,"zfar":10}},
          {"type":"perspective","perspective":{"yfov":0,"znear":0.01}}])");
  for (int camera = 0; camera < 3; ++camera) {
    square.json["nodes"].push_back(
        {{"name", std::string{'n', static_cast<char>('0' + camera)}}, {"camera", camera}});
    square.json["scenes"][0]["nodes"].push_back(camera + 1);
  }
  const Scene scene = good(square);
  REQUIRE(scene.cameras.size() == 2);
  CHECK(scene.cameras[0].name == "n0");
  CHECK(scene.cameras[0].yfov == 0.7);
  CHECK(scene.cameras[0].aspect == 1.5);
  CHECK_FALSE(scene.cameras[0].zfar.has_value());
  CHECK_FALSE(scene.cameras[1].is_perspective);
  CHECK(scene.cameras[1].half_size == V2d(2, 1));
  CHECK(scene.remarks.size() == 1);
}

TEST_CASE("materials: core parameters, samplers and extensions are read") {
  Square square;
  square.dress();
  square.json["samplers"] = Json::parse(R"([{"wrapS":33071,"wrapT":33648,"magFilter":9728}])");
  square.json["textures"][0]["sampler"] = 0;
  square.json["materials"][0] =
      Json::parse(R"({"pbrMetallicRoughness":{"metallicFactor":0.25,"roughnessFactor":0.5,
      "metallicRoughnessTexture":{"index":0}},
    "normalTexture":{"index":0,"scale":0.75,"texCoord":1},"occlusionTexture":{"index":0,"strength":0.125},
    "emissiveFactor":[1,0.5,0.25],"emissiveTexture":{"index":0},
    "extensions":{"KHR_materials_unlit":{},"KHR_materials_emissive_strength":{"emissiveStrength":4}}})");
  const Scene scene = good(square);
  const SceneMaterial& m = scene.materials[0];
  CHECK(m.metallic == 0.25F);
  CHECK(m.roughness == 0.5F);
  CHECK(m.metallic_roughness_texture.image == 0);
  CHECK(m.metallic_roughness_texture.wrap_u == Wrap::clamp);
  CHECK(m.metallic_roughness_texture.wrap_v == Wrap::mirror);
  CHECK(m.metallic_roughness_texture.has_nearest_filter);
  CHECK(m.normal_texture.tex_coord == 1);
  CHECK(m.normal_scale == 0.75F);
  CHECK(m.occlusion_strength == 0.125F);
  CHECK(m.emissive == V3f(4, 2, 1));
  CHECK(m.unlit);
  CHECK(m.base_color_texture.image == -1);
}

TEST_CASE("attributes: colours of three numbers are opaque, quantised coordinates keep their digits") {
  Square square;
  square.primitive()["attributes"]["COLOR_0"] =
      square.add_accessor(std::string("\xff\x80\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 16), 5121, 4, "VEC3");
  square.json["accessors"].back()["normalized"] = true;
  square.json["bufferViews"].back()["byteStride"] = 4;
  square.primitive()["attributes"]["TEXCOORD_1"] =
      square.add_accessor(bytes_of<std::uint16_t>({1, 2, 3, 4, 5, 6, 7, 8}), 5123, 4, "VEC2");
  square.json["accessors"].back()["normalized"] = true;
  const Scene scene = good(square);
  CHECK(scene.primitives[0].colors[0] == V4f(1, 128 / 255.0F, 0, 1));
  CHECK(scene.primitives[0].tex_coords[1][0] == V2d(1 / 65535.0, 2 / 65535.0));
}

TEST_CASE("normals of length 0 are made from the triangles around them, flat ones if all are, and remarked") {
  for (const std::size_t zeros : {0U, 1U, 4U}) {
    INFO(zeros);
    Square square;
    for (std::size_t i = 0; i < 3 * zeros; ++i) square.put(48 + 4 * i, 0.0F);
    const Scene scene = good(square);
    for (const V3f& normal : scene.primitives[0].normals) CHECK(normal == V3f(0, 0, 1));
    CHECK(scene.primitives[0].normals.size() == (zeros == 4 ? 6 : 4));
    CHECK(scene.primitives[0].tangents.empty() == (zeros == 4));
    REQUIRE(scene.remarks.size() == (zeros > 0 ? 1 : 0));
    if (zeros > 0) CHECK(scene.remarks[0].starts_with("/meshes/0/primitives/0/attributes/NORMAL has"));
  }
}
