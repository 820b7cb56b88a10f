#include "format/check/fabric.h"
#include "format/base/json_text.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "tests/format/fabric_files.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"

using namespace selvedge;
using nlohmann::json;
using test::Folder;
using test::OpenedFabric;

namespace {

/// All layers on all three levels, one lobe, four views, free of issues.
Fabric good_fabric() {
  Fabric fabric = test::random_fabric(4, 3, {2, 2}, 1, 7);
  // Random lobes reflect more than they receive; a tenth of them does not.
  for (FabricLevel& level : fabric.levels) {
    for (std::size_t i = 0; i < level.lobes().size(); i += 5) {
      float* p = &level.lobes()[i];
      *p *= 0.1F;
      for (int k = 1; k <= 3; ++k) p[k] *= 0.5F;
    }
  }
  return fabric;
}

using Lines = std::vector<std::string>;

/// "CODE place" each.
Lines lines_of(const Issues& issues) {
  Lines lines;
  for (const Error& issue : issues) lines.push_back(std::string(name_of(issue.code)) + " " + issue.place);
  return lines;
}

std::string joined(const Lines& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

/// What check says of a good fabric after one change.
class Changed {
 public:
  Changed() {
    const auto written = write_fabric(folder / "good.exr", good_fabric());
    REQUIRE_MESSAGE(written, to_line(written.error()));
    file = test::open_fabric(folder / "good.exr");
  }
  Issues issues() {
    test::save_fabric(folder / "changed.exr", file);
    return check_fabric(folder / "changed.exr");
  }
  bool is_read() const { return read_fabric(folder / "changed.exr").has_value(); }

  Folder folder;
  OpenedFabric file;
};

using Change = std::function<void(OpenedFabric&)>;

/// The change gives exactly these issues, "CODE place" each; the reader refuses the file with the first error
/// of them if `refused`.
void expect(const Change& change, const Lines& expected, bool refused) {
  Changed changed;
  change(changed.file);
  const Issues issues = changed.issues();
  CHECK(joined(lines_of(issues)) == joined(expected));
  const auto read = read_fabric(changed.folder / "changed.exr");
  CHECK(read.has_value() == !refused);
  if (read || !refused) return;
  const auto first = std::find_if(issues.begin(), issues.end(), [](const Error& issue) {
    return severity_of(issue.code) == Severity::error;
  });
  REQUIRE(first != issues.end());
  CHECK(to_line(read.error()) == to_line(*first));
}

void refused(const Change& change, const Lines& expected) { expect(change, expected, true); }
void accepted(const Change& change, const Lines& expected) { expect(change, expected, false); }

}  // namespace

TEST_CASE("a good fabric has no issues") {
  accepted([](OpenedFabric&) {}, {});
}

TEST_CASE("members of the wrong type or out of range are named by their pointers") {
  using Row = std::pair<const char*, json>;
  for (const auto& [pointer, value] : {Row{"/version", 1},
                                       Row{"/version/0", "1"},
                                       Row{"/version/1", 0.5},
                                       Row{"/version/1", -1},
                                       Row{"/version/1", 2147483648},
                                       Row{"/layers/opacity/optional", 1},
                                       Row{"/layers/lobes/optional", "true"},
                                       Row{"/texels/0", 0},
                                       Row{"/texels/1", 4097},
                                       Row{"/texels", {4, 3, 1}},
                                       Row{"/levels", 0},
                                       Row{"/levels", 4},
                                       Row{"/levels", 2.5},
                                       Row{"/mmPerRepeat/0", 0},
                                       Row{"/mmPerRepeat/1", -1},
                                       Row{"/mmPerRepeat/0", "5"},
                                       Row{"/mmPerRepeat/0", 1e39},
                                       Row{"/mmPerRepeat/0", 1e-50},
                                       Row{"/referenceHeight", nullptr},
                                       Row{"/thickness", -0.5},
                                       Row{"/views", {2, 2}},
                                       Row{"/views/layout", 7},
                                       Row{"/views/columns", 0},
                                       Row{"/views/rows", 4097},
                                       Row{"/layers", json::array()},
                                       Row{"/layers/table", 3},
                                       Row{"/layers/lobes/lobes", 17},
                                       Row{"/layers/lobes/lobes", -1},
                                       Row{"/layers/frame/levels", "0"},
                                       Row{"/layers/frame/levels", json::array()},
                                       Row{"/layers/frame/levels/0", 3},
                                       Row{"/layers/frame/levels/0", "0"},
                                       Row{"/layers/frame/levels/1", 0},
                                       Row{"/layers/frame/levels/2", 1},
                                       Row{"/digests", 1},
                                       Row{"/digests/table", "x"},
                                       Row{"/digests/table", {"x"}},
                                       Row{"/digests/table/1", 5},
                                       Row{"/whole", 1},
                                       Row{"/whole", {{"level", 1}, {"texels", {10, 6}}}},
                                       Row{"/provenance", "me"}}) {
    CAPTURE(pointer);
    CAPTURE(value.dump());
    Changed changed;
    changed.file.text[json::json_pointer(pointer)] = value;
    const Issues issues = changed.issues();
    // A broken layer or layout draws nothing else with it.
    REQUIRE(has_error(issues));
    CHECK(lines_of(issues).front() == std::string("FABRIC_MEMBER ") + pointer);
    CHECK(std::count_if(issues.begin(), issues.end(),
                        [](const Error& issue) { return severity_of(issue.code) == Severity::error; }) == 1);
    CHECK_FALSE(changed.is_read());
  }
}

TEST_CASE("members that are missing are named") {
  for (const char* pointer :
       {"/version", "/texels", "/levels", "/mmPerRepeat", "/referenceHeight", "/thickness", "/views",
        "/views/layout", "/views/rows", "/layers", "/layers/lobes/lobes", "/layers/table/levels", "/digests",
        "/digests/opacity", "/provenance"}) {
    CAPTURE(pointer);
    Changed changed;
    const json::json_pointer at(pointer);
    changed.file.text[at.parent_pointer()].erase(at.back());
    const Issues issues = changed.issues();
    REQUIRE(has_error(issues));
    CHECK(lines_of(issues).front() == std::string("FABRIC_MEMBER ") + pointer);
    CHECK_FALSE(changed.is_read());
  }
}

TEST_CASE("everything that is wrong is reported, not the first of it") {
  refused(
      [](OpenedFabric& file) {
        file.text["thickness"] = -1;
        file.text["mmPerRepeat"][1] = 0;
        file.text["layers"]["lobes"].erase("lobes");
        file.text["digests"]["table"][2] = "0123456789abcdef0123456789abcdef";
        file.plane("opacity", 1, "opacity.0002")[1] = 2;
        file.digest("opacity");
        file.drop("frame");
      },
      {"FABRIC_MEMBER /mmPerRepeat/1", "FABRIC_MEMBER /thickness", "FABRIC_MEMBER /layers/lobes/lobes",
       "FABRIC_PART frame", "FABRIC_ADVICE selvedge.mmPerRepeat", "FABRIC_ADVICE lobes",
       "FABRIC_NOT_FINITE opacity/level 1/opacity.0002/1,0", "FABRIC_DIGEST table/level 2"});
}

TEST_CASE("a text that is no JSON object, of another version, or nested without end is refused") {
  Changed changed;
  for (const auto& [text, code] :
       {std::pair{std::string("hello"), Code::fabric_malformed},
        {"[1]", Code::fabric_malformed},
        {"\xEF\xBB\xBF{\"version\":[1,0]}", Code::fabric_malformed},
        {std::string(100000, '[') + std::string(100000, ']'), Code::fabric_malformed},
        {R"({"version":[2,0]})", Code::fabric_version},
        {R"({"version":[4294967297,0]})", Code::fabric_version},
        {R"({"version":[0,1]})", Code::fabric_version}}) {
    CAPTURE(text.substr(0, 40));
    test::save_fabric(changed.folder / "changed.exr", changed.file, text);
    const Issues issues = check_fabric(changed.folder / "changed.exr");
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].code == code);
    CHECK(read_fabric(changed.folder / "changed.exr").error().code == code);
  }
  changed.file.parts[0].attributes.erase("selvedge.fabric");
  OpenedFabric other = changed.file;
  other.parts[0].attributes["selvedge.samples"] = std::string("{}");
  auto writer = ExrWriter::create(changed.folder / "other.exr", {other.parts[0]});
  REQUIRE(writer);
  REQUIRE(writer->write_level(0, 0, other.pixels[0][0]));
  REQUIRE(writer->commit());
  CHECK(lines_of(check_fabric(changed.folder / "other.exr")) == Lines{"FABRIC_MALFORMED selvedge.fabric"});
}

TEST_CASE("a newer minor version is read, with what it adds ignored") {
  accepted(
      [](OpenedFabric& file) {
        file.text["version"][1] = 7;
        file.text["colourSpace"] = "none";
        file.text["views"]["a/b"] = 1;
        file.text["layers"]["table"]["basis"] = 3;
      },
      {"FABRIC_ADVICE /version/1", "FABRIC_ADVICE /colourSpace", "FABRIC_ADVICE /views/a~1b",
       "FABRIC_ADVICE /layers/table/basis"});
}

TEST_CASE("a layer that is not known makes a fabric unsupported unless it is optional") {
  const auto with = [](const json& layer) {
    return [layer](OpenedFabric& file) { file.text["layers"]["sparkle"] = layer; };
  };
  refused(with({{"levels", {0}}}), {"FABRIC_UNSUPPORTED /layers/sparkle"});
  refused(with({{"levels", {0}}, {"optional", false}}), {"FABRIC_UNSUPPORTED /layers/sparkle"});
  refused(with({{"levels", {0}}, {"optional", 1}}), {"FABRIC_UNSUPPORTED /layers/sparkle"});
  refused(with(true), {"FABRIC_UNSUPPORTED /layers/sparkle"});
  accepted(with({{"levels", {0}}, {"optional", true}}), {"FABRIC_ADVICE /layers/sparkle"});
  refused([](OpenedFabric& file) { file.text["views"]["layout"] = "octahedral"; },
          {"FABRIC_UNSUPPORTED /views/layout"});
}

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
  const std::string bytes = test::bytes_of(changed.folder / "good.exr");
  std::size_t at = 0;
  for (const char* part : {"preview", "lobes", "frame", "table", "opacity"}) {
    CAPTURE(part);
    // In the headers: name, type, size, one byte. Of the preview DWAA would change the number of chunks.
    at = bytes.find(std::string("compression\0compression\0", 24), at) + 28;
    const bool preview = std::string(part) == "preview";
    std::string lossy = bytes;
    REQUIRE(lossy[at] == 3);
    lossy[at] = preview ? 5 : 8;
    test::write_bytes(changed.folder / "changed.exr", lossy);
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

TEST_CASE("levels that are missing are warnings") {
  accepted(
      [](OpenedFabric& file) {
        file.text["whole"] = {{"level", 2}, {"texels", {17, 12}}};
      },
      {"FABRIC_LEVELS /whole"});
  accepted(
      [](OpenedFabric& file) {
        file.text["levels"] = 2;
        for (const char* name : {"lobes", "frame", "table", "opacity"}) {
          file.text["layers"][name]["levels"] = {0, 1};
          file.digest(name);
          for (auto& plane : file.pixels[file.index_of(name)][2].planes) plane.assign(plane.size(), 0.0F);
        }
      },
      {"FABRIC_LEVELS /levels"});
  accepted(
      [](OpenedFabric& file) {
        file.text["layers"]["opacity"]["levels"] = {0, 2};
        file.digest("opacity");
      },
      {"FABRIC_LEVELS /layers/opacity/levels", "FABRIC_ADVICE opacity/level 1"});
}

TEST_CASE("a changed pixel of a listed level is found by its digest, in any level") {
  for (const char* level : {"0", "1", "2"}) {
    refused([&](OpenedFabric& file) { file.plane("table", std::stoi(level), "table.0003.red")[0] += 0.25F; },
            {std::string("FABRIC_DIGEST table/level ") + level});
  }
}

TEST_CASE("a part of the text that was exchanged is found by the header digest") {
  Changed changed;
  std::string bytes = test::bytes_of(changed.folder / "good.exr");
  const std::size_t at = bytes.find("\"thickness\":2.5");
  REQUIRE(at != std::string::npos);
  bytes[at + 12] = '3';
  test::write_bytes(changed.folder / "changed.exr", bytes);
  CHECK(lines_of(check_fabric(changed.folder / "changed.exr")) == Lines{"FABRIC_DIGEST selvedge.digest"});
  CHECK_FALSE(changed.is_read());
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
  test::save_fabric(changed.folder / "whole.exr", changed.file);
  CHECK_FALSE(has_error(check_fabric(changed.folder / "whole.exr")));
  const std::string bytes = test::bytes_of(changed.folder / "whole.exr");
  // Nothing of these is read by the reader; the last chunks of the file are those of the unknown part.
  test::write_bytes(changed.folder / "changed.exr", bytes.substr(0, bytes.size() - 1));
  const Issues cut = check_fabric(changed.folder / "changed.exr");
  REQUIRE(has_error(cut));
  CHECK(cut.back().code == Code::file_damaged);
  CHECK(cut.back().place.starts_with("dust/level 2"));
}

TEST_CASE("a file that is broken without end has a list of issues that ends") {
  Changed changed;
  for (std::size_t i = 0; i < 300; ++i) changed.file.text["unknown" + std::to_string(i)] = 1;
  for (int i = 0; i < 300; ++i) changed.file.add_channel("opacity", {"opacity." + std::to_string(i) + ".A"});
  changed.file.digest("opacity");
  const Issues issues = changed.issues();
  CHECK(issues.size() <= 202);
  CHECK(has_error(issues));
  CHECK(issues.back().message.find("more warnings are not listed") != std::string::npos);
  CHECK(issues[issues.size() - 2].message.find("more errors are not listed") != std::string::npos);
}

TEST_CASE("what is no EXR file has the one issue of its kind") {
  const Folder folder;
  CHECK(lines_of(check_fabric(folder / "none.exr")) == Lines{"FILE_MISSING "});
  test::write_bytes(folder / "text.exr", "hello");
  const Issues issues = check_fabric(folder / "text.exr");
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].code == Code::exr_malformed);
}

TEST_CASE("a member that stands twice makes a text no JSON") {
  CHECK(parse_json(R"({"a":{"c":1},"b":[{"c":1},{"c":2}],"c":3})").is_object());
  CHECK(parse_json(R"({"levels":4,"levels":4})").is_discarded());
  CHECK(parse_json(R"({"views":{"rows":1,"columns":2,"rows":3}})").is_discarded());
}
