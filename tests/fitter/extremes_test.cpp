// A fit of samples that no good bake gives is always a valid fabric, or an error with its place.
#include <doctest/doctest.h>

#include <cmath>
#include <functional>

#include "fitter/fit.h"
#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

using Radiance = std::function<V3f(int texel, const V3f& light, const V3f& view)>;

struct Case {
  SamplesHeader header;
  SampleLevel level;
};

Case case_of(int width, int height, const DirectionGrid& views, const DirectionGrid& lights,
             const Radiance& radiance) {
  Case c;
  c.header.width = c.level.width = width;
  c.header.height = c.level.height = height;
  c.header.views = views;
  c.header.lights = lights;
  c.level.views = views.count();
  c.level.lights = lights.count();
  for (int t = 0; t < width * height; ++t) {
    c.level.normal_sum.emplace_back(0.0F, 0.0F, 1.0F);
    for (const V3f& v : cell_directions(views)) {
      c.level.alpha.push_back(1);
      for (const V3f& l : cell_directions(lights)) c.level.radiance.push_back(radiance(t, l, v));
    }
  }
  return c;
}

Case case_of(const Radiance& radiance) { return case_of(2, 2, {6, 6}, {6, 6}, radiance); }

/// Every case: fits, and the fabric is valid, which includes that all of it is finite.
Fabric fitted(const Case& c, const FitOptions& options = {}) {
  const auto result = test::need(fit(c.level, c.header, options));
  const auto valid = fabric_file_bytes(result);
  CHECK_MESSAGE(valid, (valid ? "" : to_line(valid.error())));
  return result;
}

const std::vector<DirectionPair>& probes() {
  static const std::vector<DirectionPair> pairs = random_direction_pairs(200, 0.01, 3);
  return pairs;
}

/// Relative L2 distance.
double distance(const std::vector<V3f>& values, const std::vector<V3f>& truth) {
  double error = 0;
  double energy = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    error += (V3d(values[i]) - V3d(truth[i])).length2();
    energy += V3d(truth[i]).length2();
  }
  return energy > 0 ? std::sqrt(error / energy) : std::sqrt(error);
}

/// Relative L2 of texel (0, 0) of level 0 over the fit's own directions.
double error_of(const Fabric& fabric, const Case& c) {
  std::vector<V3f> values;
  for (const V3f& v : cell_directions(c.header.views))
    for (const V3f& l : cell_directions(c.header.lights))
      values.push_back(evaluate(fabric, 0, 0, 0, l, v).radiance);
  return distance(values, c.level.radiance);
}

/// The texel's radiance over `factor` at the probes.
std::vector<V3f> probed(const Fabric& fabric, float factor = 1) {
  std::vector<V3f> values;
  for (const DirectionPair& pair : probes())
    values.push_back(evaluate(fabric, 0, 0, 0, pair.light, pair.view).radiance / factor);
  return values;
}

V3f glossy(int, const V3f& l, const V3f& v) {
  const float lobe = std::pow(std::max(0.0F, -l.x * v.x - l.y * v.y + l.z * v.z), 12.0F);
  return V3f(0.2F, 0.1F, 0.05F) * (l.z * (1 + 3 * lobe) * (0.5F + v.z));
}

}  // namespace

TEST_CASE("all black comes out all black, with T = 1") {
  const Fabric result = fitted(case_of([](int, const V3f&, const V3f&) { return V3f(0, 0, 0); }));
  for (const FabricLevel& level : result.levels)
    for (const V3f& t : level.view_table()) CHECK(t == V3f(1, 1, 1));
  for (const DirectionPair& pair : probes())
    CHECK(evaluate(result, 0, 1, 1, pair.light, pair.view).radiance == V3f(0, 0, 0));
}

TEST_CASE("one bright sample among black ones stays below its own brightness") {
  Case c = case_of([](int, const V3f&, const V3f&) { return V3f(0, 0, 0); });
  c.level.radiance[700] = {1, 1, 1};
  const Fabric result = fitted(c);
  for (const V3f& light : cell_directions(c.header.lights)) {
    for (const V3f& view : cell_directions(c.header.views)) {
      // The peak's bound is 4 times the sample where its light is near the horizon, the table's is below 20.
      CHECK(evaluate(result, 0, 0, 0, light, view).radiance.x < 4);
    }
  }
}

TEST_CASE("a fit scales with the radiance") {
  const Case c = case_of(glossy);
  const Fabric base = fitted(c);
  const auto scaled = [&](float factor) {
    Case other = c;
    for (V3f& r : other.level.radiance) r *= factor;
    return fitted(other);
  };
  SUBCASE("by a power of two, to the bit") {
    const float factor = std::exp2(20.0F);
    const Fabric fabric = scaled(factor);
    for (std::size_t i = 0; i < base.levels[0].lobes().size(); i += 9)
      CHECK(fabric.radiance_scale * fabric.levels[0].lobes()[i] == base.levels[0].lobes()[i] * factor);
    CHECK(fabric.levels[0][LayerKind::table] == base.levels[0][LayerKind::table]);
  }
  SUBCASE("by 1e-8 and 1e8, within rounding") {
    for (const float factor : {1e-8F, 1e8F})
      CHECK(distance(probed(scaled(factor), factor), probed(base)) < 1e-3);
  }
  SUBCASE("by 1e-8 and 1e8, from a file with all layers in half precision") {
    const test::Folder folder;
    FabricWriteOptions options{.half_layers = LayerSet::all()};
    const auto seen = [&](const Fabric& fabric, float factor) {
      REQUIRE(write_fabric(folder / "x.exr", fabric, options));
      const auto read = test::need(read_fabric(folder / "x.exr"));
      return probed(read, factor);
    };
    CHECK(base.radiance_scale == 1);
    const std::vector<V3f> truth = seen(base, 1);
    for (const float factor : {1e-8F, 1e8F}) {
      // Both are rounded to half precision, under exponents of some tens.
      CHECK(distance(seen(scaled(factor), factor), truth) < 0.01);
    }
  }
}

TEST_CASE("texels that are always holes are black with T = 1 and alpha 0") {
  Case c = case_of(glossy);
  for (std::size_t v = 0; v < 36; ++v) c.level.alpha[v] = 0;
  c.level.normal_sum[0] = {0, 0, 0};
  const Fabric result = fitted(c);
  for (const DirectionPair& pair : probes())
    CHECK(evaluate(result, 0, 0, 0, pair.light, pair.view).alpha == 0);
  for (std::size_t v = 0; v < 36; ++v) CHECK(result.levels[0].view_table()[v] == V3f(1, 1, 1));
}

TEST_CASE("a texel seen from one view only has that view's radiance, and a table near 1 elsewhere") {
  Case c = case_of(glossy);
  for (std::size_t v = 0; v < 36; ++v) c.level.alpha[v] = v == 14 ? 1.0F : 0.0F;
  const Fabric result = fitted(c);
  const V3f view = cell_directions(c.header.views)[14];
  std::vector<V3f> values;
  std::vector<V3f> truth;
  for (const V3f& l : cell_directions(c.header.lights)) {
    values.push_back(evaluate(result, 0, 0, 0, l, view).radiance);
    truth.push_back(glossy(0, l, view));
  }
  CHECK(distance(values, truth) < 0.1);
  for (std::size_t v = 0; v < 36; ++v) {
    for (int channel = 0; channel < 3; ++channel) {
      CHECK(result.levels[0].view_table()[v][channel] > 0.5F);
      CHECK(result.levels[0].view_table()[v][channel] < 2.0F);
    }
  }
}

TEST_CASE("one view, one light, or fewer samples than parameters: a valid fabric") {
  for (const auto& [views, lights] : {std::pair{DirectionGrid{1, 1}, DirectionGrid{6, 6}},
                                      {DirectionGrid{6, 6}, DirectionGrid{1, 1}},
                                      {DirectionGrid{1, 1}, DirectionGrid{1, 1}},
                                      {DirectionGrid{1, 2}, DirectionGrid{1, 2}}}) {
    const Case c = case_of(2, 2, views, lights, glossy);
    const Fabric result = fitted(c);
    CHECK(error_of(result, c) < 0.1);
  }
}

TEST_CASE("exponents that the data drive to 0 and to 10,000 stay within their bounds") {
  for (const float n : {0.0F, 0.01F, 1e4F}) {
    const Case c = case_of(1, 1, {8, 8}, {8, 8}, [&](int, const V3f& l, const V3f& v) {
      const float base = l.x * v.x + l.y * v.y + l.z * v.z;
      return V3f(0.1F + (base > 0 ? std::pow(base, n) : 0.0F)) * l.z;
    });
    const Fabric result = fitted(c);
    for (std::size_t lobe = 0; lobe < 6; ++lobe) {
      const float found = result.levels[0].lobes()[lobe / 2 * 9 + lobe % 2 * 4 + 4];
      CHECK(found >= 1);
      CHECK(found <= 200);
    }
    // A step is no lobe of exponent 1 or more; a peak between the directions of the grid is one of 200.
    CHECK(error_of(result, c) < (n < 1 ? 0.3 : 0.05));
  }
}

TEST_CASE("random and adversarial textures never give NaN or infinity") {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed, 17);
    const auto pick = [&](std::initializer_list<double> values) {
      return values.begin()[static_cast<std::size_t>(random.uniform() * static_cast<double>(values.size()))];
    };
    const auto size = [&](int most) { return 1 + static_cast<int>(random.uniform() * most); };
    const DirectionGrid views{size(4), size(4)};
    const DirectionGrid lights{size(4), size(4)};
    const bool wild = seed % 2 == 0;
    Case c = case_of(size(3), size(3), views, lights, [&](int, const V3f&, const V3f&) {
      const auto value = [&] {
        return static_cast<float>(wild ? pick({0, 1e-45, 1e-38, 1e-30, 1e-8, 1, 1e8, 1e30, 3.4e38})
                                       : random.uniform());
      };
      return V3f(value(), value(), value());
    });
    for (float& alpha : c.level.alpha)
      alpha = static_cast<float>(wild ? pick({0, 1e-45, 1e-30, 1e-6, 0.5, 1}) : random.uniform());
    for (V3f& n : c.level.normal_sum)
      n = V3f(static_cast<float>(random.uniform() - 0.5), static_cast<float>(random.uniform() - 0.5),
              static_cast<float>(pick({0, 1e-6, 0.1, 1, -0.5})));
    FitOptions options{.lobes = static_cast<int>(random.uniform() * 5), .view_table = random.uniform() < 0.7};
    options.table.damping = pick({0, 0.05});
    options.table.smoothness = pick({0, 0.05});
    CAPTURE(seed);
    const Fabric result = fitted(c, options);
    for (const DirectionPair& pair : probes())
      CHECK(std::isfinite(evaluate(result, 0, 0, 0, pair.light, pair.view).radiance.x));
  }
}
