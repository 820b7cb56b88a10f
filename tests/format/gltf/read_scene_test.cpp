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

#include "tests/format/gltf_fixtures.h"
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
