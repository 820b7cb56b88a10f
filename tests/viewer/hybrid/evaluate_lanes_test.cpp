#include "viewer/hybrid/evaluate_lanes.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "tests/format/fabrics.h"
#include "tests/viewer/shapes.h"
#include "tests/viewer/sided_fabric.h"

namespace selvedge {
namespace {

void set(LaneDirections& directions, std::size_t lane, const V3f& d) {
  directions.x[lane] = d.x;
  directions.y[lane] = d.y;
  directions.z[lane] = d.z;
}

struct Differences {
  double radiance = 0;  ///< largest, relative to 1 + radiance
  double alpha = 0;
  double brightest = 0;
};

/// Random pixels, each with `entries` texels of random levels, under `light_count` lights.
Differences compare(const Fabric& fabric, std::size_t entries, std::size_t light_count, std::uint64_t seed,
                    PowerKind power = PowerKind::exact) {
  const PackedFabric packed = pack(fabric);
  LaneScratch scratch;
  Differences worst;
  for (std::uint64_t block = 0; block < 200; ++block) {
    Random random(seed, block);
    LaneDirections view;
    std::vector<LaneLight> lights(light_count);
    std::vector<LaneTexels> texels(entries);
    for (std::size_t lane = 0; lane < lane_count; ++lane) {
      set(view, lane, test::any_direction(random));
      for (LaneLight& light : lights) {
        set(light.direction, lane, test::any_direction(random));
        light.share[lane] = static_cast<float>(random.uniform());
        light.irradiance = V3f(1, 2, 0.5F);
      }
      for (LaneTexels& of : texels) {
        const auto level =
            static_cast<std::size_t>(random.uniform() * static_cast<double>(fabric.levels.size()));
        of.level[lane] = static_cast<std::int32_t>(level);
        of.texel[lane] = static_cast<std::int32_t>(random.uniform() * fabric.levels[level].texels());
        of.weight[lane] = random.uniform() < 0.2
                              ? 0.0F
                              : static_cast<float>(random.uniform() / static_cast<double>(entries));
      }
    }
    LaneShading sum;
    evaluate_lanes(packed, texels, view, lights, scratch, sum, power);
    for (std::size_t lane = 0; lane < lane_count; ++lane) {
      V3d radiance(0, 0, 0);
      double alpha = 0;
      const V3f v(view.x[lane], view.y[lane], view.z[lane]);
      for (const LaneTexels& of : texels) {
        if (of.weight[lane] == 0) continue;
        const int level = of.level[lane];
        const int width = fabric.levels[of.level[lane]].width;
        const auto texel = static_cast<int>(of.texel[lane]);
        V3d light_sum(0, 0, 0);
        double opacity = evaluate(fabric, level, texel % width, texel / width, V3f(0, 0, 1), v).alpha;
        for (const LaneLight& light : lights) {
          const Shading one =
              evaluate(fabric, level, texel % width, texel / width,
                       V3f(light.direction.x[lane], light.direction.y[lane], light.direction.z[lane]), v);
          light_sum += V3d(one.radiance * light.irradiance * light.share[lane]);
        }
        alpha += of.weight[lane] * opacity;
        radiance += light_sum * of.weight[lane] * opacity;
      }
      worst.alpha = std::max(worst.alpha, std::abs(alpha - static_cast<double>(sum.alpha[lane])));
      const std::array<float, 3> found{sum.red[lane], sum.green[lane], sum.blue[lane]};
      for (unsigned c = 0; c < 3; ++c) {
        const double expected = radiance[static_cast<int>(c)];
        worst.brightest = std::max(worst.brightest, expected);
        worst.radiance =
            std::max(worst.radiance, std::abs(expected - static_cast<double>(found[c])) / (1 + expected));
      }
    }
  }
  return worst;
}

// Powers are off by 4e-7 of exponent times logarithm (powers.h), lookups by 1e-6 of a cell.
constexpr double bound = 2e-5;

TEST_CASE("sixteen pixels at once agree with the reference evaluation, whatever the layers") {
  for (const int layers : {0, 1, 2, 3, 4, 5}) {
    CAPTURE(layers);
    Fabric fabric = layers < 4 ? test::random_fabric(8, 4, {4, 6}, 2, 3)
                               : test::random_product_fabric(8, 4, {4, 6}, 2, 3);
    for (FabricLevel& level : fabric.levels) {
      if (layers == 1) level.remove(LayerKind::table);
      if (layers == 2) level.remove(LayerKind::opacity);
      if (layers == 2) fabric.radiance_scale = 0.25F;
      if (layers == 3) {
        level.remove(LayerKind::table);
        level.remove(LayerKind::opacity);
        level.remove(LayerKind::frame);
      }
      if (layers == 5) {
        level.remove(LayerKind::lobes);
        level.remove(LayerKind::table);
        level.remove(LayerKind::light);
      }
    }
    // Of products alone negative sums count as 0 after the mean over the texels.
    const Differences worst = compare(fabric, layers == 5 ? 1 : 2, 2, 7);
    CHECK(worst.brightest > 0.1);
    CHECK(worst.alpha < 2e-6);
    CHECK(worst.radiance < bound);
  }
}

TEST_CASE("the mean of texels of products alone is that of the reference where none is negative") {
  Fabric fabric = test::random_product_fabric(8, 4, {4, 6}, 2, 3);
  ProductBases bases = *fabric.levels.front().bases;
  for (float& value : bases.view) value = std::abs(value);
  for (V3f& value : bases.light) value = V3f(std::abs(value.x), std::abs(value.y), std::abs(value.z));
  const auto shared = std::make_shared<const ProductBases>(std::move(bases));
  for (FabricLevel& level : fabric.levels) {
    for (const LayerKind kind : {LayerKind::lobes, LayerKind::table, LayerKind::light}) level.remove(kind);
    level.bases = shared;
    std::vector<float> values(level.coefficients().begin(), level.coefficients().end());
    for (float& value : values) value = std::abs(value);
    level.set(LayerKind::products, {static_cast<int>(level.pairs.size()), std::move(values)});
  }
  for (const std::size_t texels : {2, 9}) {
    const Differences worst = compare(fabric, texels, 11, 7);
    CHECK(worst.brightest > 0.1);
    CHECK(worst.alpha < 2e-6);
    CHECK(worst.radiance < bound);
  }
}

TEST_CASE("any number of lights, of texels and of lobes can be evaluated") {
  CHECK(compare(test::random_fabric(4, 4, {3, 3}, 0, 5), 1, 3, 1).radiance < bound);
  CHECK(compare(test::random_fabric(4, 4, {1, 1}, 5, 5), 7, 1, 2).radiance < bound);
  CHECK(compare(test::random_product_fabric(4, 4, {8, 8}, 1, 5), 3, 19, 3).radiance < bound);
  CHECK(compare(test::random_fabric(4, 4, {3, 3}, 2, 5), 2, 0, 4).alpha < 2e-6);
}

TEST_CASE("with fast powers radiance is within their error of the reference, and opacity is the same") {
  for (const int lobes : {1, 2, 5}) {
    const Differences worst = compare(test::random_fabric(4, 4, {3, 3}, lobes, 5), 2, 3, 6, PowerKind::fast);
    CHECK(worst.alpha < 2e-6);
    // 8e-5 and 6e-5 of exponent times logarithm (powers.h), of lobes that are a fraction of 1 + radiance.
    CHECK(worst.radiance < 1e-4);
    CHECK(worst.radiance > compare(test::random_fabric(4, 4, {3, 3}, lobes, 5), 2, 3, 6).radiance);
  }
}

TEST_CASE("lights on both sides agree with the reference evaluation, on both sides of the cloth") {
  for (const bool products : {false, true}) {
    const Fabric fabric = test::sided_fabric([&](int side) {
      Fabric of = test::random_product_fabric(8, 4, {4, 6}, 2, 30 + side);
      of.radiance_scale = 1 + static_cast<float>(side);
      for (FabricLevel& level : of.levels) {
        if (!products) continue;
        for (const LayerKind kind : {LayerKind::lobes, LayerKind::frame, LayerKind::table, LayerKind::light})
          level.remove(kind);
      }
      return of;
    });
    for (const Fabric& seen : {fabric, turned_over(fabric)}) {
      // Of products alone negative sums count as 0 after the mean over the texels.
      const Differences worst = compare(seen, products ? 1 : 2, 11, 7);
      CHECK(worst.brightest > 0.1);
      CHECK(worst.alpha < 2e-6);
      CHECK(worst.radiance < bound);
    }
  }
}

TEST_CASE("levels with other layers stand side by side in one block") {
  Fabric fabric = test::random_fabric(8, 8, {4, 4}, 2, 9);
  fabric.levels[1].remove(LayerKind::table);
  std::vector<float> lobes = fabric.levels[2][LayerKind::lobes].values;
  lobes.resize(fabric.levels[2].texels() * 15);
  fabric.levels[2].set(LayerKind::lobes, {15, std::move(lobes)});
  CHECK(compare(fabric, 3, 2, 5).radiance < bound);
}

}  // namespace
}  // namespace selvedge
