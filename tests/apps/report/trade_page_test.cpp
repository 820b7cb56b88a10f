#include "apps/report/trade_page.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/report/trade_plot.h"
#include "format/base/atomic_file.h"
#include "format/quality/picture_error.h"
#include "tests/format/files.h"
#include "tests/require.h"

namespace selvedge {
namespace {

using Json = nlohmann::json;

TEST_CASE("on the front is what nothing else beats in cost and quality") {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const std::vector<TradeFigure> figures{{1, 10}, {2, 20}, {2, 15}, {3, 20}, {4, 30}, {4, 30}, {0.5, none}};
  CHECK(pareto_front(figures) == std::vector<bool>{true, true, false, false, true, true, false});
}

TEST_CASE("the plot's line steps along the front, from the cheapest to the best") {
  const Drawing drawing = trade_plot({"title", "bytes", "dB", {{1000, 30}, {10, 10}, {100, 20}, {100, 5}}});
  const DrawnLine* line = nullptr;
  for (const Drawn& shape : drawing.shapes) {
    const auto* of = std::get_if<DrawnLine>(&shape);
    if (of != nullptr && of->points.size() > 2) line = of;
  }
  REQUIRE(line != nullptr);
  // Two points for each of three on the front: across, then up; the last goes on to the frame's edge.
  REQUIRE(line->points.size() == 6);
  for (std::size_t i = 1; i < line->points.size(); ++i) {
    const V2d step = line->points[i] - line->points[i - 1];
    const bool across = i % 2 == 1;
    CHECK((across ? step.y : step.x) == 0);
    CHECK((across ? step.x > 0 : step.y < 0));
  }
}

TEST_CASE("picture errors are those of what a display shows") {
  // Radiance 1 / pi is white, 0 black; where the pictures differ it is by 1 in one of two pixels.
  const float white = 1 / 3.14159265F;
  const Frame a{2, 1, {V4f(white, white, white, 1), V4f(0, 0, 0, 1)}};
  const Frame b{2, 1, {V4f(white, white, white, 1), V4f(9, 9, 9, 1)}};
  const auto error = test::need(picture_error(a, b));
  CHECK(error.mean_square == doctest::Approx(0.5).epsilon(1e-5));
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
Json sweep_record(const Json& points) {
  return {{"trade", 1},
          {"identity", {{"stitch", "s"}}},
          {"points", points},
          {"truth",
           {{"near", {{"noisePsnr", nullptr}}},
            {"middle", {{"noisePsnr", 41}}},
            {"far", {{"noisePsnr", 40}}},
            {"grazing", {{"noisePsnr", 42}}}}}};
}

TEST_CASE("a page has the points of its sweep, the front marked, times per frame joined, and no address") {
  const test::Folder folder;
  for (const char* name : {trade_points_folder, trade_frames_folder, trade_pictures_folder})
    std::filesystem::create_directory(folder / name);
  Json sweep = sweep_record(Json::array({"good", "bad", "missing"}));
  sweep["presets"] = {{"high", "good"}, {"draft", "missing"}, {"reference", "good"}};
  REQUIRE(write_file(folder / "sweep.json", sweep.dump()));
  REQUIRE(write_file(folder / "points/good.json", record("good", 1000, 30).dump()));
  REQUIRE(write_file(folder / "points/bad.json", record("bad", 2000, 25).dump()));
  REQUIRE(write_file(folder / "points/other.json", record("other", 1, 99).dump()));
  Json frame = record("good--usual", 0, 30);
  frame["fabric"] = "good";
  frame["usual"] = frame["swept"] = true;
  frame["frameMs"] = 12.5;
  frame["madeBy"] = {{"threads", 2}, {"fabric", "digest"}};
  const auto write_frame = [&](const std::string& name, const Json& record) {
    Json named = record;
    named["name"] = name;
    REQUIRE(write_file(folder / ("frames/" + name + ".json"), named.dump()));
  };
  write_frame("good--usual", frame);
  // What an earlier sweep in this folder, or an earlier program, has left: not listed, of a point that is
  // gone, of what is no longer the centre, on other terms.
  write_frame("good--old", frame);
  frame["fabric"] = "other";
  write_frame("other--usual", frame);
  frame["fabric"] = "bad";
  write_frame("bad--usual", frame);
  frame["fabric"] = "good";
  frame["madeBy"]["threads"] = 3;
  write_frame("good--slow", frame);
  const Json list = {
      {"madeBy", {{"threads", 2}}},
      {"presets", {{"standard", "good--usual"}}},
      {"frames", {"good--slow", "other--usual", "bad--usual", "good--usual", "good--missing"}}};
  REQUIRE(write_file(folder / "frames.json", list.dump()));
  test::need(write_trade_page(folder / "."));

  const auto json = test::need(read_file(folder / "trade.json"));
  const Json all = Json::parse(json);
  REQUIRE(all["points"].size() == 2);
  CHECK(all["points"][0]["name"] == "good");
  CHECK(all["points"][0]["front"]["bytes"] == true);
  CHECK(all["points"][0]["frameMs"] == 12.5);
  CHECK(all["points"][0]["quality"] == "high, reference");
  CHECK(all["points"][0]["front"]["work"] == true);
  CHECK_FALSE(all["points"][1].contains("quality"));
  CHECK(all["points"][1]["front"]["bytes"] == false);
  REQUIRE(all["frames"].size() == 1);
  CHECK(all["frames"][0]["name"] == "good--usual");
  CHECK(all["presets"] == sweep["presets"]);
  CHECK(all["framePresets"] == list["presets"]);

  const auto csv = test::need(read_file(folder / "trade.csv"));
  CHECK(std::count(csv.begin(), csv.end(), '\n') == 4);  // a header, two fabrics, one setting of the viewer
  CHECK(csv.find(",\"a, \"\"b\"\"\",8,") != std::string::npos);

  const auto page = test::need(read_file(folder / "index.html"));
  CHECK(page.find("selvedge make &lt;stitch&gt;") != std::string::npos);
  CHECK(page.find(">bytes, time to make, work of all cores, frame</td>") != std::string::npos);
  CHECK(page.find("far 40.0 dB, grazing 42.0 dB, middle 41.0 dB, near none.") != std::string::npos);
  CHECK(page.find("<polyline") != std::string::npos);
  // The name of SVG's language is no address that anything is loaded from.
  for (const char* loads : {"src=\"http", "href=\"http", "url(", "<script", "@import"})
    CHECK(page.find(loads) == std::string::npos);
}

/// A sweep of the point "a" with a record, and folders for what else there is.
void write_small_sweep(const test::Folder& folder) {
  for (const char* name : {trade_points_folder, trade_frames_folder})
    std::filesystem::create_directory(folder / name);
  REQUIRE(write_file(folder / "sweep.json", sweep_record(Json::array({"a"})).dump()));
  REQUIRE(write_file(folder / "points/a.json", record("a", 1000, 30).dump()));
}

TEST_CASE("a damaged record of a sweep or of its points is refused by its name") {
  const test::Folder folder;
  write_small_sweep(folder);
  const auto refuses = [&](const std::string& file, const std::string& text) {
    CAPTURE(text);
    const auto before = read_file(folder / file);
    REQUIRE(write_file(folder / file, text));
    const Error error = test::error_of(write_trade_page(folder / "."));
    CHECK(error.code == Code::file_damaged);
    CHECK(error.file == folder / ("./" + file));
    CHECK_FALSE(std::filesystem::exists(folder / "index.html"));
    REQUIRE(write_file(folder / file, *before));
  };
  for (const char* text : {"", "{", "[]", R"({"name": "a"})", R"({"name": ["a"]})",
                           R"({"name": "b", "pictures": {"all": {"psnr": 1}}})",
                           R"({"name": "a", "pictures": {"all": {"psnr": "1"}}})"})
    refuses("points/a.json", text);
  for (const char* text : {"[", "[1]", "{}"}) refuses("sweep.json", text);
  for (const char* points :
       {R"("a")", "[1]", R"([""])", R"([".."])", R"(["a", "../points/a"])", R"(["/a"])", R"(["a\u0000"])"})
    refuses("sweep.json", sweep_record(Json::parse(points)).dump());
  for (const char* member : {"/trade", "/truth", "/truth/far", "/truth/near/noisePsnr"}) {
    Json sweep = sweep_record(Json::array({"a"}));
    const Json::json_pointer at(member);
    sweep[at.parent_pointer()].erase(at.back());
    refuses("sweep.json", sweep.dump());
  }
  const auto written = write_trade_page(folder / ".");
  CHECK(written);
}

TEST_CASE("a figure that is none is damage, wherever it stands in the record of a point") {
  const test::Folder folder;
  write_small_sweep(folder);
  for (const char* member :
       {"/knobs", "/command", "/bytes", "/seconds", "/seconds/bake", "/seconds/fit", "/seconds/make",
        "/processorSeconds", "/loadMs", "/heldOut", "/heldOut/0/psnr", "/heldOut/0/relativeL2", "/pictures",
        "/pictures/near", "/pictures/far/psnr", "/pictures/grazing/ssim", "/pictures/all/ssim"}) {
    for (const char* wrong : {"null", "[1]", "true"}) {
      CAPTURE(member);
      CAPTURE(wrong);
      Json point = record("a", 1000, 30);
      point[Json::json_pointer(member)] = Json::parse(wrong);
      REQUIRE(write_file(folder / "points/a.json", point.dump()));
      const Error error = test::error_of(write_trade_page(folder / "."));
      CHECK(error.code == Code::file_damaged);
      CHECK(error.file == folder / "./points/a.json");
    }
  }
}

TEST_CASE("members that no figure hangs on leave their cells empty where they are of another type") {
  const test::Folder folder;
  write_small_sweep(folder);
  for (const char* wrong : {"1", "null", "[1]", R"("x")", R"({"a": [1]})", "true"}) {
    CAPTURE(wrong);
    Json point = record("a", 1000, 30);
    point["quality"] = Json::parse(wrong);
    REQUIRE(write_file(folder / "points/a.json", point.dump()));
    Json sweep = sweep_record(Json::array({"a"}));
    for (const char* member : {"identity", "presets"}) sweep[member] = Json::parse(wrong);
    REQUIRE(write_file(folder / "sweep.json", sweep.dump()));
    test::need(write_trade_page(folder / "."));
    const auto json = test::need(read_file(folder / "trade.json"));
    CHECK(Json::parse(json)["points"][0]["pictures"]["all"]["psnr"] == 30);
  }
}

TEST_CASE("what nothing asks for, and what is damaged of the viewer's, leaves the page as it is without it") {
  const test::Folder folder;
  write_small_sweep(folder);
  REQUIRE(write_file(folder / "points/junk.json", std::string("{")));
  REQUIRE(write_file(folder / "frames/junk.json", std::string("[]")));
  const auto frames_on_page = [&] {
    test::need(write_trade_page(folder / "."));
    const auto json = test::need(read_file(folder / "trade.json"));
    const Json all = Json::parse(json);
    CHECK(all["points"].size() == 1);
    return all["frames"].size();
  };
  Json frame = record("a--usual", 0, 30);
  frame["fabric"] = "a";
  frame["usual"] = frame["swept"] = true;
  frame["frameMs"] = 12.5;
  frame["madeBy"] = {{"threads", 2}};
  REQUIRE(write_file(folder / "frames/a--usual.json", frame.dump()));
  const std::string list = R"({"frames": ["a--usual"], "madeBy": {"threads": 2}})";
  for (const char* damaged : {"", "{", "[]", "{}", R"({"frames": "a--usual"})",
                              R"({"frames": [1, "a--usual"]})", R"({"frames": ["../frames/a--usual"]})"}) {
    CAPTURE(damaged);
    REQUIRE(write_file(folder / "frames.json", std::string(damaged)));
    CHECK(frames_on_page() == 0);
  }
  REQUIRE(write_file(folder / "frames.json", list));
  CHECK(frames_on_page() == 1);
  for (const auto& [member, wrong] :
       {std::pair("swept", Json("yes")), std::pair("usual", Json{1}), std::pair("madeBy", Json("x")),
        std::pair("fabric", Json(1)), std::pair("knobs", Json("x")), std::pair("frameMs", Json("12")),
        std::pair("name", Json{"a--usual"}), std::pair("pictures", Json(1))}) {
    CAPTURE(member);
    Json other = frame;
    other[member] = wrong;
    REQUIRE(write_file(folder / "frames/a--usual.json", other.dump()));
    CHECK(frames_on_page() == 0);
  }
}

TEST_CASE("a name too long for a file is that of a point that is not there") {
  const test::Folder folder;
  write_small_sweep(folder);
  REQUIRE(write_file(folder / "sweep.json", sweep_record(Json::array({"a", std::string(300, 'b')})).dump()));
  test::need(write_trade_page(folder / "."));
}

}  // namespace
}  // namespace selvedge
