#include "apps/report/compare_plot.h"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <OpenImageIO/detail/pugixml/pugixml.hpp>

#include <algorithm>
#include <set>

#include "fitter/training_pairs.h"
#include "format/quality/compare.h"
#include "tests/format/fabrics.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

PairSamples random_truth(int count, std::uint64_t seed) {
  PairSamples truth;
  truth.width = truth.height = 4;
  truth.pairs = random_pairs(count, 0.15, seed);
  Random random(seed);
  for (int i = 0; i < count * 16; ++i) {
    truth.alpha.push_back(1);
    truth.alpha_noise.push_back(0);
    truth.radiance.emplace_back(test::uniform(random, 0, 0.5), test::uniform(random, 0, 0.5), 0.25F);
    truth.noise.emplace_back(0.001F, 0.0F, 0.0F);
  }
  return truth;
}

const PlotNames names{"some/where/k.fabric.exr", "k.samples.exr", 1234567};

}  // namespace

TEST_CASE("plot: pairs are shown from the steepest to the flattest, evenly, each once") {
  const auto pairs = random_pairs(96, 0.15, 5);
  const auto shown = spread_pairs(pairs, 6);
  REQUIRE(shown.size() == 6);
  const auto flatter = [&](std::size_t i) { return std::min(pairs[i].view.z, pairs[i].light.z); };
  for (std::size_t i = 1; i < 6; ++i) CHECK(flatter(shown[i - 1]) > flatter(shown[i]));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    CHECK(flatter(i) <= flatter(shown.front()));
    CHECK(flatter(i) >= flatter(shown.back()));
  }
  for (const int count : {1, 2, 6, 7, 8}) {
    const auto few = spread_pairs(random_pairs(count, 0.15, 5), 6);
    CHECK(few.size() == static_cast<std::size_t>(std::min(count, 6)));
    CHECK(std::set<std::size_t>(few.begin(), few.end()).size() == few.size());
  }
}

TEST_CASE("plot: three tiles a pair, and the numbers are those of compare") {
  const Fabric fabric = test::random_fabric(4, 4, {2, 2}, 1, 3);
  const PairSamples held_out = random_truth(20, 1);
  const PairSamples training = random_truth(30, 2);
  const auto drawing = test::need(plot(fabric, held_out, training, names));
  const auto svg = test::need(svg_of(drawing));
  OIIO::pugi::xml_document document;
  REQUIRE(document.load_string(svg.c_str()));
  std::vector<std::string> pictures;
  std::multiset<std::string> texts;
  for (const auto& node : document.child("svg").children()) {
    if (std::string(node.name()) == "image") pictures.emplace_back(node.child_value("title"));
    if (std::string(node.name()) == "text") texts.insert(node.child_value());
  }
  const auto shown = spread_pairs(held_out.pairs, 6);
  REQUIRE(pictures.size() == 3 * 6 + 1);
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(pictures[3 * i].starts_with(fmt::format("truth, pair {}, view", shown[i])));
    CHECK(pictures[3 * i + 1].starts_with(fmt::format("fit, pair {}, view", shown[i])));
    CHECK(pictures[3 * i + 2].starts_with(fmt::format("difference, pair {}, view", shown[i])));
  }
  const auto comparison = compare(fabric, held_out, PairKind::held_out);
  const auto of_training = compare(fabric, training, PairKind::held_out, comparison->peak);
  for (const std::size_t pair : shown) {
    CHECK(texts.count(fmt::format("{:.2f} dB", comparison->by_pair[pair].psnr)) >= 1);
  }
  for (const auto* c : {&*comparison, &*of_training}) {
    for (const LevelComparison& level : c->levels) CHECK(texts.count(fmt::format("{:.1f}", level.psnr)) >= 1);
    CHECK(texts.count(fmt::format("{:.2f} dB, relative L2 {:.4f} at level 0, {} pairs", c->levels[0].psnr,
                                  c->levels[0].relative_l2, c->pairs)) == 1);
  }
  CHECK(texts.count("k.fabric.exr") == 1);
  CHECK(texts.count("4 x 4 texels, 1 lobe x table, 1,234,567 bytes, beside the truth of k.samples.exr") == 1);
}

TEST_CASE("plot: the PNG has the SVG's size, its tiles the truth's colours, and the same bytes every time") {
  const Fabric fabric = test::random_fabric(4, 4, {2, 2}, 1, 3);
  PairSamples held_out = random_truth(1, 1);
  // Half of the texels at the peak, half at a quarter of it.
  for (std::size_t t = 0; t < 16; ++t) held_out.radiance[t] = V3f(t % 4 < 2 ? 0.5F : 0.125F);
  const auto drawing = test::need(plot(fabric, held_out, random_truth(4, 2), names));
  const auto png = test::need(png_of(drawing));
  CHECK(png == *png_of(*plot(fabric, held_out, random_truth(4, 2), names)));
  const auto image = test::need(decode_image(png, "plot", Transfer::keep));
  CHECK(image.width == drawing.width);
  CHECK(image.height == drawing.height);
  const auto first = std::find_if(drawing.shapes.begin(), drawing.shapes.end(), [](const Drawn& shape) {
    return std::holds_alternative<DrawnPicture>(shape);
  });
  REQUIRE(first != drawing.shapes.end());
  const DrawnPicture& truth = std::get<DrawnPicture>(*first);
  const auto red_at = [&](double u, double v) {
    const auto x = static_cast<std::size_t>(truth.corner.x + u * truth.image.width);
    const auto y = static_cast<std::size_t>(truth.corner.y + v * truth.image.height);
    return image.pixels[4 * (y * static_cast<std::size_t>(image.width) + x)];
  };
  CHECK(red_at(0.3, 0.7) == 1);
  CHECK(red_at(0.8, 0.2) == doctest::Approx(linear_to_srgb(0.25F)).epsilon(0.005));
}

TEST_CASE("plot: a cell of any shape gives a page that can be drawn") {
  for (const V2f& period : {V2f(1, 1e5F), V2f(1e5F, 1), V2f(1, 30)}) {
    Fabric fabric = test::random_fabric(4, 4, {2, 2}, 1, 3);
    fabric.period_mm = period;
    const auto drawing = test::need(plot(fabric, random_truth(20, 1), random_truth(30, 2), names));
    CHECK(drawing.height < 4000);
    CHECK(svg_of(drawing));
  }
}

TEST_CASE("plot: refuses samples without held-out pairs, and those of another cell") {
  const Fabric fabric = test::random_fabric(4, 4, {2, 2}, 1, 3);
  const Error error = test::error_of(plot(fabric, PairSamples(), random_truth(4, 2), names));
  CHECK(error.code == Code::samples_malformed);
  CHECK(error.file == "k.samples.exr");
  CHECK(test::error_of(
            plot(test::random_fabric(8, 4, {2, 2}, 1, 3), random_truth(2, 1), random_truth(4, 2), names))
            .code == Code::fabric_mismatch);
}
