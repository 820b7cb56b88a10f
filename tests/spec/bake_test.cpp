// spec/stitch.md and spec/samples.md: the example yarn is baked, and a value of its samples is read as the
// page says.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "converter/bake/bake.h"
#include "converter/stitch/pattern_json.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/exr/exr.h"
#include "tests/format/files.h"
#include "tests/require.h"
#include "tests/shared_data.h"
#include "tests/spec/spec_text.h"

using namespace selvedge;
using namespace selvedge::test;
using nlohmann::json;

namespace {

StitchPattern example_pattern() {
  const auto blocks = code_blocks(page("stitch.md"), "json");
  REQUIRE(blocks.size() == 1);
  return test::need(read_stitch(blocks[0], "stitch.md"));
}

/// As spec/samples.md has it: 6 x 3 texels, 4 views, 6 lights.
void bake_example(const std::string& path) {
  const auto mesh = test::need(mesh_stitch(example_pattern()));
  BakeOptions options;
  options.width = 6;
  options.height = 3;
  options.views = 4;
  options.lights = 6;
  options.validation_pairs = options.held_out_pairs = 2;
  test::need(write_samples(path, test::need(bake(mesh, "stitch.md", options)).samples));
}

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  std::string text;
  char buffer[256];
  while (pipe && std::fgets(buffer, sizeof buffer, pipe.get()) != nullptr) text += buffer;
  return text;
}

/// The numbers of oiiotool's line "Constant Color: 0.1 0.2 (float)".
std::vector<double> constant_color(const std::string& text) {
  std::vector<double> numbers;
  const std::string mark = "Constant Color:";
  const std::size_t at = text.find(mark);
  if (at == std::string::npos) return numbers;
  std::istringstream in(text.substr(at + mark.size()));
  for (double number = 0; in >> number;) numbers.push_back(number);
  return numbers;
}

}  // namespace

TEST_CASE("the example of a stitch description is a mesh of a straight yarn") {
  const auto mesh = test::need(mesh_stitch(example_pattern()));
  CHECK(mesh.period == V2d(2, 1));
  for (const V3f& p : mesh.positions) {
    // A hundredth of a grid edge of 2 mm / 40.
    CHECK(std::abs(std::hypot(p.y - 0.5F, p.z) - 0.3F) < 0.001F);
  }
}

TEST_CASE("every member of a stitch description is in the page") {
  const json example = json::parse(to_json(example_pattern()));
  const std::string text = page("stitch.md");
  for (const auto& item : example.items()) CHECK_MESSAGE(test::names(text, item.key()), item.key());
  for (const auto& item : example["yarns"][0].items())
    CHECK_MESSAGE(test::names(text, "yarns/*/" + item.key()), item.key());
}

TEST_CASE("directions of pairs lie in the band of the page") {
  const Folder folder;
  bake_example(folder / "s.exr");
  const SamplesHeader header = test::need(read_samples_header(folder / "s.exr"));
  CHECK(page("samples.md").find("0.15 <= z < 1") != std::string::npos);
  CHECK(min_pair_z == 0.15);
  const auto& pairs = header.pairs;
  for (const std::size_t set : {0U, 1U})
    for (const DirectionPair& pair : pairs[set]) CHECK(std::min(pair.light.z, pair.view.z) >= 0.15F);
}

TEST_CASE("the commands of the page read the values that the reader reads") {
  if (output_of("command -v oiiotool").empty()) {
    test::skip("there is no oiiotool");
    return;
  }
  const Folder folder;
  bake_example(folder / "straight.samples.exr");
  const Samples samples = test::need(read_samples(folder / "straight.samples.exr"));
  const SampleLevel level = side_samples(samples, Side::front).level;
  const auto commands = code_blocks(page("samples.md"), "sh");
  REQUIRE(commands.size() == 3);
  const std::string here = "cd '" + folder / "" + "' && ";

  const std::size_t texel = 1 * 6 + 2;
  const std::size_t view = 3;
  const std::size_t light = 4;
  const V3f& radiance = level.radiance[(texel * 4 + view) * 6 + light];
  CHECK(radiance.x > 0);
  const auto colour = constant_color(output_of(here + commands[0]));
  REQUIRE(colour.size() == 3);
  // Six decimals are printed.
  for (unsigned i = 0; i < 3; ++i) CHECK(std::abs(colour[i] - static_cast<double>(radiance[i])) < 1e-6);

  const auto opacity = constant_color(output_of(here + commands[1]));
  REQUIRE(opacity.size() == 1);
  CHECK(std::abs(opacity[0] - static_cast<double>(level.alpha[texel * 4 + view])) < 1e-6);

  CHECK(output_of(here + commands[2]).find("selvedge.samples") != std::string::npos);
}
