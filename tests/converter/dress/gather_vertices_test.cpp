#include "converter/dress/unwrap.h"

#include <doctest/doctest.h>

#include "format/gltf/edit.h"
#include "tests/format/garments.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

TEST_CASE("new vertices take every attribute and morph target along") {
  const Folder folder;
  REQUIRE(write_garment(folder / "square.glb", test::square()));
  GltfDocument document = test::need(load_gltf(folder / "square.glb"));
  Json& primitive = document.json["meshes"][0]["primitives"][0];
  std::vector<float> moves;
  for (int i = 0; i < 12; ++i) moves.push_back(static_cast<float>(i));
  const std::vector<std::uint8_t> ids{0, 1, 2, 3};  // as a SCALAR of bytes, padded to 4 in the file
  const int view = append_attribute_view(document, {4, 1, 5121, false}, ids);
  primitive["attributes"]["_ID"] =
      append(document.json["accessors"],
             {{"bufferView", view}, {"componentType", 5121}, {"count", 4}, {"type", "SCALAR"}});
  const Json target{{"POSITION", append_float_accessor(document, moves, 3, true)}};
  primitive["targets"] = std::vector<Json>(1000, target);
  const std::size_t accessors = document.json["accessors"].size();
  const std::size_t attributes = primitive["attributes"].size();

  GltfReader reader(document);
  gather_vertices(document, reader, primitive, {0, 1, 2, 3, 1, 2}, "/meshes/0/primitives/0");
  // An accessor that a thousand morph targets name is copied once.
  CHECK(document.json["accessors"].size() == accessors + attributes + 1);
  for (const auto& [semantic, accessor] : primitive["attributes"].items()) {
    const std::string named = semantic;  // Clang 14 captures no bindings.
    CAPTURE(named);
    CHECK(document.json["accessors"][accessor.get<std::size_t>()]["count"] == 6);
  }
  const auto moved = reader.numbers(index_of(primitive["targets"][999]["POSITION"]), "");
  CHECK(moved[12] == 3);  // the copy of vertex 1
  CHECK(moved[15] == 6);  // and of vertex 2
  CHECK(reader.numbers(index_of(primitive["attributes"]["_ID"]), "")[4] == 1);
}
