#include <doctest/doctest.h>

#include "format/fabric/header.h"
#include "format/fabric/yarns.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

TEST_CASE("refuses plies of more nodes than a file may have, and plies that stand still") {
  YarnData data = straight(2, 0.04F);
  data.curves[0].nodes = 4096;
  data.curves[0].repeat_offset = {64, 0};
  data.nodes.clear();
  for (int i = 0; i < 4096; ++i) data.nodes.emplace_back(static_cast<float>(i) / 32, 1, 0.5F);
  data.curves[0].plies = {4, 64, 0, 0, {0, 0, 0}};
  CHECK(validate(data, {2, 2}));
  data.curves[0].plies.count = 5;
  CHECK(validate(data, {2, 2}).error().place == "nodes");
  // A ring as narrow as the way from its axis to a ply in the middle.
  data.curves[0].repeat_offset = {0, 0};
  data.curves[0].radius = 0.5F;
  data.curves[0].nodes = 4;
  data.curves[0].plies = {2, 1, 0, 0, {0, 0, 0}};
  data.nodes = {{1.25F, 1, 0.5F}, {1, 1.25F, 0.5F}, {0.75F, 1, 0.5F}, {1, 0.75F, 0.5F}};
  CHECK(validate(data, {2, 2}));
  data.curves[0].plies.phase = 1.57079637F;
  CHECK(validate(data, {2, 2}).error().place == "curve 0");
}

TEST_CASE("values of yarn have all fields, then the nodes, and fewer or more fields are read") {
  const V2f period(2, 2);
  YarnData data = straight(2, 0.5F);
  data.curves[0].gloss.lustre = 0.625F;
  data.curves[0].plies = {3, 8, -7, 0.75F, {0.5F, 0.25F, -0.125F}, 1};
  data.curves[0].strands = {-45, 6, 135, 77, 0.25F, 3, 0.375F, 0.5F, 0.25F};
  const YarnCounts counts = counts_of(data);
  CHECK(counts.values_per_curve == 36);
  const auto read = [&](std::vector<float> values, int fields) {
    values.insert(values.begin() + 36, 9.0F);  // of a later version
    values.erase(values.begin() + fields, values.begin() + 37);
    YarnCounts changed = counts;
    changed.values_per_curve = fields;
    return need(yarns_from_values(values, indirect_values(data), changed, period));
  };
  const std::vector<float> values = curve_values(data);
  CHECK(values.size() == static_cast<std::size_t>(curve_value_count(counts)));
  CHECK(values[36] == data.nodes[0].x);
  CHECK(read(values, 36) == data);
  CHECK(read(values, 37) == data);
  CHECK(read(values, 31).curves[0].strands.contrast == default_contrast);
  CHECK(read(values, 14).curves[0].plies.shift == -7);
  CHECK(read(values, 11).curves[0].plies == YarnPlies());
}
