#include "format/gltf/draco.h"

#include <doctest/doctest.h>
#include <draco/compression/decode.h>
#include <draco/compression/encode.h>

#include <filesystem>
#include <string>

#include "format/base/atomic_file.h"
#include "format/gltf/document.h"
#include "format/gltf/read_scene.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/require.h"
#include "tests/shared_data.h"

using namespace selvedge;
namespace fs = std::filesystem;

namespace {

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// A strip of triangles, written by Draco itself.
std::string strip(int triangles, bool edgebreaker) {
  draco::Mesh mesh;
  mesh.set_num_points(static_cast<std::uint32_t>(triangles + 2));
  draco::GeometryAttribute attribute;
  attribute.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 12, 0);
  const int id = mesh.AddAttribute(attribute, true, static_cast<std::uint32_t>(triangles + 2));
  for (int i = 0; i < triangles + 2; ++i) {
    const float position[3] = {static_cast<float>(i / 2), static_cast<float>(i % 2), 0};
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(static_cast<std::uint32_t>(i)),
                                          position);
  }
  for (int i = 0; i < triangles; ++i) {
    const auto k = static_cast<std::uint32_t>(i);
    const std::uint32_t odd = k % 2;
    mesh.AddFace({draco::PointIndex(k), draco::PointIndex(k + 1 + odd), draco::PointIndex(k + 2 - odd)});
  }
  draco::Encoder encoder;
  encoder.SetEncodingMethod(edgebreaker ? draco::MESH_EDGEBREAKER_ENCODING : draco::MESH_SEQUENTIAL_ENCODING);
  draco::EncoderBuffer buffer;
  REQUIRE(encoder.EncodeMeshToBuffer(mesh, &buffer).ok());
  return {buffer.data(), buffer.size()};
}

std::string glb_of(const std::string& bytes, int triangles) {
  const std::string counts = std::to_string(triangles + 2);
  return test::glb(R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_draco_mesh_compression"],
      "extensionsRequired":["KHR_draco_mesh_compression"],"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"extensions":
        {"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0}}}}]}],
      "accessors":[{"componentType":5126,"count":)" +
                       counts + R"(,"type":"VEC3","min":[0,0,0],"max":[9,1,0]},
                   {"componentType":5125,"count":)" +
                       std::to_string(3 * triangles) + R"(,"type":"SCALAR"}],
      "bufferViews":[{"buffer":0,"byteLength":)" +
                       std::to_string(bytes.size()) + R"(}],
      "buffers":[{"byteLength":)" +
                       std::to_string(bytes.size()) + "}]}",
                   bytes);
}

}  // namespace

TEST_CASE("draco header: the counts are those that Draco decodes") {
  for (const bool edgebreaker : {true, false}) {
    const std::string bytes = strip(40, edgebreaker);
    const auto counts = test::need(draco_counts(bytes_of(bytes)));
    CHECK(counts.faces == 40);
    CHECK(counts.points == 42);
    for (std::size_t size = 0; size < 12; ++size) CHECK_FALSE(draco_counts(bytes_of(bytes.substr(0, size))));
  }
}

TEST_CASE("draco header: files of all bitstream versions of the field say what they hold") {
  const fs::path folder = test::shared_data("gltf/compress/draco_drc");
  if (folder.empty()) return;
  int meshes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".drc") continue;
    CAPTURE(entry.path().string());
    const std::string bytes = *read_file(entry.path().string());
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
    if (!type.ok() || type.value() != draco::TRIANGULAR_MESH) continue;
    draco::Decoder decoder;
    auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
    if (!mesh.ok()) continue;
    const auto counts = test::need(draco_counts(bytes_of(bytes)));
    CHECK(counts.faces == mesh.value()->num_faces());
    ++meshes;
  }
  CHECK(meshes > 15);
}

TEST_CASE("draco header: a mesh that claims more than its bytes can hold is refused before it is decoded") {
  const test::Folder folder;
  for (const bool edgebreaker : {true, false}) {
    std::string bytes = strip(40, edgebreaker);
    test::write_bytes(folder / "case.glb", glb_of(bytes, 40));
    const auto scene = test::need(read_scene(folder / "case.glb"));
    CHECK(scene.primitives[0].indices.size() == 120);
    // The number of faces, one byte, becomes a number of five.
    const std::size_t at = edgebreaker ? 13 : 11;
    REQUIRE(bytes[at] == 40);
    bytes.replace(at, 1, "\xFF\xFF\xFF\xFF\x04");
    test::write_bytes(folder / "case.glb", glb_of(bytes, 40));
    CHECK(test::error_of(read_scene(folder / "case.glb")).code == Code::file_too_large);
  }
}

TEST_CASE("draco: primitives that share accessors get the values of their own streams, and keep these") {
  const test::Folder folder;
  for (const bool vertices_too : {false, true}) {
    std::string json;
    std::string bytes;
    for (const int triangles : {40, 24, 8}) {
      const std::string stream = strip(triangles, true);
      json += std::string(json.empty() ? "" : ",") + R"({"view":{"buffer":0,"byteOffset":)" +
              std::to_string(bytes.size()) + R"(,"byteLength":)" + std::to_string(stream.size()) +
              R"(},"triangles":)" + std::to_string(triangles) + "}";
      bytes += stream + std::string((4 - stream.size() % 4) % 4, '\0');
    }
    Json root = Json::parse(
        R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_draco_mesh_compression"],"extensionsRequired":
        ["KHR_draco_mesh_compression"],"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[]}],
        "accessors":[{"componentType":5125,"count":120,"type":"SCALAR"}],"bufferViews":[]})");
    root["buffers"] = {{{"byteLength", bytes.size()}}};
    for (const Json& part : Json::parse("[" + json + "]")) {
      const std::size_t position = vertices_too ? 1 : root["accessors"].size();
      if (position == root["accessors"].size())
        root["accessors"].push_back({{"componentType", 5126},
                                     {"count", part["triangles"].get<int>() + 2},
                                     {"type", "VEC3"},
                                     {"min", {0, 0, 0}},
                                     {"max", {9, 1, 0}}});
      const Json draco{{"bufferView", root["bufferViews"].size()}, {"attributes", {{"POSITION", 0}}}};
      root["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", position}}},
                                                 {"indices", 0},
                                                 {"extensions", {{"KHR_draco_mesh_compression", draco}}}});
      root["bufferViews"].push_back(part["view"]);
    }
    test::write_bytes(folder / "case.glb", test::glb(root.dump(), bytes));
    GltfDocument document = test::need(load_gltf(folder / "case.glb"));
    for (int pass = 0; pass < 2; ++pass) {
      const Scene scene = test::need(read_scene(document));
      REQUIRE(scene.primitives.size() == 3);
      for (std::size_t i = 0; i < 3; ++i)
        CHECK(scene.primitives[i].indices.size() == std::size_t{3} * (40 - 16 * i));
      test::need(save_gltf(document, folder / "saved.glb"));
      document = test::need(load_gltf(folder / "saved.glb"));
    }
    const std::string saved = *read_file(folder / "saved.glb");
    CHECK(saved.find("KHR_draco_mesh_compression") != std::string::npos);
    CHECK(saved.find(strip(24, true)) != std::string::npos);
  }
}
