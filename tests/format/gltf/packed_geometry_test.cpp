// Compressed geometry comes out of a document as it came in.
#include <doctest/doctest.h>

#include <filesystem>
#include <set>

#include "format/base/vec.h"
#include "format/gltf/access.h"
#include "format/gltf/document.h"
#include "format/gltf/edit.h"
#include "format/gltf/names.h"
#include "tests/format/encoded_cloths.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/format/raw_glb.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;
using test::RawGlb;
namespace fs = std::filesystem;

namespace {

constexpr const char* encodings[] = {"draco_edgebreaker", "draco_sequential", "meshopt_high",
                                     "meshopt_medium",    "quantized",        "plain"};

std::set<std::string> names_in(const Json& root, const char* list) {
  std::set<std::string> names;
  for (const Json& name : array_member(root, list)) names.insert(string_of(name));
  return names;
}

std::vector<Bytes> elements_of(const GltfDocument& document) {
  std::vector<Bytes> elements;
  for (std::size_t i = 0; i < array_member(document.json, "accessors").size(); ++i)
    elements.push_back(GltfReader(document).elements(static_cast<int>(i), ""));
  return elements;
}

const Json& entry(const Json& array, const Json& number) {
  static const Json none;
  return number.is_null() ? none : array[number.get<std::size_t>()];
}

/// Gives the first primitive positions and corners of its own, as an edit would.
void add_triangle(GltfDocument& document) {
  Json& attributes = document.json["meshes"][0]["primitives"][0]["attributes"];
  attributes = Json{
      {"POSITION", append_float_accessor(document, std::vector<float>{0, 0, 0, 1, 0, 0, 0, 2, 0}, 3, true)}};
  document.json["meshes"][0]["primitives"][0]["indices"] =
      append_index_accessor(document, std::vector<std::uint32_t>{0, 1, 2});
}

}  // namespace

TEST_CASE("packed geometry: streams that nothing has changed pass through byte by byte") {
  const Folder folder;
  for (const std::string& prefix : test::encoded_cloths()) {
    for (const std::string encoding : encodings) {
      const std::string input = prefix + encoding + ".glb";
      CAPTURE(input);
      const GltfDocument document = test::need(load_gltf(input));
      CHECK(document.json.dump().find("_compression") == std::string::npos);
      const RawGlb before(input);
      for (const std::string form : {"glb", "gltf"}) {
        const std::string output = folder / ("out." + form);
        REQUIRE(save_gltf(document, output));
        const GltfDocument again = test::need(load_gltf(output));
        CHECK(elements_of(again) == elements_of(document));
        for (std::size_t i = 0; i < again.json["accessors"].size(); ++i)
          CHECK(Json::diff(again.json["accessors"][i], document.json["accessors"][i]).empty());
        REQUIRE(save_gltf(again, folder / "again.glb"));
        const RawGlb after(folder / "again.glb");
        CHECK(after.streams() == before.streams());
        CHECK(after.streams().empty() == (encoding == "quantized" || encoding == "plain"));
        for (const char* list : {"extensionsUsed", "extensionsRequired"})
          CHECK(names_in(after.json, list) == names_in(before.json, list));
        CHECK(Json::diff(after.json["meshes"], before.json["meshes"]).empty());
        CHECK(static_cast<double>(fs::file_size(folder / "again.glb")) <=
              1.1 * static_cast<double>(fs::file_size(input)));
      }
    }
  }
}

TEST_CASE("packed geometry: what an edit adds is compressed where readers must know the encoding") {
  const Folder folder;
  const std::string prefix = test::encoded_cloths()[0];
  for (const std::string encoding : encodings) {
    for (const bool required : {true, false}) {
      CAPTURE(encoding);
      CAPTURE(required);
      RawGlb input(prefix + encoding + ".glb");
      if (!required) input.json.erase("extensionsRequired");
      test::write_bytes(folder / "in.glb", test::glb(input.json.dump(), input.binary));
      GltfDocument document = test::need(load_gltf(folder / "in.glb"));
      add_triangle(document);
      REQUIRE(save_gltf(document, folder / "out.glb"));
      const RawGlb raw(folder / "out.glb");
      const Json& primitive = raw.json["meshes"][0]["primitives"][0];
      const Json& position = raw.json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
      const Json& view = entry(raw.json["bufferViews"], member(position, "bufferView"));
      const bool draco = member(primitive, "extensions").contains(names::gltf::draco);
      const bool meshopt = member(view, "extensions").contains(names::gltf::meshopt);
      CHECK(draco == (required && encoding.starts_with("draco")));
      CHECK(meshopt == (required && encoding.starts_with("meshopt")));
      CHECK(view.is_null() == draco);
      CHECK(raw.json.contains("extensionsRequired") == (required && encoding != "plain"));

      const GltfDocument again = test::need(load_gltf(folder / "out.glb"));
      const Json& read = again.json["meshes"][0]["primitives"][0];
      GltfReader reader(again);
      const auto corners = reader.attribute<V3d>(read["attributes"], "POSITION", 3, "");
      const std::vector<std::uint32_t> indices = reader.indices(index_of(read["indices"]), "");
      REQUIRE(indices.size() == 3);
      const V3d edge = corners[indices[1]] - corners[indices[0]];
      const V3d normal = edge.cross(corners[indices[2]] - corners[indices[0]]);
      CHECK(normal.z == doctest::Approx(2).epsilon(1e-3));
    }
  }
}
