#include <doctest/doctest.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/fabric/header.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"

using namespace selvedge;
using nlohmann::json;

namespace {

/// 3 x 2 stitches, arranged as 5 x 3.
Fabric mapped_fabric() {
  Fabric fabric = test::random_product_fabric(3, 2, {2, 3}, 1, 4);
  fabric.levels.resize(1);
  for (const LayerKind kind : {LayerKind::lobes, LayerKind::frame, LayerKind::table, LayerKind::light})
    fabric.levels.front().remove_layer(kind);
  fabric.period_mm = {10, 4.5F};
  YarnMap map{{3, 2}, {5, 3}, {0, 1, 2, 5, 4, 3, 3, 0, 2, 1, 5, 5, 4, 0, 1}, {1, 0, 1}};
  const V2f period = map.yarn_period(fabric.period_mm);
  CHECK(period == V2f(6, 3));
  Random random(2);
  YarnData data = test::tangle(random, period, 3);
  data.map = std::move(map);
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(data), period));
  return fabric;
}

/// In the cloth, mm.
V3f place_of(const Yarns& yarns, const YarnHit& hit) {
  return yarns.geometry().segments[hit.segment].start + hit.start_offset +
         V3f(hit.map_shift.x, hit.map_shift.y, 0);
}

const YarnMap& map_of(const Fabric& fabric) { return *fabric.find_map(); }

}  // namespace

TEST_CASE("a map comes back from a file of version 5.1, and one that is not whole is not written") {
  const test::Folder folder;
  const Fabric fabric = mapped_fabric();
  const std::string path = folder / "a.exr";
  test::need(write_fabric(path, fabric));
  CHECK(json::parse(test::need(FabricReader::open(path)).header_text())["version"] == json({5, 1}));
  const Fabric read = test::need(read_fabric(path));
  CHECK(map_of(read) == map_of(fabric));
  CHECK(read.period_mm == fabric.period_mm);
  const auto refused = [&](const char* message, const auto& change) {
    Fabric bad = fabric;
    YarnData data = bad.levels.front().yarns()->data();
    change(data.map, bad);
    bad.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(data), V2f(6, 3)));
    const auto written = write_fabric(folder / "bad.exr", bad);
    REQUIRE(!written);
    CHECK(written.error().place + ": " + written.error().message == message);
  };
  refused("map: names stitch 6 of 6", [](YarnMap& map, Fabric&) { map.shown[7] = 6; });
  refused("map: curve 1 is not in one of 3 lines", [](YarnMap& map, Fabric&) { map.lines[1] = 3; });
  refused("map: does not have one texel for each stitch", [](YarnMap& map, Fabric&) {
    map.kinds = {2, 3};
    map.lines = {0, 0, 0};
  });
}

TEST_CASE("headers of maps are refused in a line") {
  const test::Folder folder;
  test::need(write_fabric(folder / "a.exr", mapped_fabric()));
  const json good = json::parse(test::need(FabricReader::open(folder / "a.exr")).header_text());
  const auto verdict = [&](const json& changes) {
    json text = good;
    text.merge_patch(changes);
    IssueSink sink("a.exr");
    (void)header_from_json(text.dump(), {}, sink);
    return sink.has_error() ? to_line(sink.first_error()) : "";
  };
  CHECK(verdict(json::object()).empty());
  for (const auto& [size, message] :
       {std::pair(json({0, 3}), "a.exr: /layers/map/size/0: 0 is outside of 1 to 1048576 [FABRIC_MEMBER]"),
        std::pair(json({2147483648, 1}),
                  "a.exr: /layers/map/size/0: 2147483648 is outside of 1 to 1048576 [FABRIC_MEMBER]"),
        std::pair(json({1048576, 2}),
                  "a.exr: /layers/map/size: has more than 1048576 stitches [FABRIC_MEMBER]")})
    CHECK(verdict({{"layers", {{"map", {{"size", size}}}}}}) == message);
  CHECK(verdict({{"layers", {{"yarns", nullptr}, {"indirect", nullptr}}}}) ==
        "a.exr: /layers/map: there is no layer yarns [FABRIC_MEMBER]");
  const auto& digests = good["digests"];
  const json lobes = {{"layers", {{"lobes", {{"levels", {0}}, {"lobes", 1}}}}},
                      {"digests", {{"lobes", digests["map"]}}}};
  CHECK(verdict(lobes) == "a.exr: /layers/lobes: is beside a map [FABRIC_MEMBER]");
  for (const char* layer : {"frame", "table"}) {
    json back = {{"provenance", json::object()}, {"views", good["views"]}};
    back["layers"][layer]["levels"] = {0};
    back["digests"][layer] = digests["map"];
    CHECK(verdict({{"sides", {{"back", back}}}}) ==
          fmt::format("a.exr: /sides/back/layers/{}: is beside a map [FABRIC_MEMBER]", layer));
  }
}

TEST_CASE("rays meet a map's yarn as they meet a cloth whose stitches are in these places") {
  const YarnMap map{{3, 2}, {4, 3}, {0, 5, 2, 4, 3, 3, 1, 0, 2, 4, 4, 5}, {0, 1, 0, 1, 2}};
  YarnData sampler = test::lines_of(map.kinds, std::array{0, 1, 2, 3, 4, 5});
  const std::vector<int> shapes(map.shown.begin(), map.shown.end());
  const Yarns whole(test::lines_of(map.size, shapes), V2f(map.size));
  sampler.map = map;
  test::need(validate(sampler, V2f(map.kinds)));
  const Yarns mapped(sampler, V2f(map.kinds));
  const Yarns::Grid& grid = mapped.grid();
  CHECK(grid.layers.size() > 5);
  CHECK(static_cast<double>(std::span(grid.cells).size_bytes() + std::span(grid.blocks).size_bytes()) <=
        yarn_memory_bytes(sampler, V2f(map.kinds)));
  Random random(3);
  int met = 0;
  int hidden = 0;
  for (int i = 0; i < 20000; ++i) {
    const V2d uv(3 * random.uniform() - 1, 3 * random.uniform() - 1);
    const V3f view = test::random_direction(random, 0.05);
    const auto expected = whole.trace(uv, 0.4F, view);
    const auto hit = mapped.trace(uv, 0.4F, view);
    REQUIRE(hit.has_value() == expected.has_value());
    if (!hit) continue;
    ++met;
    V3f apart = place_of(mapped, *hit) - place_of(whole, *expected);
    for (int axis = 0; axis < 2; ++axis)
      apart[axis] = std::remainder(apart[axis], static_cast<float>(map.size[axis]));
    CHECK(apart.length() < 1e-4F);
    const V3f light = test::random_direction(random, 0.05);
    const YarnPoint point = mapped.point_at(*hit);
    const bool is_hidden = whole.is_occluded(*expected, point, light);
    CHECK(mapped.is_occluded(*hit, point, light) == is_hidden);
    hidden += is_hidden ? 1 : 0;
  }
  CHECK(met > 10000);
  CHECK(hidden > 2000);
}

TEST_CASE("an arranged fabric has the texel of the stitch that is shown, and means of these by opacity") {
  const Fabric fabric = mapped_fabric();
  const Fabric all = arranged(fabric);
  const YarnMap& map = map_of(fabric);
  REQUIRE(all.levels.size() == 3);
  CHECK(all.texels() == map.size);
  const FabricLevel& finest = all.levels[0];
  const FabricLevel& coarser = all.levels[1];
  const V3f light = V3f(0.3F, -0.2F, 0.9F).normalized();
  const V3f view = V3f(-0.1F, 0.4F, 0.8F).normalized();
  for (int y = 0; y < map.size.y; ++y) {
    for (int x = 0; x < map.size.x; ++x) {
      const int shown = map.shown[y * map.size.x + x];
      const Shading stored = evaluate(fabric, 0, shown % 3, shown / 3, light, view);
      const V2d middle((x + 0.5) / map.size.x, (y + 0.5) / map.size.y);
      CHECK(evaluate(all, 0.0, middle, light, view).radiance == stored.radiance);
    }
  }
  CHECK((coarser.width == 2 && coarser.height == 1));
  // The right one is of the last three columns and all rows.
  float sum = 0;
  float weights = 0;
  for (int y = 0; y < 3; ++y) {
    for (int x = 2; x < 5; ++x) {
      const int texel = 5 * y + x;
      float opacity = 0;
      for (int view_cell = 0; view_cell < 6; ++view_cell)
        opacity += finest.opacity()[6 * texel + view_cell] / 6;
      sum += opacity * finest.coefficients()[2 * texel];
      weights += opacity;
    }
  }
  CHECK(coarser.coefficients()[2] == doctest::Approx(sum / weights));
}
