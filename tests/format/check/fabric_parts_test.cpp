// Rules of a fabric file's parts, channels and values.
#include <doctest/doctest.h>

#include <limits>

#include "format/check/fabric.h"
#include "tests/format/check/changed_fabric.h"

using namespace selvedge;
using namespace selvedge::test;

TEST_CASE("data parts are laid out as the rules say") {
  refused([](OpenedFabric& file) { file.drop("table"); }, {"FABRIC_PART table"});
  refused([](OpenedFabric& file) { file.part("table").increasing_y = false; }, {"FABRIC_PART table"});
  refused(
      [](OpenedFabric& file) {
        file.part("opacity").mipmapped = false;
        file.pixels[file.index_of("opacity")].resize(1);
      },
      {"FABRIC_PART opacity"});
  refused(
      [](OpenedFabric& file) {
        file.part("opacity").tiled = false;
        file.part("opacity").mipmapped = false;
        file.pixels[file.index_of("opacity")].resize(1);
      },
      {"FABRIC_PART opacity"});
  // Every part smaller than the text says: the preview is, and so is every layer.
  refused(
      [](OpenedFabric& file) {
        file.text["texels"] = {8, 6};
      },
      {"FABRIC_PART lobes", "FABRIC_PART frame", "FABRIC_PART table", "FABRIC_PART opacity",
       "FABRIC_PART preview", "FABRIC_LEVELS /levels"});
}

TEST_CASE("a part whose window is not that of the others is refused") {
  Changed changed;
  OpenedFabric& file = changed.file;
  const std::size_t p = file.index_of("opacity");
  file.parts[p].width = 5;
  for (std::size_t k = 0; k < file.pixels[p].size(); ++k) {
    ExrPixels& level = file.pixels[p][k];
    level.width = level_size(5, static_cast<int>(k));
    for (auto& plane : level.planes) plane.assign(level.width * level.height, 0.0F);
  }
  file.digest("opacity");
  CHECK(lines_of(changed.issues()) == Lines{"FABRIC_PART opacity", "FABRIC_PART opacity"});
  CHECK_FALSE(changed.is_read());
}

TEST_CASE("a lossy data part is refused by that name, a lossy preview is not") {
  Changed changed;
  const std::string bytes = bytes_of(changed.folder / "good.exr");
  std::size_t at = 0;
  for (const char* part : {"preview", "lobes", "frame", "table", "opacity"}) {
    CAPTURE(part);
    // In the headers: name, type, size, one byte. Of the preview DWAA would change the number of chunks.
    at = bytes.find(std::string("compression\0compression\0", 24), at) + 28;
    const bool preview = std::string(part) == "preview";
    std::string lossy = bytes;
    REQUIRE(lossy[at] == 3);
    lossy[at] = preview ? 5 : 8;
    write_bytes(changed.folder / "changed.exr", lossy);
    const Issues issues = check_fabric(changed.folder / "changed.exr");
    CHECK(joined(lines_of(issues)) ==
          joined({(preview ? "FABRIC_ADVICE " : "FABRIC_LOSSY ") + std::string(part)}));
    CHECK(changed.is_read() == preview);
  }
}

TEST_CASE("channels that are missing, doubled or end like colours are errors") {
  refused([](OpenedFabric& file) { file.drop_channel("table", 1); },
          {"FABRIC_CHANNEL table/table.0000.green"});
  accepted([](OpenedFabric& file) { file.text["layers"]["lobes"]["lobes"] = 0; },
           {"FABRIC_ADVICE lobes/lobes.0.cx.blue", "FABRIC_ADVICE lobes/lobes.0.cx.green",
            "FABRIC_ADVICE lobes/lobes.0.cx.red", "FABRIC_ADVICE lobes/lobes.0.cy.blue",
            "FABRIC_ADVICE lobes/lobes.0.cy.green", "FABRIC_ADVICE lobes/lobes.0.cy.red",
            "FABRIC_ADVICE lobes/lobes.0.cz.blue", "FABRIC_ADVICE lobes/lobes.0.cz.green",
            "FABRIC_ADVICE lobes/lobes.0.cz.red", "FABRIC_ADVICE lobes/lobes.0.n.blue",
            "FABRIC_ADVICE lobes/lobes.0.n.green", "FABRIC_ADVICE lobes/lobes.0.n.red"});
}

TEST_CASE("what only other programs stumble over is reported and read all the same") {
  accepted([](OpenedFabric& file) { file.copy_part("opacity", "dust"); }, {"FABRIC_ADVICE dust"});
  accepted(
      [](OpenedFabric& file) {
        file.copy_part("opacity", "dust");
        file.part("dust").channels[0].name = "dust.Y";
        file.part("dust").channels[1].name = "table.0000.red";
      },
      {"FABRIC_CHANNEL dust/dust.Y", "FABRIC_CHANNEL dust/table.0000.red", "FABRIC_ADVICE dust"});
  accepted(
      [](OpenedFabric& file) {
        file.add_channel("opacity", {"opacity.extra"});
        file.digest("opacity");
      },
      {"FABRIC_ADVICE opacity/opacity.extra"});
  accepted(
      [](OpenedFabric& file) {
        file.part("opacity").channels[0].half = false;
        file.digest("opacity");
      },
      {"FABRIC_ADVICE /layers/opacity/precision"});
  accepted([](OpenedFabric& file) { file.text["layers"]["opacity"]["precision"] = "double"; },
           {"FABRIC_ADVICE /layers/opacity/precision"});
  accepted([](OpenedFabric& file) { file.part("frame").attributes.erase("wrapmodes"); },
           {"FABRIC_ADVICE frame/wrapmodes"});
  accepted([](OpenedFabric& file) { file.parts[0].attributes["selvedge.version"] = std::string("1.1"); },
           {"FABRIC_ADVICE selvedge.version"});
  accepted([](OpenedFabric& file) { file.parts[0].attributes.erase("selvedge.referenceHeight"); },
           {"FABRIC_ADVICE selvedge.referenceHeight"});
  accepted([](OpenedFabric& file) { file.text.erase("model"); },
           {"FABRIC_ADVICE /model", "FABRIC_ADVICE selvedge.model"});
  accepted([](OpenedFabric& file) { file.text["digests"]["dust"] = {"x"}; }, {"FABRIC_ADVICE /digests/dust"});
}

TEST_CASE("a part that is not known may be of scanlines or of one level, but not of another size") {
  accepted(
      [](OpenedFabric& file) {
        file.copy_part("opacity", "dust");
        file.part("dust").tiled = false;
        file.part("dust").mipmapped = false;
        file.pixels.back().resize(1);
      },
      {"FABRIC_ADVICE dust"});
  accepted(
      [](OpenedFabric& file) {
        file.copy_part("opacity", "dust");
        file.part("dust").width = 8;
        file.part("dust").mipmapped = false;
        file.pixels.back().resize(1);
        file.pixels.back()[0].width = 8;
        for (auto& plane : file.pixels.back()[0].planes) plane.resize(24);
      },
      {"FABRIC_PART dust", "FABRIC_PART dust", "FABRIC_ADVICE dust"});
}

TEST_CASE("a fabric without its preview breaks a rule, but is read") {
  Changed changed;
  changed.file.parts[1].attributes.insert(changed.file.parts[0].attributes.begin(),
                                          changed.file.parts[0].attributes.end());
  changed.file.drop("preview");
  CHECK(joined(lines_of(changed.issues())) == "FABRIC_PART preview\n");
  CHECK(changed.is_read());
}

TEST_CASE("the order of the parts is free, but a preview that is not the first is remarked on") {
  Changed changed;
  OpenedFabric& file = changed.file;
  file.parts[1].attributes.insert(file.parts[0].attributes.begin(), file.parts[0].attributes.end());
  std::swap(file.parts[0], file.parts[1]);
  std::swap(file.pixels[0], file.pixels[1]);
  CHECK(lines_of(changed.issues()) == Lines{"FABRIC_ADVICE lobes"});
  CHECK(changed.is_read());
}

TEST_CASE("a changed pixel of a listed level is found by its digest, in any level") {
  for (const char* level : {"0", "1", "2"}) {
    refused([&](OpenedFabric& file) { file.plane("table", std::stoi(level), "table.0003.red")[0] += 0.25F; },
            {std::string("FABRIC_DIGEST table/level ") + level});
  }
}

TEST_CASE("values out of their ranges are named, eight of a layer and then their number") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  refused(
      [&](OpenedFabric& file) {
        file.plane("lobes", 0, "lobes.0.n.blue")[5] = -1;
        file.plane("lobes", 0, "lobes.diffuse.red")[0] = nan;
        file.plane("lobes", 1, "lobes.0.cy.red")[0] = infinity;
        file.digest("lobes");
        file.plane("frame", 2, "frame.nz")[0] = 0.5F;
        file.digest("frame");
        file.plane("opacity", 0, "opacity.0003")[11] = -0.5F;
        file.digest("opacity");
      },
      {"FABRIC_NOT_FINITE lobes/level 0/lobes.diffuse.red/0,0",
       "FABRIC_NOT_FINITE lobes/level 0/lobes.0.n.blue/1,1",
       "FABRIC_NOT_FINITE opacity/level 0/opacity.0003/3,2",
       "FABRIC_NOT_FINITE lobes/level 1/lobes.0.cy.red/0,0", "FABRIC_NOT_FINITE frame/level 2/frame/0,0"});
  Changed changed;
  for (float& value : changed.file.plane("table", 0, "table.0001.green")) value = -1;
  changed.file.digest("table");
  const Issues issues = changed.issues();
  REQUIRE(issues.size() == 9);
  CHECK(issues[7].place == "table/level 0/table.0001.green/3,1");
  CHECK(issues[8].place == "table/level 0");
  CHECK(issues[8].message == "4 more values break the rules");
}

TEST_CASE("every chunk is decoded: of the preview, of unlisted levels, of unknown parts") {
  Changed changed;
  changed.file.copy_part("opacity", "dust");
  changed.file.text["layers"]["dust"] = {{"optional", true}};
  changed.file.text["layers"]["frame"]["levels"] = {0, 1};
  changed.file.digest("frame");
  save_fabric(changed.folder / "whole.exr", changed.file);
  CHECK_FALSE(has_error(check_fabric(changed.folder / "whole.exr")));
  const std::string bytes = bytes_of(changed.folder / "whole.exr");
  // Nothing of these is read by the reader; the last chunks of the file are those of the unknown part.
  write_bytes(changed.folder / "changed.exr", bytes.substr(0, bytes.size() - 1));
  const Issues cut = check_fabric(changed.folder / "changed.exr");
  REQUIRE(has_error(cut));
  CHECK(cut.back().code == Code::file_damaged);
  CHECK(cut.back().place.starts_with("dust/level 2"));
}
