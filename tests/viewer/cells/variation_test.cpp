// Variation beyond the repeat, in one number and in lanes.
#include "format/fabric/variation.h"

#include <doctest/doctest.h>

#include "format/fabric/yarns.h"
#include "tests/format/yarn_data.h"
#include "viewer/cells/varied_pixels.h"

namespace selvedge {
namespace {

/// A weave of so many mm, its rows along u and v changing by 0.2 and 0.3.
Variation woven(float period) {
  YarnData data = test::waves(period, 4, false);
  for (std::size_t c = 0; c < 4; ++c) {
    data.curves[c].strands.seed = 77;
    data.curves[c].strands.row_variation = c % 2 == 0 ? 0.2F : 0.3F;
  }
  return Yarns(std::move(data), {period, period}).variation();
}

}  // namespace

TEST_CASE("yarn tells rows, lengths and fractions; without change there is no variation") {
  struct Case {
    float period;
    int lengths, log2_repeats;
  };
  for (const auto& [period, lengths, log2_repeats] : {Case{1, 1, 3}, {8, 1, 0}, {40, 5, 0}, {1e-3F, 1, 12}}) {
    const Variation variation = woven(period);
    for (const RowNoise& runs : variation.row_brightness) {
      CHECK(runs.rows == 2);
      CHECK(runs.lengths == lengths);
      CHECK(runs.log2_repeats == log2_repeats);
      // The first yarn lies in the middle of half the cell: rows are counted from there.
      CHECK(runs.offset == doctest::Approx(0.5));
    }
    for (const RowNoise& rows : variation.row_offsets) CHECK(rows.amplitude == doctest::Approx(0.1 / 2));
    CHECK(variation.row_brightness[0].amplitude == doctest::Approx(0.2));
    CHECK(variation.row_brightness[1].amplitude == doctest::Approx(0.3));
    CHECK(variation.along_v_fraction > 0.3F);
    CHECK(variation.along_v_fraction < 0.7F);
  }
  const Variation smooth = Yarns(test::waves(3, 4, false), {3, 3}).variation();
  CHECK_FALSE(smooth.varies());
  CHECK(variation_at(smooth, repeat_place({0.5, 0.5}), 1) == 1);
  CHECK(displaced_place(smooth, V2d(-7.25, 0.5)) == V2d(-7.25, 0.5));
}

TEST_CASE("changes have the mean 1 and the rows' root mean square anywhere, and no jumps along a row") {
  const Variation variation = woven(1);
  const double wanted = 0.2 * 0.2 * (1 + 0.25 * 0.25);
  for (const double far : {0.0, -1e6, 1e6, 3e8}) {
    double sum = 0;
    double squares = 0;
    double beside = 0;
    double ways = 0;
    int count = 0;
    // Middles of rows, many areas apart.
    for (int v = 0; v < 150; ++v) {
      for (int u = 0; u < 150; ++u) {
        const V2d uv(far + 37.03 * u, 0.25 - far + 9 * v);
        const auto at = [&](double x, double y) {
          return static_cast<double>(variation_at(variation, repeat_place({x, y}), 0)) - 1;
        };
        sum += at(uv.x, uv.y);
        squares += at(uv.x, uv.y) * at(uv.x, uv.y);
        // Two rows of different areas.
        beside += at(uv.x, uv.y) * at(uv.x, uv.y + 16);
        CHECK(std::abs(at(uv.x, uv.y) - at(uv.x + 1e-3, uv.y)) < 1e-3);
        ways += std::pow(displaced_place(variation, uv).y - uv.y, 2);
        // Rows do not pass each other.
        const V2d next(uv.x, uv.y + 0.3 * v / 150);
        CHECK(displaced_place(variation, next).y >= displaced_place(variation, uv).y);
        ++count;
      }
    }
    // Bounds of 4 standard errors of a normal distribution.
    const double error = 4 * std::sqrt(wanted / count);
    CHECK(std::abs(sum / count) < error);
    CHECK(squares / count == doctest::Approx(wanted).epsilon(4 * std::sqrt(2.0 / count)));
    CHECK(ways / count == doctest::Approx(0.05 * 0.05).epsilon(4 * std::sqrt(2.0 / count)));
    CHECK(std::abs(beside / count) < 4 * wanted / std::sqrt(count));
  }
}

TEST_CASE("lanes vary as single places do, and large pixels see the mean") {
  Random random(5);
  for (const float period : {0.02F, 3.0F, 50.0F}) {
    const Variation variation = woven(period);
    for (int round = 0; round < 50; ++round) {
      VariedPixels pixels;
      std::array<float, lane_count> single;
      std::array<RepeatPlace, lane_count> moved;
      LaneFloats fraction{};
      for (std::size_t lane = 0; lane < lane_count; ++lane) {
        const double range = round % 2 == 0 ? 100 : 1e9;
        const RepeatPlace place =
            repeat_place({range * (2 * random.uniform() - 1), range * (2 * random.uniform() - 1)});
        pixels.repeat_u[lane] = place.repeat.x;
        pixels.repeat_v[lane] = place.repeat.y;
        pixels.u[lane] = place.fraction.x;
        pixels.v[lane] = place.fraction.y;
        pixels.along_v[lane] = static_cast<float>(lane % 3) / 2;
        const VariationFade fade = variation_fade(variation, V2f(0.1F, 0.3F) * static_cast<float>(lane));
        for (std::size_t k = 0; k < 4; ++k) pixels.fade[k][lane] = fade[k];
        fraction[lane] = offset_weight(fade);
        moved[lane] = displaced_place(variation, place, fraction[lane]);
        single[lane] = variation_at(variation, moved[lane], pixels.along_v[lane], fade);
      }
      place_pixels(variation, fraction, pixels);
      for (std::size_t lane = 0; lane < lane_count; ++lane) {
        const V2d apart = V2d(V2i(pixels.repeat_u[lane], pixels.repeat_v[lane]) - moved[lane].repeat) +
                          V2d(V2f(pixels.u[lane], pixels.v[lane]) - moved[lane].fraction);
        CHECK(apart.length() < 1e-6);
      }
      LaneFloats factors;
      find_variation_factors(variation, pixels, factors);
      for (std::size_t lane = 0; lane < lane_count; ++lane)
        CHECK(std::abs(factors[lane] - single[lane]) < 1e-5F);
    }
  }
  const Variation variation = woven(3);
  CHECK(std::abs(
            variation_at(variation, repeat_place({7.3, 9.1}), 0.5F, variation_fade(variation, {100, 100})) -
            1) < 0.01F);
}

}  // namespace selvedge
