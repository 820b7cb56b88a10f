#include "format/gltf/read_scene.h"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "format/gltf/references.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/format/gltf_square.h"
#include "tests/require.h"
#include "tests/shared_data.h"

using namespace selvedge;
namespace fs = std::filesystem;

namespace {

struct Counts {
  std::size_t triangles = 0;
  std::size_t vertices = 0;
  V3d low{1e300};
  V3d high{-1e300};
};

Counts count(const Scene& scene) {
  Counts counts;
  for (const ScenePrimitive& primitive : scene.primitives) {
    counts.triangles += primitive.indices.size() / 3;
    counts.vertices += primitive.positions.size();
  }
  for (const SceneInstance& instance : scene.instances) {
    for (const V3f& p : scene.primitives[instance.primitive].positions) {
      const V3d world = V3d(p) * instance.world;
      for (int c = 0; c < 3; ++c) {
        counts.low[c] = std::min(counts.low[c], world[c]);
        counts.high[c] = std::max(counts.high[c], world[c]);
      }
    }
  }
  return counts;
}

/// Rows of the table of facts, by column name.
std::vector<std::map<std::string, std::string>> facts() {
  std::ifstream file(fs::path(SELVEDGE_DATA_DIR) / "GLTF_FACTS.tsv");
  std::vector<std::string> header;
  std::vector<std::map<std::string, std::string>> rows;
  for (std::string line; std::getline(file, line);) {
    std::vector<std::string> cells;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, '\t');) cells.push_back(cell);
    if (header.empty()) {
      header = cells;
      continue;
    }
    std::map<std::string, std::string> row;
    for (std::size_t i = 0; i < cells.size() && i < header.size(); ++i) row[header[i]] = cells[i];
    rows.push_back(row);
  }
  return rows;
}

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

TEST_CASE("gltf scene: garments have the triangles, vertices and bounds that other programs count") {
  const fs::path folder = test::shared_data("");
  if (folder.empty()) return;
  int read = 0;
  for (auto& row : facts()) {
    const std::string file = row["file"];
    if (!file.starts_with("garments/") || row["decoded_tris(gltf-transform)"].empty()) continue;
    CAPTURE(file);
    const Scene scene = test::need(read_scene((folder / file).string()));
    const Counts counts = count(scene);
    // The table counts meshes, of whatever scene; we read the default scene, and no points and lines.
    const bool whole = file.find("MultipleScenes") == std::string::npos &&
                       file.find("MeshPrimitiveModes") == std::string::npos;
    if (whole) CHECK(counts.triangles == std::stoul(row["decoded_tris(gltf-transform)"]));
    // Flat shading unshares vertices.
    if (whole && row["prims_without_normals"] == "0")
      CHECK(counts.vertices == std::stoul(row["decoded_verts"]));
    // The table's bounds hold for meshes that are neither morphed, skinned nor copied; at rest that is
    // the same for most.
    const bool posed = file.find("SimpleInstancing") != std::string::npos ||
                       file.find("MorphPrimitivesTest") != std::string::npos ||
                       file.find("RiggedSimple/glTF-Draco") != std::string::npos;
    if (whole && !posed && !row["scene_bounds"].empty()) {
      const auto bounds = nlohmann::json::parse(row["scene_bounds"]);
      for (int c = 0; c < 3; ++c) {
        // The table has six decimals. Quaternions of two files are off by up to 3e-4 from unit length, which
        // the other program leaves so.
        const bool loose = file.find("Cameras") != std::string::npos ||
                           file.find("TextureEncodingTest") != std::string::npos;
        const double scale = (loose ? 3e-4 : 2e-6) * std::max(1.0, std::abs(counts.high[c]));
        CHECK(std::abs(counts.low[c] - bounds[0][c].get<double>()) < scale);
        CHECK(std::abs(counts.high[c] - bounds[1][c].get<double>()) < scale);
      }
    }
    ++read;
  }
  CHECK(read > 60);
}

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
