#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "format/check/fabric.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "tests/format/fabric_sides.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

void check_equal(const FabricLevel& a, const FabricLevel& b) {
  for (const LayerKind kind : all_layers) CHECK(a[kind] == b[kind]);
  CHECK(a.pairs == b.pairs);
}

}  // namespace

TEST_CASE("all sides of a fabric come back from its file") {
  const Folder folder;
  const Fabric fabric = test::four_sides();
  REQUIRE(write_fabric(folder / "a.exr", fabric));
  const auto read = test::need(read_fabric(folder / "a.exr"));
  for (const Side side : other_sides) {
    const Fabric& was = *fabric.find_side(side);
    REQUIRE(read.find_side(side) != nullptr);
    const Fabric& is = *read.find_side(side);
    CHECK(is.side == side);
    CHECK(is.views == was.views);
    CHECK(is.radiance_scale == was.radiance_scale);
    for (std::size_t k = 0; k < was.levels.size(); ++k) check_equal(is.levels[k], was.levels[k]);
  }
  CHECK(read.levels.front().yarns()->data() == fabric.levels.front().yarns()->data());
  REQUIRE(write_fabric(folder / "b.exr", read));
  CHECK(test::bytes_of(folder / "a.exr") == test::bytes_of(folder / "b.exr"));
  CHECK(check_fabric(folder / "a.exr").issues.empty());
}

/// Leaves the other sides out of the levels before `first`, as a writer may.
void leave_sides_out(Fabric& fabric, int first) {
  for (const Side side : other_sides) {
    if (fabric.find_side(side) == nullptr) continue;
    Fabric other = *fabric.find_side(side);
    for (int k = std::min(first, static_cast<int>(other.levels.size()) - 1) - 1; k >= 0; --k)
      other.levels[k].copy_texels(other.levels[k + 1], 1);
    fabric.add_side(std::move(other));
  }
}

TEST_CASE("a level that leaves a side out shows the texels of the next coarser one") {
  const Folder folder;
  const Fabric whole = test::four_sides();
  REQUIRE(whole.levels.size() > 2);
  Fabric fabric = whole;
  leave_sides_out(fabric, 2);
  REQUIRE(write_fabric(folder / "a.exr", fabric));
  const auto read = test::need(read_fabric(folder / "a.exr"));
  for (const Side side : other_sides) {
    const FabricLevel& coarse = whole.find_side(side)->levels[2];
    for (std::size_t k = 0; k < 2; ++k) {
      const FabricLevel& fine = read.find_side(side)->levels[k];
      const int steps = 2 - static_cast<int>(k);
      for (const LayerKind kind : {LayerKind::lobes, LayerKind::table, LayerKind::products}) {
        CAPTURE(name_of(kind));
        REQUIRE(fine[kind].channels == coarse[kind].channels);
        for (int t = 0; t < fine.texels(); ++t) {
          const int x = std::min((t % fine.width) >> steps, coarse.width - 1);
          const int y = std::min((t / fine.width) >> steps, coarse.height - 1);
          for (int c = 0; c < fine[kind].channels; ++c)
            CHECK(fine[kind].values[t * fine[kind].channels + c] ==
                  coarse[kind].values[(y * coarse.width + x) * coarse[kind].channels + c]);
        }
      }
    }
    check_equal(read.find_side(side)->levels[2], coarse);
  }
  const FabricLevel& through = read.find_side(Side::through)->levels[0];
  CHECK(through[LayerKind::indirect] == whole.find_side(Side::through)->levels[0][LayerKind::indirect]);
  CHECK(through[LayerKind::opacity] == whole.levels[0][LayerKind::opacity]);
  REQUIRE(write_fabric(folder / "b.exr", read));
  CHECK(test::bytes_of(folder / "a.exr") == test::bytes_of(folder / "b.exr"));
}

TEST_CASE("light from the other side is the light of the side through, mirrored") {
  const Fabric fabric = test::four_sides();
  const Fabric& through = *fabric.find_side(Side::through);
  Fabric alone = fabric;
  alone.sides = {};
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const V3f light = test::random_direction(random, 0.05);
    const V3f view = test::random_direction(random, 0.05);
    const V2d uv(random.uniform(), random.uniform());
    const double level = i % 4;
    const Shading below = evaluate(fabric, level, uv, mirrored(light), view);
    const Shading expected = evaluate(through, level, uv, light, view);
    CHECK(below.radiance == expected.radiance);
    CHECK(below.alpha == evaluate(fabric, level, uv, light, view).alpha);
    CHECK(evaluate(alone, level, uv, mirrored(light), view).radiance == V3f(0, 0, 0));
  }
}

TEST_CASE("a fabric turned over shows its back, and turned again its front") {
  const Fabric fabric = test::four_sides();
  const Fabric behind = turned_over(fabric);
  check_equal(behind.levels[1], fabric.find_side(Side::back)->levels[1]);
  const FabricLevel& through = behind.find_side(Side::through)->levels[1];
  check_equal(through, fabric.find_side(Side::back_through)->levels[1]);
  CHECK(through[LayerKind::opacity] == behind.levels[1][LayerKind::opacity]);
  const YarnData& yarn = fabric.levels.front().yarns()->data();
  const Yarns turned(turned_over(*fabric.levels.front().yarns(), 2.5F), fabric.period_mm);
  const YarnData again = turned_over(turned, 2.5F);
  CHECK(again.station_light == yarn.station_light);
  CHECK(again.light_through == yarn.light_through);
  CHECK(again.curves == yarn.curves);
  for (std::size_t n = 0; n < yarn.nodes.size(); ++n)
    CHECK((again.nodes[n] - yarn.nodes[n]).length() < 1e-6F);
}

TEST_CASE("light through the front goes for the back where the views are the same") {
  Fabric fabric = test::four_sides();
  fabric.sides[index_of(Side::back_through) - 1] = nullptr;
  CHECK(turned_over(fabric).find_side(Side::through) == nullptr);  // 3 x 3 views, the front has 2 x 3
  Fabric back = test::random_fabric(6, 4, fabric.views, 1, 9);
  back.side = Side::back;
  fabric.add_side(std::move(back));
  const Fabric behind = turned_over(fabric);
  REQUIRE(behind.find_side(Side::through) != nullptr);
  CHECK(behind.find_side(Side::through)->levels[0][LayerKind::opacity] ==
        behind.levels[0][LayerKind::opacity]);
  CHECK(behind.find_side(Side::through)->levels[0][LayerKind::lobes] ==
        fabric.find_side(Side::through)->levels[0][LayerKind::lobes]);
}

TEST_CASE("a place on yarn has the same light whichever side the yarn is known from") {
  // By the directions of frames alone: a normal is mirrored, and its angle follows from the turned frame.
  YarnData data = test::four_sides().levels.front().yarns()->data();
  // The first curve stands upright at its first node, where angles count from the x axis; the second lies.
  const auto lead = [&](int curve, const V3f& way) {
    const int first = 12 * curve;
    const V2i& turns = data.curves[curve].repeat_offset;
    data.nodes[first + 1] = data.nodes[first] + way;
    data.nodes[first + 11] =
        data.nodes[first] - way + V3f(5 * static_cast<float>(turns.x), 4 * static_cast<float>(turns.y), 0);
  };
  lead(0, {0, 0, 0.5F});
  lead(1, {0.5F, 0, 0});
  const Yarns yarns(data, {5, 4});
  const Yarns turned(turned_over(yarns, 2.5F), {5, 4});
  CHECK(angles_from_x_axis(yarns.geometry().segments[0].tangent[0]));
  CHECK_FALSE(angles_from_x_axis(yarns.geometry().segments[12].tangent[0]));
  for (int curve = 0; curve < static_cast<int>(data.curves.size()); ++curve) {
    for (int station = 0; station < data.curves[curve].stations; ++station) {
      const YarnFrame frame = yarns.frame_at(curve, station);
      const YarnFrame other = turned.frame_at(curve, station);
      for (const float angle : {0.3F, 1.7F, 2.9F, 4.4F, 5.8F}) {
        YarnPoint point;
        point.curve = curve;
        point.station = static_cast<float>(station);
        point.angle_cosine = std::cos(angle);
        point.angle_sine = std::sin(angle);
        const V3f normal = mirrored(frame.across * point.angle_cosine +
                                    frame.tangent.cross(frame.across) * point.angle_sine);
        YarnPoint seen = point;
        seen.angle_cosine = normal.dot(other.across);
        seen.angle_sine = normal.dot(other.tangent.cross(other.across));
        for (const bool through : {false, true}) {
          const LightTransfer here = yarns.transfer_at(point, through);
          const LightTransfer there = turned.transfer_at(seen, !through);
          for (std::size_t i = 0; i < here.size(); ++i)
            CHECK(there[i] == doctest::Approx(here[i]).epsilon(1e-4));
        }
      }
    }
  }
}

TEST_CASE("plies turned over are mirrored, about axes that begin upright and others") {
  YarnData data = test::plied(test::four_sides().levels.front().yarns()->data());
  data.nodes[1] = data.nodes[0] + V3f(0, 0, 0.5F);
  data.nodes[11] = data.nodes[0] + V3f(5, 0, -0.5F);
  const V2f period(5, 4);
  REQUIRE(angles_from_x_axis(data.curves[0], std::span<const V3f>(data.nodes).first(12), period));
  const Yarns yarns(data, period);
  const Yarns turned(turned_over(yarns, 2.5F), period);
  for (int curve = 0; curve < static_cast<int>(data.curves.size()); ++curve) {
    const int plies = data.curves[curve].plies.count;
    for (int ply = 0; ply < plies; ++ply) {
      for (int station = 0; station < data.curves[curve].stations; ++station) {
        const YarnFrame here = yarns.frame_at(curve, station, ply);
        const YarnFrame there = turned.frame_at(curve, station, (plies - ply) % plies);
        CHECK((there.position - mirrored(here.position) - V3f(0, 0, 2.5F)).length() < 1e-4F);
        CHECK((there.axis_to_ply - mirrored(here.axis_to_ply)).length() < 1e-4F);
      }
    }
  }
}
