#include "converter/stitch/find_cell.h"

#include <doctest/doctest.h>

#include <filesystem>

#include "converter/stitch/library.h"
#include "converter/stitch/pattern_json.h"
#include "format/base/atomic_file.h"
#include "tests/converter/load_cell.h"

using namespace selvedge;

TEST_CASE("a name, a stitch description and a mesh file all give a cell") {
  const auto folder = std::filesystem::temp_directory_path();
  const std::string json = (folder / "selvedge_cell.json").string();
  const std::string ply = (folder / "selvedge_cell.ply").string();
  const MeshOptions options{16};
  const auto built_in = load_cell("plain-weave", options);
  REQUIRE(built_in);
  REQUIRE(write_file(json, to_json(plain_weave())));
  REQUIRE(write_mesh(ply, *built_in));
  const auto described = load_cell(json, options);
  const auto imported = load_cell(ply, options, {.period = V2d(2, 2)});
  std::filesystem::remove(json);
  std::filesystem::remove(ply);
  REQUIRE(described);
  CHECK(described->positions == built_in->positions);
  REQUIRE(imported);
  CHECK(imported->positions == built_in->positions);
  CHECK(imported->period == built_in->period);
}

TEST_CASE("each kind of name gives its own refusal") {
  CHECK(load_cell("cable").error().code == Code::stitch_unknown);
  CHECK(load_cell("no_such.json").error().code == Code::stitch_unknown);
  CHECK(load_cell("no_such.ply").error().code == Code::file_missing);
}
