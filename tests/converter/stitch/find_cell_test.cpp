#include "converter/stitch/find_cell.h"

#include <doctest/doctest.h>

#include "converter/stitch/library.h"
#include "converter/stitch/pattern_json.h"
#include "format/base/atomic_file.h"
#include "tests/converter/load_cell.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;

TEST_CASE("a name, a stitch description and a mesh file all give a cell") {
  const test::Folder folder;
  const MeshOptions options{16};
  const auto built_in = test::need(load_cell("plain-weave", options));
  REQUIRE(write_file(folder / "cell.json", to_json(plain_weave())));
  REQUIRE(write_mesh(folder / "cell.ply", built_in));
  CHECK(test::need(load_cell(folder / "cell.json", options)).positions == built_in.positions);
  const auto imported = test::need(load_cell(folder / "cell.ply", options, {.period = V2d(2, 2)}));
  CHECK(imported.positions == built_in.positions);
  CHECK(imported.period == built_in.period);
}

TEST_CASE("a draft is known by its beginning, whatever its name is") {
  const test::Folder folder;
  const std::string draft =
      "[Weaving]\nShafts=2\n[Warp]\nThreads=2\n[Weft]\nThreads=2\n[Threading]\n1=1\n2=2\n[Liftplan]\n1=1\n2="
      "2\n";
  for (const auto& [name, head] : {std::pair("twill.wif.txt", "[WIF]\r\n"),
                                   {"twill.plm", "\n; PixeLoom\n\n[wif]\n"},
                                   {"twill", "[WIF] ; 1.1\n"},
                                   {"twill.WIF", "[CONTENTS]\n[WIF]\n"},
                                   {"twill.json", "\xef\xbb\xbf[WIF]\n"}}) {
    CAPTURE(name);
    REQUIRE(write_file(folder / name, head + draft));
    CellOptions options;
    options.needs_stitch_mesh = false;
    CHECK(test::need(find_cell(folder / name, options)).stitch->pattern.yarns.size() == 4);
    CHECK(files_of_cell(folder / name).size() == (std::string(name) == "twill" ? 0 : 1));
  }
}

TEST_CASE("each kind of name gives its own refusal") {
  CHECK(load_cell("cable").error().code == Code::stitch_unknown);
  CHECK(load_cell("no_such.json").error().code == Code::stitch_unknown);
  CHECK(load_cell("no_such.txt").error().code == Code::stitch_unknown);
  CHECK(load_cell("no_such.ply").error().code == Code::file_missing);
  const test::Folder folder;
  REQUIRE(write_file(folder / "machine.k", ";!knitout-2"));
  CHECK(load_cell(folder / "machine.k").error().message ==
        "files that end in \".k\" are not read: .wif are drafts, .txt charts, .json descriptions, .obj and "
        ".ply "
        "meshes");
}
