#include "fitter/training_pairs.h"

#include <doctest/doctest.h>

#include <set>

using namespace selvedge;

namespace {

SamplesHeader header_of(DirectionGrid views, DirectionGrid lights) {
  SamplesHeader header;
  header.width = 3;
  header.height = 4;
  header.views = views;
  header.lights = lights;
  return header;
}

/// Rows whose every sample says where it is from: texel, view and light.
SampleLevel rows_of(const SamplesHeader& header, int first, int count) {
  SampleLevel rows;
  rows.width = header.width;
  rows.height = count;
  rows.views = header.views.count();
  rows.lights = header.lights.count();
  for (int t = first * header.width; t < (first + count) * header.width; ++t) {
    for (int v = 0; v < rows.views; ++v) {
      rows.alpha.push_back(static_cast<float>(v) / 64);
      for (int l = 0; l < rows.lights; ++l) rows.radiance.emplace_back(V3i(t, v, l));
    }
  }
  return rows;
}

}  // namespace

TEST_CASE("training pairs are samples of the grid, none twice, whatever rows they come in") {
  const SamplesHeader header = header_of({4, 4}, {4, 5});
  TrainingPairs whole(header);
  whole.add(rows_of(header, 0, 4));
  const PairSamples pairs = whole.finish();
  REQUIRE(pairs.pairs.size() == TrainingPairs::max_pairs);
  std::set<std::pair<int, int>> cells;
  for (std::size_t p = 0; p < pairs.pairs.size(); ++p) {
    const V3i of_first(pairs.radiance[p * 12]);
    cells.insert({of_first.y, of_first.z});
    CHECK(pairs.pairs[p].view == direction_of(header.views, of_first.y));
    CHECK(pairs.pairs[p].light == direction_of(header.lights, of_first.z));
    for (int t = 0; t < 12; ++t) {
      const std::size_t at = p * 12 + static_cast<std::size_t>(t);
      CHECK(V3i(pairs.radiance[at]) == V3i(t, of_first.y, of_first.z));
      CHECK(pairs.alpha[at] == static_cast<float>(of_first.y) / 64);
    }
  }
  CHECK(cells.size() == TrainingPairs::max_pairs);
  // Views as well as lights are all there: of 128 draws from 320 one of 20 is left out once in 3,000 grids.
  std::set<int> views;
  for (const auto& cell : cells) views.insert(cell.first);
  CHECK(views.size() == 16);

  TrainingPairs by_rows(header);
  by_rows.add(rows_of(header, 0, 1));
  by_rows.add(rows_of(header, 1, 3));
  CHECK(by_rows.finish().radiance == pairs.radiance);
}

TEST_CASE("of a small grid every pair is a training pair") {
  const SamplesHeader header = header_of({1, 2}, {1, 3});
  TrainingPairs training(header);
  training.add(rows_of(header, 0, 4));
  const PairSamples pairs = training.finish();
  REQUIRE(pairs.pairs.size() == 6);
  for (int p = 0; p < 6; ++p) {
    CHECK(V3i(pairs.radiance[static_cast<std::size_t>(p) * 12]) == V3i(0, p / 3, p % 3));
  }
}
