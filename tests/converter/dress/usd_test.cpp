#include "converter/dress/usd.h"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "tests/converter/workshop.h"
#include "tests/require.h"

using namespace selvedge;
using test::square;
using test::Workshop;
namespace fs = std::filesystem;

namespace {

/// Dresses the workshop's garment and gives back the files of its USD layer, the layer as a text.
struct UsdLayer {
  UsdFiles files;
  std::string text;

  explicit UsdLayer(const Workshop& workshop, const DressOptions& options = {.all_cloth = true}) {
    REQUIRE(workshop.dress(options));
    const GltfDocument document = test::need(load_gltf(workshop.output));
    files = test::need(usd_of(document, workshop.folder / "layer.usda"));
    text.assign(files.files.back().bytes.begin(), files.files.back().bytes.end());
  }

  bool has(const std::string& part) const { return text.find(part) != std::string::npos; }
};

/// UsdTransform2d as its specification has it: scale, then rotation counter-clockwise, then translation.
V2d apply(const UsdTransform2d& transform, const V2d& st) {
  const double angle = transform.rotation * std::numbers::pi / 180.0;
  const V2d scaled(st.x * transform.scale.x, st.y * transform.scale.y);
  return V2d(scaled.x * std::cos(angle) - scaled.y * std::sin(angle),
             scaled.x * std::sin(angle) + scaled.y * std::cos(angle)) +
         transform.translation;
}

}  // namespace

TEST_CASE("usd: the transform takes (u, 1 - v) to where glTF's takes (u, v), v turned over") {
  for (const double rotation : {0.0, 0.3, std::numbers::pi / 2, -2.0}) {
    for (const V2d& scale : {V2d(1, 1), V2d(200, 250), V2d(-3, 0.5)}) {
      UvTransform transform{.offset = V2d(0.25, -7), .rotation = rotation, .scale = scale};
      for (const V2d& uv : {V2d(0, 0), V2d(1, 0), V2d(0, 1), V2d(-1.5, 0.7)}) {
        const V2d wanted = transform.apply(uv);
        const V2d got = apply(usd_transform(transform), V2d(uv.x, 1 - uv.y));
        CHECK(got.x == doctest::Approx(wanted.x).epsilon(1e-12));
        CHECK(got.y == doctest::Approx(1 - wanted.y).epsilon(1e-12));
      }
    }
  }
}

TEST_CASE("usd: a square in the net has its corners, its holes, and its fabric beside") {
  const Workshop workshop;
  const UsdLayer layer(workshop);
  CHECK(layer.text.starts_with("#usda 1.0\n"));
  CHECK(layer.has("upAxis = \"Y\""));
  CHECK(layer.has("point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]"));
  CHECK(layer.has("int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]"));
  CHECK(layer.has("texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)]"));
  CHECK(layer.has("uniform bool doubleSided = 1"));
  CHECK(layer.has("float2 inputs:scale = (200, 250)"));
  CHECK(layer.has("float2 inputs:translation = (0, -249)"));
  CHECK(layer.has("float inputs:opacityThreshold = 0.5"));
  CHECK(layer.has("float inputs:opacity.connect = </Garment/Materials/cloth_0/base_color.outputs:a>"));
  CHECK(layer.has("custom asset selvedge:fabric:file = @./layer-fabric0.exr@"));
  CHECK(layer.has("custom float2 selvedge:fabric:st.connect = </Garment/Materials/cloth_0/transform_0"));
  CHECK_FALSE(layer.has("transform_1"));  // fabric and fallback share the first
  REQUIRE(layer.files.files.size() >= 3);
  const UsdFile& fabric = *(layer.files.files.end() - 2);
  CHECK(fs::path(fabric.path).filename() == "layer-fabric0.exr");
  CHECK(fabric.bytes.size() == fs::file_size(workshop.fabric));
}

TEST_CASE("usd: nodes, the second UV set and single-sidedness are kept") {
  Workshop workshop;
  workshop.edit([](Json& json) {
    json["nodes"][0]["translation"] = {1, 2, 3};
    json["nodes"][0]["scale"] = {2, 2, 2};
    json["materials"][0]["doubleSided"] = false;
    Json& attributes = json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_1"] = attributes["TEXCOORD_0"];
  });
  const UsdLayer layer(workshop, {.all_cloth = true, .single_sided = true, .tex_coord = 1});
  CHECK(layer.has("matrix4d xformOp:transform = ( (2, 0, 0, 0), (0, 2, 0, 0), (0, 0, 2, 0), (1, 2, 3, 1) )"));
  CHECK(layer.has("texCoord2f[] primvars:st1 = "));
  CHECK(layer.has("string inputs:varname = \"st1\""));
  CHECK_FALSE(layer.has("string inputs:varname = \"st\"\n"));
  CHECK(layer.has("uniform bool doubleSided = 0"));
}

TEST_CASE("usd: names become identifiers, each its own") {
  Garment garment = square(3);
  garment.materials[0] = "Größe 1";
  garment.materials[1] = "2 \"quoted\"";
  garment.materials[2] = garment.materials[1];
  const UsdLayer layer{Workshop(garment)};
  CHECK(layer.has("def Material \"Gr____e_1\""));
  CHECK(layer.has("def Material \"_2__quoted_\""));
  CHECK(layer.has("def Material \"_2__quoted__1\""));
  CHECK(layer.has("def Mesh \"square_0\""));
  CHECK(layer.has("def Mesh \"square_2\""));
}

TEST_CASE("usd: a material without a fabric is a UsdPreviewSurface like any other") {
  Workshop workshop(square(2));
  workshop.edit([](Json& json) {
    json["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"] = {0.5, 0.25, 0.125, 1};
  });
  const UsdLayer layer(workshop, {.materials = {"cloth 0"}});
  CHECK(layer.has("color3f inputs:diffuseColor = (0.5, 0.25, 0.125)"));
  const std::size_t second = layer.text.find("def Material \"cloth_1\"");
  REQUIRE(second != std::string::npos);
  CHECK(layer.text.find("selvedge:fabric", second) == std::string::npos);
}

TEST_CASE("usd: pictures that are files stay where they are, and none is overwritten") {
  Workshop workshop(square(2));
  const auto with_image = [&](const std::string& uri) {
    test::write_bytes(workshop.folder / uri, "\x89PNG picture");
    workshop.edit([&](Json& json) {
      json["images"] = Json::array({Json{{"uri", uri}}});
      json["textures"] = Json::array({Json{{"source", 0}}});
      json["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    });
  };
  workshop.garment = workshop.folder / "garment.gltf";
  REQUIRE(write_garment(workshop.folder / "garment.glb", square(2)));
  REQUIRE(save_gltf(*load_gltf(workshop.folder / "garment.glb"), workshop.garment));
  workshop.output = workshop.folder / "dressed.gltf";
  with_image("wood.png");
  CHECK(UsdLayer(workshop, {.materials = {"cloth 0"}}).has("asset inputs:file = @./wood.png@"));
  with_image("layer-image1.png");
  REQUIRE(workshop.dress({.materials = {"cloth 0"}}));
  CHECK(test::error_of(usd_of(*load_gltf(workshop.output), workshop.folder / "layer.usda")).code ==
        Code::file_unwritable);
}

TEST_CASE("usd: pictures that USD does not know are left out with a remark") {
  Workshop workshop(square(2));
  workshop.edit([](Json& json) {
    json["images"] = Json::array({Json{{"uri", "data:image/webp;base64,UklGRgAAAABXRUJQ"}}});
    json["textures"] = Json::array({Json{{"source", 0}}});
    json["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
  });
  const UsdLayer layer(workshop, {.materials = {"cloth 0"}});
  CHECK(layer.files.remarks.size() == 1);
}
