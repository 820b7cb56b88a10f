// The installed library against the reader and the evaluation that it is made of.
#include "format/library/selvedge.h"

#include <doctest/doctest.h>

#include <limits>

#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/fabric/light_sampler.h"
#include "tests/format/fabric_sides.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

struct Written {
  Folder folder;
  Fabric fabric = random_fabric(6, 5, {2, 3}, 2, 7);
  std::string path = folder / "f.exr";
  Written() { REQUIRE(write_fabric(path, fabric, {.half_layers = LayerSet{}})); }
};

}  // namespace

TEST_CASE("the library tells what the fabric holds") {
  const Written written;
  const auto file = test::need(FabricFile::open(written.path));
  CHECK(file.facts().levels == static_cast<int>(written.fabric.levels.size()));
  CHECK(file.facts().view_columns == 2);
  CHECK(file.facts().view_rows == 3);
  CHECK(file.facts().mm_per_repeat[1] == written.fabric.period_mm.y);
  for (int k = 0; k < file.facts().levels; ++k) {
    const FabricLevel& level = written.fabric.levels[k];
    const FabricLevelData data = file.level(k);
    const auto texels = static_cast<std::size_t>(level.texels());
    CHECK(data.width == level.width);
    CHECK(data.lobes == 2);
    REQUIRE(data.parameters.size() == texels * 27);
    REQUIRE(data.frames.size() == texels * 6);
    REQUIRE(data.view_table.size() == texels * 18);
    REQUIRE(data.opacity.size() == texels * 6);
    CHECK(std::equal(data.parameters.begin(), data.parameters.end(), level.lobes().begin()));
    CHECK(data.view_table[17] == level.view_table()[5].z);
    CHECK(data.frames[5] == level.frame()[0].tangent.z);
  }
}

TEST_CASE("the library gives every layer of a fabric of products, as it was written") {
  const Folder folder;
  Fabric fabric = random_product_fabric(6, 5, {2, 3}, 2, 7);
  // As `make --quality standard` chooses them: some levels with lobes, others with products alone.
  for (const LayerKind kind : {LayerKind::lobes, LayerKind::frame, LayerKind::table, LayerKind::light})
    fabric.levels[0].remove_layer(kind);
  REQUIRE(write_fabric(folder / "f.exr", fabric, {.half_layers = LayerSet{}}));
  const auto file = test::need(FabricFile::open(folder / "f.exr"));
  CHECK(file.facts().light_columns == fabric.lights.columns);
  CHECK(file.facts().light_rows == fabric.lights.rows);
  const auto same = [](auto given, const auto& expected) {
    return !expected.empty() && std::equal(given.begin(), given.end(), expected.begin(), expected.end());
  };
  for (int k = 0; k < file.facts().levels; ++k) {
    CAPTURE(k);
    const FabricLevel& level = fabric.levels[k];
    const FabricLevelData data = file.level(k);
    CHECK(data.parameters.empty() == (k == 0));
    CHECK(data.frames.empty() == (k == 0));
    CHECK(data.view_table.empty() == (k == 0));
    CHECK(same(data.opacity, level.opacity()));
    if (k > 0) CHECK(same(data.light_table, level[LayerKind::light].values));
    CHECK(data.products == static_cast<int>(level.pairs.size()));
    for (int m = 0; m < data.products; ++m)
      CHECK(V2i(data.pairs[2 * m], data.pairs[2 * m + 1]) == level.pairs[m]);
    CHECK(same(data.coefficients, level.coefficients()));
    CHECK(same(data.view_basis, level.bases->view));
    REQUIRE(data.light_basis.size() == 3 * level.bases->light.size());
    CHECK(data.light_basis[4] == level.bases->light[1].y);
  }
}

TEST_CASE("the library gives the yarn as it was written, and shows it at level -1") {
  const Folder folder;
  Fabric fabric = with_yarn(random_fabric(6, 5, {2, 3}, 1, 7), 2);
  fabric.levels[0].set_yarns(
      std::make_shared<const Yarns>(plied(fabric.levels[0].yarns()->data()), fabric.period_mm));
  REQUIRE(write_fabric(folder / "f.exr", fabric, {.half_layers = LayerSet{}}));
  const auto file = test::need(FabricFile::open(folder / "f.exr"));
  const YarnData& data = fabric.levels[0].yarns()->data();
  const FabricYarns yarns = file.yarns();
  REQUIRE(yarns.curves.size() == data.curves.size());
  for (std::size_t i = 0; i < data.curves.size(); ++i) {
    const FabricYarnCurve& given = yarns.curves[i];
    const YarnCurve& curve = data.curves[i];
    CHECK(given.nodes == curve.nodes);
    CHECK(given.stations == curve.stations);
    CHECK(V2i(given.turns[0], given.turns[1]) == curve.repeat_offset);
    CHECK(given.radius_mm == curve.radius);
    CHECK(V3f(given.albedo[0], given.albedo[1], given.albedo[2]) == curve.albedo);
    CHECK(given.gloss == curve.gloss.weight);
    CHECK(given.roughness == curve.gloss.roughness);
    CHECK(given.fibre_slope == curve.fibre_slope);
    CHECK(YarnPlies{given.plies,
                    given.divisions,
                    given.shift,
                    given.phase,
                    {given.groove[0], given.groove[1], given.groove[2]},
                    given.sides} == curve.plies);
  }
  REQUIRE(yarns.nodes.size() == 3 * data.nodes.size());
  for (std::size_t i = 0; i < yarns.nodes.size(); ++i)
    CHECK(yarns.nodes[i] == data.nodes[i / 3][static_cast<int>(i % 3)]);
  CHECK(std::equal(yarns.indirect.begin(), yarns.indirect.end(), data.station_light.begin(),
                   data.station_light.end()));
  const std::array<float, 3> light{0.6F, 0, 0.8F};
  const std::array<float, 3> view{0, 0.28F, 0.96F};
  for (const double level : {-7.0, -1.0, -0.25}) {
    CAPTURE(level);
    const auto shown = test::need(file.evaluate_at(level, 0.3, 0.4, light, view));
    const Shading expected = evaluate(fabric, level, {0.3, 0.4}, {0.6F, 0, 0.8F}, {0, 0.28F, 0.96F});
    CHECK(shown.alpha == expected.alpha);
    CHECK(shown.rgb[1] == expected.radiance.y);
  }
  const Written written;
  CHECK(test::need(FabricFile::open(written.path)).yarns().nodes.empty());
}

TEST_CASE("many directions at once give what each gives alone") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "f.exr", random_product_fabric(6, 5, {2, 3}, 2, 7)));
  const auto file = test::need(FabricFile::open(folder / "f.exr"));
  std::vector<std::array<float, 3>> lights;
  std::vector<std::array<float, 3>> views;
  for (const DirectionPair& pair : random_direction_pairs(20, 0.05, 4)) {
    lights.push_back({pair.light.x, pair.light.y, pair.light.z});
    views.push_back({pair.view.x, pair.view.y, pair.view.z});
  }
  std::vector<FabricRadiance> texel(lights.size());
  std::vector<FabricRadiance> place(lights.size());
  REQUIRE(file.evaluate(1, 2, 1, lights, views, texel));
  REQUIRE(file.evaluate_at(0.4, 3.3, -0.2, lights, views, place));
  float brightest = 0;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const auto one = test::need(file.evaluate(1, 2, 1, lights[i], views[i]));
    CHECK(texel[i].rgb == one.rgb);
    CHECK(texel[i].alpha == one.alpha);
    CHECK(place[i].rgb == file.evaluate_at(0.4, 3.3, -0.2, lights[i], views[i])->rgb);
    brightest = std::max(brightest, one.rgb[0]);
  }
  CHECK(brightest > 0);
  texel[0].alpha = 7;
  views[19][1] = std::numeric_limits<float>::infinity();
  CHECK_FALSE(file.evaluate(1, 2, 1, lights, views, texel));
  CHECK_FALSE(file.evaluate(1, 2, 1, lights, std::span(views).first(19), texel));
  CHECK_FALSE(file.evaluate(99, 2, 1, lights, lights, texel));
  CHECK(texel[0].alpha == 7);
}

TEST_CASE("the library evaluates as the reference does, and says nothing where there is nothing") {
  const Written written;
  const auto file = test::need(FabricFile::open(written.path));
  const V3f light = V3f(0.3F, -0.2F, 0.7F).normalized();
  const V3f view = V3f(-0.1F, 0.5F, 0.6F).normalized();
  const std::array<float, 3> l{light.x, light.y, light.z};
  const std::array<float, 3> v{view.x, view.y, view.z};
  for (const double level : {0.0, 0.25, 1.0, 1.5, 9.0}) {
    const Shading expected = evaluate(written.fabric, level, V2d(-3.3, 0.7), light, view);
    const auto answer = test::need(file.evaluate_at(level, -3.3, 0.7, l, v));
    CHECK(answer.rgb[1] == expected.radiance.y);
    CHECK(answer.alpha == expected.alpha);
  }
  CHECK(file.evaluate(1, 2, 1, l, v)->rgb[0] == evaluate(written.fabric, 1, 2, 1, light, view).radiance.x);
  CHECK_FALSE(file.evaluate(0, 6, 0, l, v));
  CHECK_FALSE(file.evaluate(0, 0, -1, l, v));
  CHECK_FALSE(file.evaluate(-1, 0, 0, l, v));
  CHECK_FALSE(file.evaluate(99, 0, 0, l, v));
  CHECK_FALSE(file.evaluate_at(0, std::numeric_limits<double>::quiet_NaN(), 0, l, v));
  CHECK_FALSE(file.evaluate(0, 0, 0, {std::numeric_limits<float>::infinity(), 0, 0}, v));
}

TEST_CASE("a fabric beyond the limits that a program sets is refused") {
  const Written written;
  FabricProblem problem;
  FabricReadOptions options{.max_texels_per_side = 6};
  CHECK(FabricFile::open(written.path, &problem, options));
  options.max_texels_per_side = 5;
  CHECK_FALSE(FabricFile::open(written.path, &problem, options));
  CHECK(problem.place == "/texels/0");
  options = {};
  options.max_lobes = 1;
  CHECK_FALSE(FabricFile::open(written.path, &problem, options));
}

TEST_CASE("the library draws lights as the sampler does, from both sides, and says nothing where it cannot") {
  const Folder folder;
  const Fabric fabric = four_sides();
  REQUIRE(write_fabric(folder / "f.exr", fabric, {.half_layers = LayerSet{}}));
  const auto front = test::need(FabricFile::open(folder / "f.exr"));
  const auto back = test::need(front.turned_over());
  CHECK(back.facts().view_rows == 3);
  CHECK(back.facts().radiance_scale == 0.5F);
  const V3f seen = V3f(0.3F, -0.2F, 0.7F).normalized();
  const std::array<float, 3> view{seen.x, seen.y, seen.z};
  const std::vector<std::array<float, 3>> views(30, view);
  std::vector<std::array<float, 3>> randoms;
  Random random(3);
  for (std::size_t i = 0; i < views.size(); ++i)
    randoms.push_back({uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0, 1)});
  std::vector<FabricLightSample> drawn(views.size());
  for (const double level : {-1.0, 0.0, 0.6}) {
    for (const bool behind : {false, true}) {
      const Fabric source = behind ? turned_over(fabric) : fabric;
      const FabricFile& file = behind ? back : front;
      const LightSampler sampler(source, level, {0.3, 0.4}, seen);
      REQUIRE(file.sample_at(level, 0.3, 0.4, views, randoms, drawn));
      for (std::size_t i = 0; i < views.size(); ++i) {
        const auto& r = randoms[i];
        const LightSample expected = sampler.sample({r[0], r[1], r[2]});
        CHECK(drawn[i].light == std::array{expected.light.x, expected.light.y, expected.light.z});
        CHECK(drawn[i].weight == std::array{expected.weight.x, expected.weight.y, expected.weight.z});
        CHECK(drawn[i].alpha == expected.alpha);
        if (expected.pdf == 0) continue;
        CHECK(test::need(file.pdf_at(level, 0.3, 0.4, drawn[i].light, view)) == expected.pdf);
        const auto f = test::need(file.evaluate_at(level, 0.3, 0.4, drawn[i].light, view));
        CHECK(drawn[i].weight[1] * drawn[i].pdf == doctest::Approx(f.rgb[1]).epsilon(1e-6));
      }
    }
  }
  CHECK(front.sample_at(0, 0.3, 0.4, {0, 0, 1}, {1, 1, 1}));
  CHECK_FALSE(front.sample_at(0, 0.3, 0.4, {0, 0, 1}, {0.5F, 1.5F, 0}));
  CHECK_FALSE(front.sample_at(0, 0.3, 0.4, std::span(views).first(3), randoms, drawn));
  CHECK_FALSE(front.pdf_at(std::numeric_limits<double>::infinity(), 0, 0, view, view));
  CHECK(test::need(front.sample_at(0, 0.3, 0.4, {0, 0, -1}, {0.5F, 0.5F, 0})).pdf == 0);
  // One side alone looks the same from behind.
  const Written written;
  const auto part = test::need(FabricFile::open(written.path));
  CHECK(test::need(part.turned_over()).evaluate_at(1, 0.4, 0.4, view, view)->rgb ==
        part.evaluate_at(1, 0.4, 0.4, view, view)->rgb);
  CHECK(part.sample_at(1, 0.4, 0.4, view, {0, 0, 0}));
}
