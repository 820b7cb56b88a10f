#include "apps/report/compare_plot.h"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <OpenImageIO/detail/pugixml/pugixml.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include "apps/report/compare_tiles.h"
#include "apps/report/svg.h"
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
  const auto svg = compare_plot(fabric, held_out, training, names);
  REQUIRE_MESSAGE(svg, to_line(svg.error()));
  OIIO::pugi::xml_document document;
  REQUIRE(document.load_string(svg->c_str()));
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

TEST_CASE("plot: tiles have the truth's colours, and the plot the same bytes every time") {
  const Fabric fabric = test::random_fabric(4, 4, {2, 2}, 1, 3);
  PairSamples held_out = random_truth(1, 1);
  // Half of the texels at the peak, half at a quarter of it.
  for (std::size_t t = 0; t < 16; ++t) held_out.radiance[t] = V3f(t % 4 < 2 ? 0.5F : 0.125F);
  const auto svg = compare_plot(fabric, held_out, random_truth(4, 2), names);
  REQUIRE(svg);
  CHECK(*svg == *compare_plot(fabric, held_out, random_truth(4, 2), names));
  OIIO::pugi::xml_document document;
  REQUIRE(document.load_string(svg->c_str()));
  const auto truth = document.child("svg").child("image");
  // The picture that this has to be, texel by texel.
  const int width = truth.attribute("width").as_int();
  Image expected{width, truth.attribute("height").as_int(), 3, {}};
  CHECK(width % 4 == 0);
  for (int i = 0; i < width * expected.height; ++i)
    expected.pixels.insert(expected.pixels.end(), 3, i % width < width / 2 ? 1.0F : 0.25F);
  CHECK(std::string(truth.attribute("href").value()) == png_address(*encode_png(expected)));
}

TEST_CASE("plot: colours of differences are as light on both sides, and lightness falls evenly") {
  // Oklab's lightness by the matrices of its publication.
  const auto lightness = [](const V3f& c) {
    const V3d d(c);
    const double l = 0.4122214708 * d.x + 0.5363325363 * d.y + 0.0514459929 * d.z;
    const double m = 0.2119034982 * d.x + 0.6806995451 * d.y + 0.1073969566 * d.z;
    const double s = 0.0883024619 * d.x + 0.2817188376 * d.y + 0.6299787005 * d.z;
    return 0.2104542553 * std::cbrt(l) + 0.7936177850 * std::cbrt(m) - 0.0040720468 * std::cbrt(s);
  };
  for (double t = 0; t < 1.01; t += 0.125) {
    for (const double sign : {-1.0, 1.0}) {
      // A hundredth of the lightness of white is what one can just see.
      CHECK(std::abs(lightness(diverging_colour(sign * t)) - (0.975 - 0.525 * t)) < 0.016);
    }
  }
  CHECK(diverging_colour(-0.5).z > diverging_colour(-0.5).x);
  CHECK(diverging_colour(0.5).x > diverging_colour(0.5).z);
  CHECK(diverging_colour(7) == diverging_colour(1));
}

TEST_CASE("plot: a cell of any shape gives a page that can be drawn") {
  for (const V2f& period : {V2f(1, 1e5F), V2f(1e5F, 1), V2f(1, 30)}) {
    Fabric fabric = test::random_fabric(4, 4, {2, 2}, 1, 3);
    fabric.period_mm = period;
    const auto svg = compare_plot(fabric, random_truth(20, 1), random_truth(30, 2), names);
    REQUIRE(svg);
    OIIO::pugi::xml_document document;
    REQUIRE(document.load_string(svg->c_str()));
    CHECK(document.child("svg").attribute("height").as_int() < 4000);
  }
}

TEST_CASE("plot: refuses samples without held-out pairs, and those of another cell") {
  const Fabric fabric = test::random_fabric(4, 4, {2, 2}, 1, 3);
  const auto none = compare_plot(fabric, PairSamples(), random_truth(4, 2), names);
  REQUIRE_FALSE(none);
  CHECK(none.error().code == Code::samples_malformed);
  CHECK(none.error().file == "k.samples.exr");
  const auto other =
      compare_plot(test::random_fabric(8, 4, {2, 2}, 1, 3), random_truth(2, 1), random_truth(4, 2), names);
  REQUIRE_FALSE(other);
  CHECK(other.error().code == Code::fabric_mismatch);
}

TEST_CASE("plot: a model has tiles below those of the fit, and figures of its own") {
  const Fabric fabric = test::random_fabric(4, 4, {2, 2}, 1, 3);
  const PairSamples held_out = random_truth(20, 1);
  // Level 0 as traced: nothing differs.
  PairAnswers exact(1);
  for (std::size_t i = 0; i < held_out.alpha.size(); ++i)
    exact[0].push_back({held_out.radiance[i], held_out.alpha[i]});
  PlotNames named = names;
  named.model = "python3 my_model.py";
  const auto svg = compare_plot(fabric, held_out, random_truth(30, 2), named, exact);
  REQUIRE(svg);
  OIIO::pugi::xml_document document;
  REQUIRE(document.load_string(svg->c_str()));
  std::vector<std::pair<std::string, std::string>> pictures;
  std::multiset<std::string> texts;
  for (const auto& node : document.child("svg").children()) {
    if (std::string(node.name()) == "image")
      pictures.emplace_back(node.child_value("title"), node.attribute("href").value());
    if (std::string(node.name()) == "text") texts.insert(node.child_value());
  }
  REQUIRE(pictures.size() == 5 * 6 + 1);
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(pictures[5 * i + 3].first.starts_with("model, pair "));
    CHECK(pictures[5 * i + 3].second == pictures[5 * i].second);
    CHECK(pictures[5 * i + 4].first.starts_with("model - truth, pair "));
    CHECK(pictures[5 * i + 4].second == pictures[4].second);
  }
  CHECK(texts.count("model 200.00 dB") == 6);
  CHECK(texts.count("200.00 dB, relative L2 0.0000 at level 0, 20 pairs") == 1);
  CHECK(texts.count("model: python3 my_model.py") == 1);
}
