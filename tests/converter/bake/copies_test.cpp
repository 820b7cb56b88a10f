#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/make/group_pieces.h"
#include "format/base/atomic_file.h"
#include "format/fabric/file.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/require.h"

namespace selvedge {
namespace {

constexpr int waves = 8;
constexpr int nodes_per_wave = 12;
constexpr int stations_per_wave = 24;
const V2f period(8, 2);

/// A yarn along x that rises and falls `waves` times and sways to the side in every second wave, with light
/// that changes with its height and with the angle; chains begin a quarter of a wave behind a border.
YarnData wave(float sway) {
  YarnData data;
  YarnCurve curve;
  curve.nodes = waves * nodes_per_wave;
  curve.stations = waves * stations_per_wave;
  curve.repeat_offset = {1, 0};
  curve.radius = 0.2F;
  curve.plies = {2, 2, 16, 0.5F, {0, 0, 0}, 1};
  data.curves = {curve};
  const auto phase = [](int place, int places) {
    const auto i = static_cast<float>(place);
    return 2 * std::numbers::pi_v<float> * (i / static_cast<float>(places) + 0.25F);
  };
  for (int i = 0; i < curve.nodes; ++i) {
    const float side = i / nodes_per_wave % 2 == 0 ? sway : 0;
    data.nodes.emplace_back(static_cast<float>(i) / nodes_per_wave + 0.25F,
                            1 + side * std::pow(std::sin(phase(i, 2 * nodes_per_wave)), 2.0F),
                            0.3F + 0.1F * std::sin(phase(i, nodes_per_wave)));
  }
  for (int s = 0; s < curve.stations; ++s)
    for (int i = 0; i < light_values_per_station; ++i)
      data.station_light.push_back(
          0.02F + 0.01F * std::sin(phase(s, stations_per_wave) + static_cast<float>(i % 27)) /
                      static_cast<float>(1 + i / 27));
  return data;
}

float mean_light(const YarnData& data) {
  float sum = 0;
  for (const float value : data.station_light) sum += std::abs(value);
  return sum / static_cast<float>(data.station_light.size());
}

}  // namespace

TEST_CASE("pieces of equal waves are copies of one kind: yarn and light are what they were") {
  const YarnData given = wave(0);
  const YarnData copied = find_copies(given, period, {waves, 1}, 8);
  CHECK(copied.copies.kinds() <= 2);
  CHECK(copied.copies.kind_of.size() == waves);
  REQUIRE(validate(copied, period));
  // The chain begins at another node: plies of both lie at the same places.
  const Yarns before(given, period);
  const Yarns after(copied, period);
  float largest = 0;
  float of_light = 0;
  for (int i = 0; i < 200; ++i) {
    const V2d uv((i + 0.5) / 200, 0.5 + 0.1 * (i % 3 - 1) / 2);
    const auto first = before.trace(uv, 0, {0, 0, 1});
    const auto second = after.trace(uv, 0, {0, 0, 1});
    REQUIRE(first.has_value() == second.has_value());
    if (!first) continue;
    const YarnPoint p = before.point_at(*first);
    const YarnPoint q = after.point_at(*second);
    largest = std::max(largest, (p.normal - q.normal).length());
    const V3f light = V3f(0.3F, 0.2F, 0.8F).normalized();
    of_light += (indirect_light(before.transfer_at(p), light) - indirect_light(after.transfer_at(q), light))
                    .length() /
                200;
  }
  CHECK(largest < 0.2F);
  CHECK(of_light < 0.05F * mean_light(given));
}

TEST_CASE("a fabric in pieces is of version 5, smaller, and read as it was written") {
  const test::Folder folder;
  Fabric fabric = test::random_fabric(8, 8, {2, 2}, 1, 5);
  fabric.period_mm = period;
  const auto written = [&](const YarnData& data, const char* name) {
    fabric.levels.front().set_yarns(std::make_shared<const Yarns>(data, period));
    test::need(write_fabric(folder / name, fabric, {.half_layers = {}}));
    return test::need(read_fabric(folder / name)).levels.front().yarns()->data();
  };
  const YarnData given = wave(0.3F);
  CHECK(written(given, "4.exr") == given);
  const YarnData copied = find_copies(given, period, {waves, 1}, 2);
  CHECK(copied.copies.kinds() == 2);
  CHECK(written(copied, "5.exr") == copied);
  CHECK(test::need(read_file(folder / "4.exr")).find("\"version\":[4,0]") != std::string::npos);
  const std::string text = test::need(read_file(folder / "5.exr"));
  CHECK(text.find("\"version\":[5,0]") != std::string::npos);
  CHECK(text.size() < test::need(read_file(folder / "4.exr")).size());
}

TEST_CASE("a ring cannot be cut: yarn with one stays as it is") {
  YarnData data = wave(0);
  data.curves[0].repeat_offset = {0, 0};
  CHECK(find_copies(data, period, {waves, 1}, 2) == data);
}

}  // namespace selvedge
