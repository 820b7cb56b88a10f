#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/make/pack_yarn.h"
#include "format/base/atomic_file.h"
#include "format/fabric/file.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/require.h"

namespace selvedge {
namespace {

constexpr int waves = 40;
constexpr int nodes_per_wave = 12;
constexpr int stations_per_wave = 30;
const V2f period(waves, 2);

/// A squashed yarn along x that rises and falls, with light from either side that changes with its height and
/// with the angle.
YarnData wave(int count = waves) {
  YarnData data;
  YarnCurve curve;
  curve.nodes = count * nodes_per_wave;
  curve.stations = count * stations_per_wave;
  curve.repeat_offset = {1, 0};
  curve.radius = 0.2F;
  curve.gloss.lustre = 0.5F;
  data.curves = {curve};
  const auto phase = [](int place, int places) {
    return 2 * std::numbers::pi_v<float> * static_cast<float>(place) / static_cast<float>(places);
  };
  for (int i = 0; i < curve.nodes; ++i) {
    data.nodes.emplace_back(period.x * static_cast<float>(i) / static_cast<float>(curve.nodes), 1,
                            0.3F + 0.1F * std::sin(phase(i, nodes_per_wave)));
    // The flattest that validate() takes, of either sign.
    const V3f flattest = V3f(0.1F, 0.2F, 1).normalized() * std::sqrt(1 - min_flattening) * 0.9999F;
    data.curves[0].squeezes.push_back(i % 3 == 0 ? flattest : -flattest);
  }
  for (auto* light : {&data.station_light, &data.light_through})
    for (int s = 0; s < curve.stations; ++s)
      for (int i = 0; i < light_values_per_station; ++i)
        light->push_back(0.02F + 0.01F * std::sin(phase(s, stations_per_wave) + static_cast<float>(i % 27)) /
                                     static_cast<float>(1 + i / 27));
  return data;
}

Fabric fabric_of(const YarnData& data) {
  Fabric fabric = test::random_fabric(8, 8, {2, 2}, 1, 5);
  fabric.period_mm = period;
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(data, period));
  return fabric;
}

}  // namespace

TEST_CASE("packed yarn is what it was to rounding; yarn of a few stitches stays as it is") {
  const YarnData given = wave();
  const YarnData packed = packed_if_large(given);
  REQUIRE(packed.packing.step > 0);
  REQUIRE(validate(packed, period));
  CHECK(packed.packing.function_count() < 8);  // of waves that repeat
  for (std::size_t i = 0; i < given.nodes.size(); ++i) {
    CHECK((packed.nodes[i] - given.nodes[i]).length() <= 0.2F / 64);
    const V3f& squeeze = given.curves[0].squeezes[i];
    const V3f& now = packed.curves[0].squeezes[i];
    CHECK(std::min((now - squeeze).length(), (now + squeeze).length()) < 0.06F);
  }
  double error = 0;
  double sum = 0;
  for (const auto& [before, after] : {std::pair(&given.station_light, &packed.station_light),
                                      std::pair(&given.light_through, &packed.light_through)}) {
    REQUIRE(before->size() == after->size());
    for (std::size_t i = 0; i < before->size(); ++i) {
      error += std::pow((*after)[i] - (*before)[i], 2.0);
      sum += std::pow((*before)[i], 2.0);
    }
  }
  CHECK(error < 0.01 * sum);
  const YarnData few = wave(8);
  CHECK(packed_if_large(few) == few);
}

TEST_CASE("a fabric of packed yarn is of version 5, a fifth as large, and read as it was written") {
  const test::Folder folder;
  const auto written = [&](const YarnData& data, const char* name) {
    test::need(write_fabric(folder / name, fabric_of(data), {half_precision_layers}));
    return test::need(read_file(folder / name));
  };
  const YarnData packed = packed_if_large(wave());
  const std::string plain = written(wave(), "4.exr");
  const std::string text = written(packed, "5.exr");
  CHECK(plain.find("\"version\":[4,0]") != std::string::npos);
  CHECK(text.find("\"version\":[5,0]") != std::string::npos);
  CHECK(5 * text.size() < plain.size());
  YarnData read = test::need(read_fabric(folder / "5.exr")).levels.front().yarns()->data();
  // Light that comes through is a side's, which this fabric has not.
  read.light_through = packed.light_through;
  read.packing.factors_through = packed.packing.factors_through;
  CHECK(read == packed);
}

}  // namespace selvedge
