#include "format/fabric/evaluate.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include "format/fabric/file.h"
#include "format/fabric/footprint.h"
#include "format/fabric/lafortune.h"
#include "tests/format/fabrics.h"
#include "tests/require.h"

using namespace selvedge;

TEST_CASE("a Lambert texel gives albedo / pi times the light's cosine, from everywhere") {
  const Fabric fabric = test::lambert_fabric(4, 4, {0.2F, 0.5F, 0.8F});
  for (const DirectionPair& pair : random_direction_pairs(100, 0.01, 1)) {
    const Shading s = evaluate(fabric, 0, 1, 2, pair.light, pair.view);
    CHECK(s.alpha == 1);
    CHECK(s.radiance.y == doctest::Approx(0.5 / std::numbers::pi * static_cast<double>(pair.light.z)));
  }
}

TEST_CASE("lobes are reciprocal, and turn with the frame of their texel") {
  Fabric fabric = test::random_fabric(4, 4, {2, 2}, 2, 9);
  FabricLevel& level = fabric.levels[0];
  level.remove_layer(LayerKind::table);
  const auto radiance = [&](const V3f& light, const V3f& view) {
    return evaluate(fabric, 0, 1, 2, light, view).radiance;
  };
  auto& [normal, tangent] = level.frame()[2 * 4 + 1];
  int bright = 0;
  for (const DirectionPair& pair : random_direction_pairs(200, 0.1, 5)) {
    const V3f there = radiance(pair.light, pair.view) * std::max(normal.dot(pair.view), 0.0F);
    const V3f back = radiance(pair.view, pair.light) * std::max(normal.dot(pair.light), 0.0F);
    for (int c = 0; c < 3; ++c) CHECK(there[c] == doctest::Approx(back[c]).epsilon(1e-4));
    bright += there.y > 1e-3F ? 1 : 0;
  }
  CHECK(bright > 100);
  for (const DirectionPair& pair : random_direction_pairs(50, 0.6, 6)) {
    const M44d turn = M44d().setAxisAngle(V3d(0.3, -0.2, 1).normalized(), 0.4);
    const auto turned = [&](const V3f& v) {
      V3d result;
      turn.multDirMatrix(V3d(v), result);
      return V3f(result);
    };
    const auto frame = std::pair(normal, tangent);
    const V3f before = radiance(pair.light, pair.view);
    normal = turned(normal);
    tangent = turned(tangent);
    const V3f after = radiance(turned(pair.light), turned(pair.view));
    std::tie(normal, tangent) = frame;
    for (int c = 0; c < 3; ++c) CHECK(after[c] == doctest::Approx(before[c]).epsilon(1e-3));
  }
}

TEST_CASE("at a stored view opacity is the stored one, and the table a factor of its own entry") {
  const Fabric fabric = test::random_fabric(4, 4, {4, 4}, 2, 9);
  Fabric bare = fabric;
  bare.levels[0].remove_layer(LayerKind::table);
  const V3f light = V3f(0.3F, -0.2F, 0.9F).normalized();
  for (int entry = 0; entry < 16 * 16; ++entry) {
    const int texel = entry / 16;
    const V3f view = cell_direction(fabric.views, entry % 16);
    const Shading s = evaluate(fabric, 0, texel % 4, texel / 4, light, view);
    const Shading plain = evaluate(bare, 0, texel % 4, texel / 4, light, view);
    CHECK(s.alpha == doctest::Approx(fabric.levels[0].opacity()[entry]).epsilon(1e-4));
    // The neighbours' weights at a cell's own direction are rounding only (1e-6 of the square).
    for (int c = 0; fabric.levels[0].opacity()[entry] > 0 && c < 3; ++c)
      CHECK(s.radiance[c] == doctest::Approx(fabric.levels[0].view_table()[entry][c] * plain.radiance[c])
                                 .epsilon(1e-4)
                                 .scale(0.01));
  }
}

TEST_CASE("no cloth of any layers sends out more than it receives, to either side, near and far") {
  const std::vector<V3f> lights = cell_directions({24, 24});
  for (const char* name : {"lobes", "products-both", "yarn"}) {
    CAPTURE(name);
    const Fabric fabric = test::need(
        read_fabric(std::string(SELVEDGE_SOURCE_DIR "/tests/data/kept/4.0/") + name + ".fabric.exr"));
    double lit = 0;
    for (const double level : {-1.0, 0.0, 1.5}) {
      if (level < 0 && fabric.levels.front().yarns() == nullptr) continue;
      for (const DirectionPair& pair : random_direction_pairs(20, 0.1, 4)) {
        const V2d uv(static_cast<double>(pair.light.x), static_cast<double>(pair.light.y));
        V3d sum(0, 0, 0);
        for (const V3f& light : lights)
          for (const float side : {1.0F, -1.0F})
            sum += V3d(evaluate(fabric, level, uv, {light.x, light.y, side * light.z}, pair.view).radiance);
        sum *= 2 * std::numbers::pi / static_cast<double>(lights.size());
        for (int c = 0; c < 3; ++c) CHECK(sum[c] < 1.05);
        lit += sum.y;
      }
    }
    CHECK(lit > 4);
  }
}

TEST_CASE("the colour of a hole takes no part in the interpolation of the table") {
  Fabric fabric = test::lambert_fabric(1, 1, {1, 1, 1});
  fabric.views = {2, 1};
  FabricLevel& level = fabric.levels[0];
  level.set_layer(LayerKind::opacity, {2, {1, 0}});
  level.set_layer(LayerKind::table, {6, {1, 1, 1, 9, 9, 9}});
  // Half way between the two cells.
  const Shading s = evaluate(fabric, 0, 0, 0, {0, 0, 1}, {0, 0, 1});
  CHECK(s.alpha == doctest::Approx(0.5));
  CHECK(s.radiance.x == doctest::Approx(1 / std::numbers::pi));
}

TEST_CASE("no weights turn the largest number into an infinity") {
  const float most = std::numeric_limits<float>::max();
  for (float weight = 0; weight < 1; weight += 0.01F) {
    const Shading s = blend({V3f(most, 0, 1), 0.3F}, {V3f(most, 0, 1), 0.7F}, weight);
    CHECK(std::isfinite(s.radiance.x));
    CHECK(s.radiance.y == 0);
  }
  Fabric fabric;
  fabric.views = {2, 2};
  FabricLevel level;
  level.width = 1;
  level.height = 1;
  level.set_layer(LayerKind::lobes, {3, {0, 1, most}});
  level.add_layer(LayerKind::table, 12, most);
  level.set_layer(LayerKind::opacity, {4, {0.1F, 0.7F, 0.3F, 0.9F}});
  fabric.levels.push_back(level);
  for (const DirectionPair& pair : random_direction_pairs(1000, 0.05, 3)) {
    const Shading s = evaluate(fabric, 0, 0, 0, pair.light, pair.view);
    CHECK(s.radiance.x == 0);
    CHECK(std::isfinite(s.radiance.y));
    CHECK(std::isfinite(s.radiance.z));
  }
}

TEST_CASE("texture coordinates repeat, rows run downwards") {
  const Fabric fabric = test::random_fabric(4, 2, {1, 1}, 0, 9);
  const V3f up(0, 0, 1);
  const auto same = [&](V2d uv, int x, int y) {
    CHECK(evaluate(fabric, 0.0, uv, up, up).radiance == evaluate(fabric, 0, x, y, up, up).radiance);
  };
  same({0.1, 0.1}, 0, 0);
  same({0.9, 0.9}, 3, 1);
  same({-0.1, 5.6}, 3, 1);
  same({1e9 + 0.3, -3.9}, 1, 0);
  CHECK(wrap_texel(-1e-18, 4) == 3);
}

namespace {

/// 32 x 32 texels, `open` of them a hole, and coarser levels with the mean opacity of their children.
Fabric with_holes(int open) {
  Fabric fabric = test::lambert_fabric(32, 32, V3f(0.5F));
  fabric.period_mm = {5, 5};
  for (std::size_t k = 0; k < fabric.levels.size(); ++k) {
    FabricLevel& level = fabric.levels[k];
    level.add_layer(LayerKind::opacity, 1, k == 0 ? 1.0F : 0.0F);
    for (int y = 0; k > 0 && y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x) {
        const FabricLevel& finer = fabric.levels[k - 1];
        float sum = 0;
        for (const int at : {0, 1, finer.width, finer.width + 1})
          sum += finer.opacity()[2 * y * finer.width + 2 * x + at];
        level.opacity()[y * level.width + x] = sum / 4;
      }
    }
    if (k == 0) std::fill_n(level.opacity().begin(), open, 0.0F);
  }
  return fabric;
}

}  // namespace

TEST_CASE("all levels of a fabric have holes, or none has") {
  for (const int open : {0, 1, 2, 40, 1024}) {
    CAPTURE(open);
    const Fabric fabric = with_holes(open);
    for (int level = 0; level < static_cast<int>(fabric.levels.size()); ++level) {
      CAPTURE(level);
      CHECK(has_holes(fabric, level) == (open > 0));  // one of 1,024 is more than 0.05 %
    }
  }
}

TEST_CASE("what is open by less than one part in two thousand is closed") {
  Fabric fabric = with_holes(0);
  fabric.levels[0].opacity()[7] = 0.6F;  // 0.04 %
  CHECK_FALSE(has_holes(fabric, 0));
  fabric.levels[0].opacity()[8] = 0.8F;  // 0.06 %
  CHECK(has_holes(fabric, 0));
}

TEST_CASE("what a pixel's coordinates do not tell is level 0") {
  CHECK(std::log2(selvedge::pixel_width_texels({{0, 0}, {0, 0}})) < 0);
}

TEST_CASE("a lobe with C = (-1, -1, 1) is Phong's: its base is the cosine to the mirrored light") {
  const std::array<double, 5> p{0, -1, -1, 1, 20};
  const std::array<double, 3> l{0.6, 0, 0.8};
  const std::array<double, 3> mirrored{-0.6, 0, 0.8};
  CHECK(lafortune(p.data(), 1, l.data(), mirrored.data()) == doctest::Approx(0.8));
  const std::array<double, 3> v{0, 0, 1};
  CHECK(lafortune(p.data(), 1, l.data(), v.data()) == doctest::Approx(0.8 * std::pow(0.8, 20)));
}

TEST_CASE("the formula's edges are as stated") {
  const std::array<double, 3> up{0, 0, 1};
  const std::array<double, 3> below{0, 0.6, -0.8};
  const std::array<double, 3> level{1, 0, 0};
  const std::array<double, 5> exponent_zero{0, 0, 0, 1, 0};
  const std::array<double, 5> negative_base{0, 0, 0, -1, 2};
  CHECK(lafortune(exponent_zero.data(), 1, up.data(), up.data()) == 1);
  CHECK(lafortune(negative_base.data(), 1, up.data(), up.data()) == 0);
  CHECK(lafortune(exponent_zero.data(), 1, below.data(), up.data()) == 0);
  CHECK(lafortune(exponent_zero.data(), 1, level.data(), up.data()) == 0);
}

TEST_CASE(
    "in single precision the formula is as exact as its base, for exponents up to 10^4 and at 89.999 "
    "degrees") {
  constexpr long double degree = std::numbers::pi_v<long double> / 180;
  const auto direction = [&](long double polar, long double azimuth) {
    return std::array<float, 3>{static_cast<float>(std::sin(polar * degree) * std::cos(azimuth)),
                                static_cast<float>(std::sin(polar * degree) * std::sin(azimuth)),
                                static_cast<float>(std::cos(polar * degree))};
  };
  long double worst = 0;
  int bright = 0;
  for (const float n : {0.0F, 1e-3F, 1.0F, 20.0F, 200.0F, 1e3F, 1e4F}) {
    for (const std::array<float, 3>& c :
         {std::array{-1.0F, -1.0F, 1.0F}, {0.0F, 0.0F, 1.0F}, {-0.7F, -0.9F, 0.8F}}) {
      const std::array<float, 5> p{0.125F, c[0], c[1], c[2], n};
      const std::array<long double, 5> exact_p{p[0], p[1], p[2], p[3], p[4]};
      for (const long double from : {0.0L, 45.0L, 89.0L, 89.9L, 89.999L}) {
        for (const long double to : {0.0L, 45.0L, 89.0L, 89.9L, 89.999L}) {
          for (int turn = 0; turn < 8; ++turn) {
            const auto l = direction(from, 0), v = direction(to, turn * 45 * degree);
            const std::array<long double, 3> exact_l{l[0], l[1], l[2]}, exact_v{v[0], v[1], v[2]};
            long double base = 0, terms = 0;
            for (int i = 0; i < 3; ++i) {
              const long double term = exact_p[1 + i] * exact_l[i] * exact_v[i];
              base += term;
              terms += std::abs(term);
            }
            constexpr long double unit = 0x1p-24L;
            if (std::abs(base) < 8 * unit * terms) continue;  // rounding decides on which side of 0
            const long double exact = lafortune(exact_p.data(), 1, exact_l.data(), exact_v.data());
            const long double error = lafortune(p.data(), 1, l.data(), v.data()) - exact;
            // Four roundings of the base, which the exponent multiplies, and one each of power, sum and
            // cosine.
            const long double allowed = unit * exact * (base > 0 ? 4 * n * terms / base + 4 : 4);
            worst = std::max(worst, std::abs(error) / allowed);
            bright += exact > 0.2L * exact_l[2] ? 1 : 0;
          }
        }
      }
    }
  }
  CHECK(worst <= 1);
  CHECK(bright > 200);
  MESSAGE("largest error ", static_cast<double>(worst), " of the bound, ", bright, " bright");
}
