// Clips: values between keys in closed form, and files that break their rules. Whole garments:
// tests/node/clips.mjs.
#include "format/gltf/clip.h"

#include <doctest/doctest.h>

#include <limits>

#include "format/gltf/read_scene.h"
#include "tests/format/gltf_square.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

std::size_t add_numbers(Square& square, const std::vector<float>& numbers, const char* type,
                        std::size_t count) {
  std::string bytes;
  for (const float number : numbers) bytes += bytes_of<float>({number});
  return square.add_accessor(bytes, 5126, count, type);
}

/// A square whose node moves along x.
Square moving(const char* interpolation, const std::vector<float>& times, const std::vector<float>& values) {
  Square square;
  const auto input = add_numbers(square, times, "SCALAR", times.size());
  const auto output = add_numbers(square, values, "VEC3", values.size() / 3);
  square.json["animations"] = {
      {{"name", "slide"},
       {"samplers", {{{"input", input}, {"output", output}, {"interpolation", interpolation}}}},
       {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}}};
  return square;
}

constexpr float no_number = std::numeric_limits<float>::quiet_NaN();

}  // namespace

TEST_CASE("clip: values between keys, before them and behind them") {
  struct Row {
    const char* interpolation;
    std::vector<float> values;
    double time, x;
  };
  const std::vector<float> plain{0, 0, 0, 4, 0, 0};
  // In-tangent, value, out-tangent of both keys.
  const std::vector<float> smooth{9, 0, 0, 0, 0, 0, 2, 0, 0, -2, 0, 0, 4, 0, 0, 9, 0, 0};
  for (const Row& row : {
           Row{"STEP", plain, 2.9, 0},
           Row{"STEP", plain, 3, 4},
           Row{"LINEAR", plain, 1.5, 1},
           Row{"LINEAR", plain, 0.2, 0},
           Row{"LINEAR", plain, 4.5, 1},  // the second time round
           Row{"CUBICSPLINE", smooth, 2, 2 + 2 * (2 / 8.0) - 2 * (-2 / 8.0)},
       }) {
    GltfDocument document = test::need(load(moving(row.interpolation, {1, 3}, row.values)));
    const Clip clip = test::need(Clip::read(document, "slide", default_memory_limit));
    CHECK(clip.seconds() == 3);
    clip.pose(row.time, document);
    const Scene scene = test::need(read_scene(document));
    CHECK_MESSAGE(scene.instances[0].world[3][0] == doctest::Approx(row.x), row.interpolation, " ", row.time);
    CHECK(scene.remarks.empty());
  }
}

TEST_CASE("clip: broken ones are refused, each with its place") {
  struct Row {
    const char* what;
    std::function<void(Square&)> break_it;
    Code code;
    const char* place;
  };
  const auto animation = [](Square& s) -> Json& { return s.json["animations"][0]; };
  const auto times = [](std::vector<float> keys) {
    return [keys](Square& s) { s = moving("LINEAR", keys, std::vector<float>(3 * keys.size())); };
  };
  using enum Code;
  const char* const input = "/animations/0/samplers/0/input";
  const char* const output = "/animations/0/samplers/0/output";
  const char* const channel = "/animations/0/channels/0";
  for (const Row& row : {
           Row{"no channels", [&](Square& s) { animation(s)["channels"] = Json::array(); }, gltf_malformed,
               "/animations/0"},
           Row{"times go back", times({0, 2, 1}), gltf_malformed, input},
           Row{"a time is NaN", times({0, no_number}), gltf_malformed, input},
           Row{"a value is NaN",
               [&](Square& s) {
                 s = moving("STEP", {0}, {0, no_number, 0});
               },
               mesh_not_finite, output},
           Row{"too many keys", times(std::vector<float>(1'000'000)), file_too_large, input},
           Row{"values for other keys",
               [&](Square& s) {
                 s = moving("LINEAR", {0, 1}, {0, 0, 0});
               },
               gltf_malformed, output},
           Row{"no sampler", [&](Square& s) { animation(s)["channels"][0]["sampler"] = 1; }, gltf_accessor,
               "/animations/0/channels/0/sampler"},
           Row{"no node", [&](Square& s) { animation(s)["channels"][0]["target"]["node"] = 7; },
               gltf_accessor, "/animations/0/channels/0/target/node"},
           Row{"the node has a matrix",
               [&](Square& s) {
                 s.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
               },
               gltf_malformed, channel},
           Row{"unknown interpolation",
               [&](Square& s) { animation(s)["samplers"][0]["interpolation"] = "CATMULLROMSPLINE"; },
               gltf_malformed, "/animations/0/samplers/0/interpolation"},
           Row{"another name", [&](Square& s) { animation(s)["name"] = "walk"; }, option_out_of_range,
               "--animation"},
       }) {
    Square square = moving("LINEAR", {0, 1}, {0, 0, 0, 1, 0, 0});
    row.break_it(square);
    const auto read = Clip::read(test::need(load(square)), "slide", default_memory_limit);
    REQUIRE_MESSAGE(!read, row.what);
    CHECK_MESSAGE(read.error().code == row.code, row.what);
    CHECK_MESSAGE(read.error().place == row.place, row.what);
  }
  Square pointer = moving("LINEAR", {0, 1}, {0, 0, 0, 1, 0, 0});
  animation(pointer)["channels"][0]["target"] = {{"path", "pointer"}};
  CHECK(test::need(Clip::read(test::need(load(pointer)), "0", default_memory_limit)).remarks().size() == 1);
  Square skinned;
  skinned.skin();
  skinned.json["skins"][0]["joints"] = Json::array();
  CHECK(test::error_of(read_scene(test::need(load(skinned)))).place == "/skins/0");
}
