// Rules of a fabric file's text, and of the file as a whole.
#include "format/check/fabric.h"

#include <doctest/doctest.h>

#include <algorithm>

#include "format/base/json_text.h"
#include "tests/format/check/changed_fabric.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;
using nlohmann::json;

TEST_CASE("a good fabric has no issues") {
  accepted([](OpenedFabric&) {}, {});
}

TEST_CASE("members of the wrong type or out of range are named by their pointers") {
  for (const auto& one : std::initializer_list<std::pair<const char*, const char*>>{
           {"/version", "1"},
           {"/version/0", R"("1")"},
           {"/version/1", "0.5"},
           {"/version/1", "-1"},
           {"/version/1", "2147483648"},
           {"/layers/opacity/optional", "1"},
           {"/layers/lobes/optional", R"("true")"},
           {"/texels/0", "0"},
           {"/texels/1", "4097"},
           {"/texels", "[4,3,1]"},
           {"/levels", "0"},
           {"/levels", "4"},
           {"/levels", "2.5"},
           {"/mmPerRepeat/0", "0"},
           {"/mmPerRepeat/1", "-1"},
           {"/mmPerRepeat/0", R"("5")"},
           {"/mmPerRepeat/0", "1e39"},
           {"/mmPerRepeat/0", "1e-50"},
           {"/referenceHeight", "null"},
           {"/thickness", "-0.5"},
           {"/views", "[2,2]"},
           {"/views/layout", "7"},
           {"/views/columns", "0"},
           {"/views/rows", "4097"},
           {"/layers", "[]"},
           {"/layers/table", "3"},
           {"/layers/lobes/lobes", "17"},
           {"/layers/lobes/lobes", "-1"},
           {"/layers/frame/levels", R"("0")"},
           {"/layers/frame/levels", "[]"},
           {"/layers/frame/levels/0", "3"},
           {"/layers/frame/levels/0", R"("0")"},
           {"/layers/frame/levels/1", "0"},
           {"/layers/frame/levels/2", "1"},
           {"/digests", "1"},
           {"/digests/table", R"("x")"},
           {"/digests/table", R"(["x"])"},
           {"/digests/table/1", "5"},
           {"/whole", "1"},
           {"/whole", R"({"level":1,"texels":[10,6]})"},
           {"/provenance", R"("me")"}}) {
    const auto& pointer = one.first;
    const auto& value = one.second;
    CAPTURE(pointer);
    CAPTURE(value);
    Changed changed;
    changed.file.text[json::json_pointer(pointer)] = json::parse(value);
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
  for (const auto& one : {std::pair{std::string("hello"), Code::fabric_malformed},
                          {"[1]", Code::fabric_malformed},
                          {"\xEF\xBB\xBF{\"version\":[1,0]}", Code::fabric_malformed},
                          {std::string(100000, '[') + std::string(100000, ']'), Code::fabric_malformed},
                          {R"({"version":[1,0]})", Code::fabric_version},
                          {R"({"version":[4294967297,0]})", Code::fabric_version},
                          {R"({"version":[0,1]})", Code::fabric_version}}) {
    const auto& text = one.first;
    const Code code = one.second;
    CAPTURE(text.substr(0, 40));
    save_fabric(changed.folder / "changed.exr", changed.file, text);
    const Issues issues = check_fabric(changed.folder / "changed.exr");
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].code == code);
    CHECK(read_fabric(changed.folder / "changed.exr").error().code == code);
  }
  changed.file.parts[0].attributes.erase("selvedge.fabric");
  OpenedFabric other = changed.file;
  other.parts[0].attributes["selvedge.samples"] = std::string("{}");
  auto writer = test::need(ExrWriter::create(changed.folder / "other.exr", {other.parts[0]}));
  REQUIRE(writer.write_level(0, 0, other.pixels[0][0]));
  REQUIRE(writer.commit());
  CHECK(lines_of(check_fabric(changed.folder / "other.exr")) == Lines{"FABRIC_MALFORMED selvedge.fabric"});
}

TEST_CASE("a fabric of another version is refused, with both versions") {
  Changed changed;
  save_fabric(changed.folder / "changed.exr", changed.file, R"({"version":[1,0]})");
  CHECK(read_fabric(changed.folder / "changed.exr").error().message ==
        "version [1,0] is not understood; this program reads version 3");
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

TEST_CASE("a part of the text that was exchanged is found by the header digest") {
  Changed changed;
  std::string bytes = bytes_of(changed.folder / "good.exr");
  const std::size_t at = bytes.find("\"thickness\":2.5");
  REQUIRE(at != std::string::npos);
  bytes[at + 12] = '3';
  write_bytes(changed.folder / "changed.exr", bytes);
  CHECK(lines_of(check_fabric(changed.folder / "changed.exr")) == Lines{"FABRIC_DIGEST selvedge.digest"});
  CHECK_FALSE(changed.is_read());
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
  write_bytes(folder / "text.exr", "hello");
  const Issues issues = check_fabric(folder / "text.exr");
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].code == Code::exr_malformed);
}

TEST_CASE("a member that stands twice makes a text no JSON") {
  CHECK(parse_json(R"({"a":{"c":1},"b":[{"c":1},{"c":2}],"c":3})").is_object());
  CHECK(parse_json(R"({"levels":4,"levels":4})").is_discarded());
  CHECK(parse_json(R"({"views":{"rows":1,"columns":2,"rows":3}})").is_discarded());
}
