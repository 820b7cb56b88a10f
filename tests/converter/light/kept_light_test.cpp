#include "converter/light/kept_light.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "converter/stitch/find_cell.h"
#include "tests/require.h"

namespace selvedge {
namespace {

/// Even light that leaves the curves by way of others, from above or from below.
std::vector<double> light_of_curves(const YarnData& data, const std::vector<float>& light) {
  std::vector<double> sums;
  std::size_t first = 0;
  for (const YarnCurve& curve : data.curves) {
    sums.push_back(0);
    for (int s = 0; s < curve.stations; ++s, first += light_values_per_station)
      for (std::size_t c = 0; c < 3; ++c) sums.back() += static_cast<double>(light[first + c]);
  }
  return sums;
}

}  // namespace

TEST_CASE("light of cloth that is edited in a place is nearly the light of all of it anew") {
  CellOptions options;
  options.needs_stitch_mesh = false;
  options.settings = {{"repeats", {8}}};
  const YarnCell cell = test::need(find_cell("plain-knit", options)).yarn.value();
  const V2f period(cell.period);
  const LineLightOptions lines{.both_sides = true};
  YarnData before = cell.yarns;
  compute_yarn_light(before, period, cell.wall_transmission, lines);
  const Yarns last(before, period);
  // A dent of a stitch's size.
  const V2f middle = period / 2;
  YarnData edited = cell.yarns;
  for (V3f& node : edited.nodes) {
    V2f away(node.x - middle.x, node.y - middle.y);
    for (int k = 0; k < 2; ++k) away[k] -= std::round(away[k] / period[k]) * period[k];
    node.z += 1.2F * std::exp(-away.length2() / 4);
  }
  YarnData truth = edited;
  compute_yarn_light(truth, period, cell.wall_transmission, lines);
  REQUIRE(relight_near_changes(edited, period, cell.wall_transmission, last, lines));
  // Rows whose plies turn otherwise, as they are longer, have 4 % more or less light.
  for (const bool below : {false, true}) {
    const auto light = [&](const YarnData& data) {
      return light_of_curves(data, below ? data.light_through : data.station_light);
    };
    const std::vector<double> was = light(before);
    const std::vector<double> is = light(truth);
    const std::vector<double> found = light(edited);
    double largest_change = 0;
    for (std::size_t c = 0; c < is.size(); ++c) {
      CAPTURE(c);
      CHECK(found[c] == doctest::Approx(is[c]).epsilon(0.05));
      largest_change = std::max(largest_change, std::abs(was[c] / is[c] - 1));
    }
    CHECK(largest_change > 0.05);
    CHECK(std::accumulate(found.begin(), found.end(), 0.0) ==
          doctest::Approx(std::accumulate(is.begin(), is.end(), 0.0)).epsilon(0.02));
  }

  // Nothing has changed; all has; the cloth has another size.
  YarnData same = cell.yarns;
  REQUIRE(relight_near_changes(same, period, cell.wall_transmission, last, lines));
  for (std::size_t i = 0; i < same.station_light.size(); ++i)
    REQUIRE(same.station_light[i] == doctest::Approx(before.station_light[i]).epsilon(1e-3));
  YarnData red = cell.yarns;
  for (YarnCurve& curve : red.curves) curve.albedo = V3f(1, 0, 0);
  CHECK_FALSE(relight_near_changes(red, period, cell.wall_transmission, last, lines));
  CHECK_FALSE(relight_near_changes(same, period * 1.01F, cell.wall_transmission, last, lines));
}

}  // namespace selvedge
