#include "apps/report/trade.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "format/base/atomic_file.h"
#include "format/quality/picture_error.h"
#include "tests/format/files.h"

namespace selvedge {
namespace {

using Json = nlohmann::json;

TEST_CASE("on the front is what nothing else beats in cost and quality") {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const std::vector<V2d> figures{{1, 10}, {2, 20}, {2, 15}, {3, 20}, {4, 30}, {4, 30}, {0.5, none}};
  CHECK(pareto_front(figures) == std::vector<bool>{true, true, false, false, true, true, false});
}

TEST_CASE("picture errors are those of what a display shows") {
  // Radiance 1 / pi is white, 0 black; where the pictures differ it is by 1 in one of two pixels.
  const float white = 1 / 3.14159265F;
  const Frame a{2, 1, {V4f(white, white, white, 1), V4f(0, 0, 0, 1)}};
  const Frame b{2, 1, {V4f(white, white, white, 1), V4f(9, 9, 9, 1)}};
  const auto error = picture_error(a, b);
  REQUIRE(error);
  CHECK(error->mean_square == doctest::Approx(0.5).epsilon(1e-5));
  CHECK(psnr_of(0.01) == doctest::Approx(20));
  CHECK(psnr_of(0) == 200);
  CHECK_FALSE(picture_error(a, Frame{1, 2, a.pixels}));
}

/// A record such as the sweeps write.
Json record(const std::string& name, double bytes, double psnr) {
  return {{"name", name},
          {"knobs", {{"texels", 8}, {"layers", "a, \"b\""}}},
          {"command", "selvedge make <stitch>"},
          {"bytes", bytes},
          {"seconds", {{"bake", 1}, {"fit", 2}, {"make", 3}}},
          {"processorSeconds", 4},
          {"loadMs", 1},
          {"heldOut", {{{"texels", {8, 8}}, {"psnr", 20}, {"relativeL2", 0.3}}}},
          {"pictures",
           {{"near", {{"psnr", psnr}, {"ssim", 0.5}}},
            {"middle", {{"psnr", psnr}, {"ssim", 0.5}}},
            {"far", {{"psnr", psnr}, {"ssim", 0.5}}},
            {"grazing", {{"psnr", psnr}, {"ssim", 0.5}}},
            {"all", {{"psnr", psnr}, {"ssim", 0.5}}}}}};
}

/// The record of a sweep of these points.
Json sweep_of(const std::vector<Json>& points) {
  return {{"trade", 1},
          {"identity", {{"stitch", "s"}}},
          {"points", points},
          {"truth",
           {{"near", {{"noisePsnr", nullptr}}},
            {"middle", {{"noisePsnr", 41}}},
            {"far", {{"noisePsnr", 40}}},
            {"grazing", {{"noisePsnr", 42}}}}}};
}

/// The record of a frame of that fabric.
Json frame_of(const std::string& fabric, const std::string& setting, bool usual, bool swept) {
  Json frame = record(fabric + "--" + setting, 0, 30);
  frame.update({{"fabric", fabric},
                {"usual", usual},
                {"swept", swept},
                {"frameMs", 12.5},
                {"madeBy", {{"threads", 2}}}});
  return frame;
}

/// The file in the folder as JSON.
Json read_json(const test::Folder& folder) {
  const auto text = read_file(folder / "trade.json");
  REQUIRE(text);
  return Json::parse(*text);
}

/// A page of a sweep, as both programs make it.
Result<void> write_page(const test::Folder& folder, const Json& trade) {
  REQUIRE(write_file(folder / "trade.json", trade.dump()));
  auto read = read_trade({folder / "."});
  if (!read) return tl::unexpected(read.error());
  return write_trade_page({folder / "."}, std::move(*read));
}

TEST_CASE("a page has the points of its sweep, the front marked, times per frame joined, and no address") {
  const test::Folder folder;
  Json trade = sweep_of({record("good", 1000, 30), record("bad", 2000, 25)});
  trade["presets"] = {{"high", "good"}, {"draft", "missing"}, {"reference", "good"}};
  trade["framePresets"] = {{"standard", "good--usual"}};
  // Of a point that is gone, and of a point that was the first one.
  trade["frames"] = {frame_of("other", "usual", true, true), frame_of("bad", "x2", false, true),
                     frame_of("good", "usual", true, true)};
  // Clang takes the braces around a single value for its copy.
  trade["usualFrames"] = Json::array({frame_of("bad", "usual", true, false)});
  const auto written = write_page(folder, trade);
  REQUIRE_MESSAGE(written, to_line(written.error()));

  const Json all = read_json(folder);
  REQUIRE(all["points"].size() == 2);
  CHECK(all["points"][0]["name"] == "good");
  CHECK(all["points"][0]["front"]["bytes"] == true);
  CHECK(all["points"][0]["frameMs"] == 12.5);
  CHECK(all["points"][0]["quality"] == "high, reference");
  CHECK(all["points"][0]["front"]["work"] == true);
  CHECK_FALSE(all["points"][1].contains("quality"));
  CHECK(all["points"][1]["front"]["bytes"] == false);
  CHECK(all["points"][1]["frameMs"] == 12.5);
  REQUIRE(all["frames"].size() == 1);
  CHECK(all["frames"][0]["name"] == "good--usual");
  CHECK(all["usualFrames"].size() == 1);
  CHECK(all["presets"] == trade["presets"]);
  CHECK(all["framePresets"] == trade["framePresets"]);

  const auto csv = read_file(folder / "trade.csv");
  REQUIRE(csv);
  CHECK(std::count(csv->begin(), csv->end(), '\n') == 4);  // a header, two fabrics, one setting of the viewer
  CHECK(csv->find(",\"a, \"\"b\"\"\",8,") != std::string::npos);

  const auto page = read_file(folder / "index.html");
  REQUIRE(page);
  CHECK(page->find("selvedge make &lt;stitch&gt;") != std::string::npos);
  CHECK(page->find(">bytes, time to make, work of all cores, frame</td>") != std::string::npos);
  CHECK(page->find("far 40.0 dB, grazing 42.0 dB, middle 41.0 dB, near none.") != std::string::npos);
  // The name of SVG's language is no address that anything is loaded from.
  for (const char* loads : {"src=\"http", "href=\"http", "url(", "<script", "@import"})
    CHECK(page->find(loads) == std::string::npos);
  // What is written again is the same.
  REQUIRE(write_page(folder, all));
  CHECK(read_json(folder) == all);
}

TEST_CASE("the plot's line steps along the front, from the cheapest to the best") {
  const test::Folder folder;
  REQUIRE(write_page(folder, sweep_of({record("a", 1000, 30), record("b", 10, 10), record("c", 100, 20),
                                       record("d", 100, 5)})));
  const auto page = read_file(folder / "index.html");
  REQUIRE(page);
  // The first plot's only line that is not of its grid.
  const std::string begin = "<polyline points=\"";
  const std::size_t end = page->find("\" fill=\"none\" stroke=\"#d55e00\"");
  REQUIRE(end != std::string::npos);
  const std::size_t start = page->rfind(begin, end) + begin.size();
  std::stringstream text(page->substr(start, end - start));
  std::vector<V2d> points;
  char comma = 0;
  for (V2d p; text >> p.x >> comma >> p.y;) points.push_back(p);
  // Two points for each of three on the front: across, then up; the last goes on to the frame's edge.
  REQUIRE(points.size() == 6);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const V2d step = points[i] - points[i - 1];
    const bool across = i % 2 == 1;
    CHECK((across ? step.y : step.x) == 0);
    CHECK((across ? step.x > 0 : step.y < 0));
  }
}

TEST_CASE("a damaged record of a sweep or of its points is refused by its place") {
  const test::Folder folder;
  const auto refuses = [&](const Json& trade, const std::string& place) {
    CAPTURE(trade.dump());
    const auto written = write_page(folder, trade);
    REQUIRE_FALSE(written);
    CHECK(written.error().code == Code::file_damaged);
    CHECK(written.error().file == folder / "./trade.json");
    CHECK(written.error().place == place);
    CHECK_FALSE(std::filesystem::exists(folder / "index.html"));
  };
  for (const char* text : {"1", "[]", R"("a")"}) refuses(Json::parse(text), "");
  refuses(Json::object(), "/trade");
  for (const char* text : {"{", "", R"({"trade": 1, "trade": 1})"}) {
    REQUIRE(write_file(folder / "trade.json", std::string(text)));
    const auto read = read_trade({folder / "."});
    REQUIRE_FALSE(read);
    CHECK(read.error().code == Code::file_damaged);
  }
  for (const char* point : {"1", "[]", "{}", R"({"name": "a"})", R"({"name": ["a"]})"})
    refuses(sweep_of({record("b", 1, 1), Json::parse(point)}), "/points/1");
  for (const char* name : {"", ".", "..", "../a", "/a", "a\\b"})
    refuses(sweep_of({record(name, 1000, 30)}), "/points/0");
  refuses(sweep_of({record(std::string(1, '\0'), 1000, 30)}), "/points/0");
  Json other = sweep_of({});
  other["points"] = "a";
  refuses(other, "/points");
  for (const char* member : {"/truth", "/truth/far", "/truth/near/noisePsnr", "/points"}) {
    Json trade = sweep_of({record("a", 1000, 30)});
    const Json::json_pointer at(member);
    trade[at.parent_pointer()].erase(at.back());
    REQUIRE_FALSE(write_page(folder, trade));
  }
  CHECK(write_page(folder, sweep_of({record("a", 1000, 30)})));
}

TEST_CASE("a figure that is none is damage, wherever it stands in the record of a point") {
  const test::Folder folder;
  for (const char* member :
       {"/knobs", "/command", "/bytes", "/seconds", "/seconds/bake", "/seconds/fit", "/seconds/make",
        "/processorSeconds", "/loadMs", "/heldOut", "/heldOut/0/psnr", "/heldOut/0/relativeL2", "/pictures",
        "/pictures/near", "/pictures/far/psnr", "/pictures/grazing/ssim", "/pictures/all/ssim"}) {
    for (const char* wrong : {"null", "[1]", "true"}) {
      CAPTURE(member);
      CAPTURE(wrong);
      Json point = record("a", 1000, 30);
      point[Json::json_pointer(member)] = Json::parse(wrong);
      const auto written = write_page(folder, sweep_of({point}));
      REQUIRE_FALSE(written);
      CHECK(written.error().code == Code::file_damaged);
      CHECK(written.error().place == "/points/0");
    }
  }
}

TEST_CASE("members that no figure hangs on leave their cells empty where they are of another type") {
  const test::Folder folder;
  for (const char* wrong : {"1", "null", "[1]", R"("x")", R"({"a": [1]})", "true"}) {
    CAPTURE(wrong);
    Json point = record("a", 1000, 30);
    point["quality"] = Json::parse(wrong);
    Json trade = sweep_of({point});
    for (const char* member : {"identity", "presets", "frames", "usualFrames", "framePresets"})
      trade[member] = Json::parse(wrong);
    const auto written = write_page(folder, trade);
    REQUIRE_MESSAGE(written, to_line(written.error()));
    CHECK(read_json(folder)["points"][0]["pictures"]["all"]["psnr"] == 30);
  }
}

TEST_CASE("damaged records of the viewer are left out") {
  const test::Folder folder;
  Json trade = sweep_of({record("a", 1000, 30)});
  const auto frames_on_page = [&](const Json& frame) {
    trade["frames"] = {1, nullptr, frame};
    const auto written = write_page(folder, trade);
    REQUIRE_MESSAGE(written, to_line(written.error()));
    return read_json(folder)["frames"].size();
  };
  const Json frame = frame_of("a", "usual", true, true);
  CHECK(frames_on_page(frame) == 1);
  for (const auto& [member, wrong] :
       {std::pair("swept", Json("yes")), std::pair("usual", Json{1}), std::pair("madeBy", Json("x")),
        std::pair("fabric", Json(1)), std::pair("knobs", Json("x")), std::pair("frameMs", Json("12")),
        std::pair("name", Json{"a--usual"}), std::pair("name", Json("../a")),
        std::pair("pictures", Json(1))}) {
    const std::string named = member;  // Clang 14 captures no bindings.
    CAPTURE(named);
    Json other = frame;
    other[member] = wrong;
    CHECK(frames_on_page(other) == 0);
  }
}

}  // namespace
}  // namespace selvedge
