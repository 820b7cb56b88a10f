#include "format/cells/cell_image.h"

#include <ImathVec.h>
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "format/fabric/file.h"
#include "format/fabric/lifted.h"
#include "format/fabric/yarn_sky.h"
#include "tests/format/cells/shade_points.h"
#include "tests/format/fabrics.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"

namespace selvedge {
namespace {

constexpr V2f period(2.5F, 1.75F);
constexpr float plane = 0.3F;

/// Glossy curves with strands and thick places, one turned over, some of plies.
YarnData stranded(Random& random, bool hairs) {
  YarnData data = test::plied(test::tangle(random, period, 6));
  for (std::size_t c = 0; c < data.curves.size(); ++c) {
    YarnCurve& curve = data.curves[c];
    curve.gloss = {0.3F, 0.4F, c % 2 == 0 ? 0.75F : 0.0F};
    curve.fibre_slope = 0.4F;
    if (hairs) curve.hairs = {c == 4 ? -60 : 60, 0.4F, 0.3F, 0.02F, 0.9F};
    if (c % 2 == 1) curve.flattening = 0.5F;
    if (c % 3 == 0) continue;  // smooth
    const int count = static_cast<int>(5 + 7 * c);
    curve.strands = {c == 4 ? -count : count, 5, -17, static_cast<int>(c), 0.2F, 3,
                     default_contrast,        0, 0.5F};
  }
  return data;
}

CellImage image_of(const CellYarn& cell, const CellView& view) {
  CellShadows shadows(cell);
  CellScratch scratch;
  CellImage image;
  make_cell_image({&cell, &shadows}, view, scratch, image);
  return image;
}

/// The finest piece of each segment: pieces are sorted, plies before hairs.
std::vector<std::int32_t> pieces_of_segments(const Yarns& yarns) {
  std::vector<std::int32_t> numbers;
  std::int32_t plies = 0;
  std::int32_t hairs = 0;
  for (const Yarns::Segment& s : yarns.geometry().segments) plies += s.hair_threshold > 0 ? 0 : 1;
  std::int32_t ply = 0;
  for (const Yarns::Segment& s : yarns.geometry().segments)
    numbers.push_back(s.hair_threshold > 0 ? plies + hairs++ : ply++);
  return numbers;
}

}  // namespace

TEST_CASE("a point of an image is lit as Yarns lights it: strands, gloss, indirect light, light through") {
  Random random(3);
  YarnData data = stranded(random, true);
  for (float& value : data.station_light) value *= static_cast<float>(0.5 + random.uniform());
  data.light_through = data.station_light;
  const Yarns yarns(std::move(data), period);
  const CellYarn cell(yarns, plane, {});
  const std::vector<std::int32_t> numbers = pieces_of_segments(yarns);
  int seen = 0;
  int of_hairs = 0;
  int apart = 0;
  for (int round = 0; round < 400; ++round) {
    CellView view{.view = test::random_direction(random, 0.1),
                  .lamps = {{test::random_direction(random, 0.1), V3f(1, 2, 3)},
                            {test::random_direction(random, 0.1), V3f(0.5F)}}};
    const bool behind = round % 2 == 1;
    if (behind) view.lamps[1].direction.z *= -1;
    std::vector<test::CellPoint> points;
    std::vector<V3f> expected;
    for (int i = 0; i < 40; ++i) {
      const auto hit = yarns.trace(V2d(random.uniform(), random.uniform()), plane, view.view);
      if (!hit) continue;
      YarnPoint point = yarns.point_at(*hit);
      yarns.perturb_by_strands(point, view.view);
      V3f sum(0, 0, 0);
      for (const CellLamp& lamp : view.lamps) {
        const V3f above(lamp.direction.x, lamp.direction.y, std::abs(lamp.direction.z));
        const bool through = lamp.direction.z < 0;
        const float by_view = through ? 1 : yarns.lustre_view_factor(point, view.view);
        sum += indirect_light(yarns.transfer_at(point, through), above) * (point.brightness * by_view) *
               lamp.irradiance;
        if (!through) sum += yarns.direct_reflectance(point, lamp.direction, view.view) * lamp.irradiance;
      }
      points.push_back({numbers[hit->segment], hit->start_offset});
      expected.push_back(sum);
      of_hairs += point.is_hair ? 1 : 0;
    }
    const std::vector<V3f> found = test::shade_points(cell, cell.pieces(0), view, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ++seen;
      apart += (found[i] - expected[i]).length() < 1e-3F * (1 + expected[i].length()) ? 0 : 1;
    }
  }
  MESSAGE(apart, " of ", seen);
  CHECK(seen > 5000);
  CHECK(of_hairs > 500);
  // Rounding takes either of two strands within 10^-4 of their edge.
  CHECK(apart < seen / 500);
}

TEST_CASE("the splatter sees what rays see, from everywhere, hairs and flat sections included") {
  Random random(5);
  for (const bool hairs : {false, true}) {
    // As smooth as fabrics: pieces have no balls at their joints.
    YarnData data = stranded(random, hairs);
    data.nodes.clear();
    for (std::size_t c = 0; c < data.curves.size(); ++c) {
      YarnCurve& curve = data.curves[c];
      curve.nodes = 64;
      curve.repeat_offset = c % 2 == 0 ? V2i(1, 0) : V2i(0, 1);
      for (int i = 0; i < curve.nodes; ++i) {
        const float fraction = static_cast<float>(i) / 64;
        const float wave =
            0.15F * std::sin(2 * std::numbers::pi_v<float> * (fraction + 0.2F * static_cast<float>(c)));
        const float side = 0.3F * static_cast<float>(c) + wave;
        data.nodes.push_back(c % 2 == 0 ? V3f(fraction * period.x, side, plane + wave)
                                        : V3f(side, fraction * period.y, plane - wave));
      }
    }
    const Yarns yarns(std::move(data), period);
    const CellYarn cell(yarns, plane, {});
    int apart = 0;
    int count = 0;
    for (int round = 0; round < 12; ++round) {
      const V3f view = test::random_direction(random, round < 2 ? 0.06 : 0.3);
      DepthGrid grid;
      grid.resize({.repeat_samples = {90, 50}}, true);
      splat(cell, cell.pieces(0), {ray_slope(view), 0, true}, grid);
      for (int row = 0; row < grid.height; ++row) {
        for (int column = 0; column < grid.width; ++column) {
          const V2d uv((column + 0.5) / grid.width, -(row + 0.5) / grid.height);
          const auto hit = yarns.trace(uv, plane, view);
          const float z = grid.z[static_cast<std::size_t>(row) * grid.stride + column];
          const bool met = z > no_depth;
          ++count;
          if (met != hit.has_value()) {
            ++apart;
          } else if (hit) {
            const float depth = yarns.geometry().segments[hit->segment].start.z + hit->start_offset.z;
            apart += std::abs(z - depth) < 0.02F ? 0 : 1;
          }
        }
      }
    }
    MESSAGE(apart, " of ", count);
    CHECK(apart < count / 50);
  }
}

TEST_CASE("the splatter sees what rays see of a map, where stitches hang over their borders") {
  Random random(5);
  const V2i kinds(3, 2);
  YarnData data = test::lines_of(kinds, std::array{0, 1, 2, 3, 4, 5});
  data.map = {kinds, {4, 3}, {0, 5, 2, 4, 3, 3, 1, 0, 2, 4, 4, 5}, {0, 1, 0, 1, 2}};
  for (YarnCurve& curve : data.curves) curve.hairs = {20, 0.5F, 0.25F, 0.02F, 1};
  const Yarns yarns(std::move(data), V2f(kinds));
  const CellYarn cell(yarns, 0.5F, {});
  const YarnPieces& pieces = cell.pieces(0);
  int apart = 0, count = 0;
  for (int round = 0; round < 6; ++round) {
    const V3f view = test::random_direction(random, 0.3);
    const CellSize size{.repeat_samples = V2i(16 * map_tile_stitches),
                        .window_origin = {16 * (3 + round), 32},
                        .window_samples = {96, 80},
                        .shows_map = true,
                        .first_stitch = {-2, 3}};
    DepthGrid grid;
    grid.resize(size, true);
    splat(cell, pieces, {ray_slope(view), 0, true}, grid);
    for (int i = 0; i < grid.width * grid.height; ++i) {
      const V2i texel(i % grid.width, i / grid.width);
      const V2d stitch = V2d(size.first_stitch) + (V2d(size.window_origin + texel) + V2d(0.5)) / 16.0;
      const auto hit = yarns.trace(V2d(stitch.x / 4, -stitch.y / 3), 0.5F, view);
      const float z = grid.z[static_cast<std::size_t>(texel.y) * grid.stride + texel.x];
      const float met =
          hit ? yarns.geometry().segments[hit->segment].start.z + hit->start_offset.z : no_depth;
      ++count;
      apart += std::abs(z - met) < 0.02F ? 0 : 1;
    }
  }
  MESSAGE(apart, " of ", count);
  CHECK(apart < count / 20);
}

TEST_CASE("fewer hairs of a large cell cover from afar what all cover close by") {
  Random random(7);
  YarnData data = stranded(random, true);
  for (YarnCurve& curve : data.curves) curve.hairs.count *= 40;
  const Yarns yarns(std::move(data), period);
  const CellYarn cell(yarns, plane, {});
  const auto cover_of = [](const YarnPieces& pieces) {
    double cover = 0;
    for (int i = pieces.ply_piece_count; i < pieces.count(); ++i)
      cover += static_cast<double>(pieces.numbers[YarnPieces::radius][i] * pieces.segment(i).along.length());
    return cover;
  };
  const YarnPieces& all = cell.pieces(0);
  const int all_hairs = all.count() - all.ply_piece_count;
  int last = all_hairs + 1;
  for (const float longest : {0.0F, 0.2F, 0.4F, 0.8F}) {
    CAPTURE(longest);
    const YarnPieces& some = cell.pieces(longest);
    const int hairs = some.count() - some.ply_piece_count;
    CHECK(hairs <= last);
    // Four standard errors of hairs whose covers differ by as much as their mean.
    CHECK(std::abs(cover_of(some) / cover_of(all) - 1) < 4 / std::sqrt(hairs / (hair_point_count - 1.0)));
    last = hairs;
  }
  CHECK(last < all_hairs / 2);
}

TEST_CASE("hairs drawn as lines are as bright and as opaque as fine samples of them") {
  Random random(11);
  const Yarns yarns(stranded(random, true), period);
  const CellYarn cell(yarns, plane, {});
  CellShadows shadows(cell);
  CellView view{.view = V3f(0.2F, -0.3F, 0.9F).normalized(),
                .lamps = {{V3f(-0.4F, 0.3F, 0.8F).normalized(), V3f(1, 1, 1)}}};
  const V2f pixel(1 / 12.0F, 1 / 12.0F);
  view.hair_shadows = false;
  CellScratch scratch;
  const auto mean = [&](float samples, float detail) {
    view.size = cell_size(pixel, samples);
    // Hairs as wide, whatever the samples.
    view.rays_per_pixel_side = detail;
    CellImage image;
    make_cell_image({&cell, &shadows, nullptr}, view, scratch, image);
    Imath::V4d sum(0, 0, 0, 0);
    for (const Group& sample : scratch.samples) sum += Imath::V4d(sample[0], sample[1], sample[2], sample[3]);
    return sum / static_cast<double>(scratch.samples.size());
  };
  const Imath::V4d lines = mean(4, 64);
  const Imath::V4d fine = mean(64, 64);
  view.has_hairs = false;
  const Imath::V4d none = mean(4, 64);
  CHECK(fine.w > none.w + 0.02);
  for (int k = 0; k < 4; ++k) CHECK(std::abs(lines[k] - fine[k]) < 0.03 * fine[k]);
}

TEST_CASE("an image has the mean radiance and opacity of rays with shadows, whatever its size") {
  Random random(7);
  const Yarns yarns(stranded(random, false), period);
  const CellYarn cell(yarns, plane, {});
  CellView view{.view = V3f(0.3F, -0.2F, 0.9F).normalized(),
                .lamps = {{V3f(-0.5F, 0.3F, 0.8F).normalized(), V3f(1, 1, 1)}}};
  V3d radiance(0, 0, 0);
  double opacity = 0;
  constexpr int side = 160;
  for (int i = 0; i < side * side; ++i) {
    const V2d uv((i % side + 0.5) / side, (i / side + 0.5) / side);  // NOLINT: whole rows
    const Shading s = yarns.shade(uv, plane, view.lamps[0].direction, view.view);
    radiance += V3d(s.radiance) * static_cast<double>(s.alpha) / (side * side);
    opacity += static_cast<double>(s.alpha) / (side * side);
  }
  struct Case {
    float pixel;
    float samples;
    bool coarse;
    double error;
  };
  for (const Case& example : {Case{1 / 40.0F, 4, false, 0.01}, Case{1 / 10.0F, 4, false, 0.02},
                              Case{1 / 20.0F, 2, true, 0.03}, Case{1 / 4.0F, 4, false, 0.03}}) {
    CAPTURE(example.pixel);
    view.size = cell_size({example.pixel, example.pixel}, example.samples);
    view.shading_block_size = example.coarse ? 2 : 1;
    view.shadow_texels_per_pixel = 4;
    const CellImage image = image_of(cell, view);
    V3d sum(0, 0, 0);
    double alpha = 0;
    const auto number = [](std::uint16_t bits) {
      return std::ldexp(static_cast<double>(bits % 2048 + (bits >= 2048 ? 2048 : 0)),
                        std::max(bits / 2048, 1) - 26);
    };
    for (int i = 0; i < image.width * image.height; ++i) {
      const CellTexel& t = image.texels[i / image.width * image.stride() + i % image.width];
      sum += V3d(number(t[0]), number(t[1]), number(t[2])) * static_cast<double>(image.radiance_scale);
      alpha += number(t[3]);
    }
    for (int row = 0; row <= image.height; ++row)
      CHECK(image.texels[row * image.stride()] == image.texels[row * image.stride() + image.width]);
    const auto count = static_cast<double>(image.width) * image.height;
    CHECK(alpha / count == doctest::Approx(opacity).epsilon(example.error));
    CHECK(sum.x / count == doctest::Approx(radiance.x).epsilon(example.error));
    CHECK(sum.z / count == doctest::Approx(radiance.z).epsilon(example.error));
  }
}

TEST_CASE("images of cells of 0.01 mm and 10 m, of grazing views and lights, and of odd sizes are finite") {
  Random random(9);
  for (const float scale : {0.004F, 1.0F, 4000.0F}) {
    YarnData data = stranded(random, true);
    for (V3f& node : data.nodes) node *= scale;
    for (YarnCurve& curve : data.curves) {
      curve.radius *= scale;
      curve.hairs.mean_length *= scale;
      curve.hairs.radius *= scale;
    }
    const Yarns yarns(std::move(data), period * scale);
    const std::vector<float> sky = sky_transfer(yarns);
    const CellYarn cell(yarns, plane * scale, sky);
    for (const V2f& pixel : {V2f(0.01F, 1.0F), V2f(1000.0F, 1e-9F), V2f(0.1F, 0.1F)}) {
      CellView view{
          .view = V3f(0.99996F, 0.001F, 0.0087F).normalized(),
          .lamps = {{V3f(-0.9999F, 0.01F, 0.001F).normalized(), V3f(1e12F), 0}, {V3f(0, 0, -1), V3f(1), 1}}};
      view.environment.emplace().coefficients.fill(V3f(0.5F));
      view.plane_count = 2;
      view.size = cell_size(pixel, 2);
      CHECK(view.size.repeat_samples.x <= max_cell_samples);
      CHECK(view.size.repeat_samples.y >= min_cell_texels);
      const CellImage image = image_of(cell, view);
      CHECK(std::isfinite(image.radiance_scale));
      CHECK(image.texels.size() == 2 * image.plane_texels());
    }
  }
}

TEST_CASE("the sky of yarn follows its colour and its place, whatever yarn came before") {
  Random random(9);
  YarnData data = stranded(random, true);
  for (std::vector<float>* light : {&data.station_light, &data.light_through})
    std::ranges::fill(*light, 0.0F);
  for (YarnCurve& curve : data.curves) curve.gloss.weight = 0;
  const std::vector<float> bright = sky_transfer(Yarns(data, period));
  for (YarnCurve& curve : data.curves) curve.albedo *= 0.5F;
  const std::vector<float> dark = sky_transfer(Yarns(data, period));
  CHECK(std::ranges::any_of(dark, [](float value) { return value != 0; }));
  CHECK(std::ranges::equal(dark, bright, {}, {}, [](float value) { return value / 2; }));
  for (std::size_t i = 0; i < data.nodes.size() / 2; ++i) data.nodes[i].z += 0.1F;
  CHECK(sky_transfer(Yarns(data, period)) != dark);
}

TEST_CASE("the sky of cloth by grids is about the sky by rays") {
  const Fabric fabric = test::need(read_fabric(SELVEDGE_SOURCE_DIR "/tests/data/kept/4.0/yarn.fabric.exr"));
  YarnData data = fabric.levels.front().yarns()->data();
  const V2f repeat = fabric.levels.front().yarns()->period();
  for (std::vector<float>* light : {&data.station_light, &data.light_through})
    std::ranges::fill(*light, 0.0F);
  const std::vector<float> traced = sky_transfer(Yarns(data, repeat));
  // Yarn that lies as the last one keeps its sky.
  const Yarns wider(data, repeat * 1.00001F);
  const CellYarn cell(wider, fabric.reference_height, {});
  const std::vector<float> cast = sky_transfer(wider, CellShadows(cell).sky_caster());
  double square = 0;
  double all = 0;
  std::array<double, 2> means{};  // of all coefficients
  for (std::size_t i = 0; i < traced.size(); ++i) {
    square += std::pow(cast[i] - traced[i], 2);
    all += std::pow(traced[i], 2);
    means[0] += std::abs(traced[i]);
    means[1] += std::abs(cast[i]);
  }
  CHECK(std::sqrt(square / all) < 0.15);
  CHECK(means[1] == doctest::Approx(means[0]).epsilon(0.03));
}

TEST_CASE("a thousand fat curves in a cell are refused, and as many as may be make an image") {
  constexpr float side = 2;
  constexpr std::size_t most = 29;
  Random random(4);
  YarnData fat;
  for (std::size_t c = 0; c < 1000; ++c) {
    const YarnData one = test::straight(side, 3.9F);
    const V3f moved(0, side * static_cast<float>(random.uniform()), static_cast<float>(random.uniform()));
    for (const V3f& node : one.nodes) fat.nodes.push_back(node + moved);
    fat.curves.push_back(one.curves[0]);
    fat.station_light.insert(fat.station_light.end(), one.station_light.begin(), one.station_light.end());
  }
  CHECK(test::error_of(validate(fat, {side, side})).place == "curve 29");
  fat.curves.resize(most);
  fat.nodes.resize(4 * most);
  fat.station_light.resize(most * light_values_per_station);
  test::need(validate(fat, {side, side}));
  const Yarns yarns(std::move(fat), {side, side});
  const CellYarn cell(yarns, 1, {});
  CellView view{.lamps = {{V3f(0.9999F, 0.01F, 0.001F).normalized(), V3f(1)}},
                .size = cell_size({1 / 64.0F, 1 / 64.0F}, 4)};
  const CellImage image = image_of(cell, view);
  CHECK(std::isfinite(image.radiance_scale));
  for (const CellTexel& texel : image.texels) CHECK(texel[3] == image.texels[0][3]);
}

TEST_CASE("lamps from nearly one direction share a grid, whose shadows move by a texel at most") {
  Random random(5);
  const Yarns yarns(stranded(random, false), period);
  const CellYarn cell(yarns, plane, {});
  CellShadows shadows(cell);
  constexpr std::size_t max_bytes = 1 << 21;
  shadows.set_memory(max_bytes);
  const float relief = yarns.geometry().max_z - yarns.geometry().min_z;
  for (int i = 0; i < 100; ++i) {
    const V3f direction = test::random_direction(random, 0.02);
    const ShadowDetail detail{0.01F, 2, 0.25F, true};
    const auto shadow = shadows.cast(direction, detail);
    const V2f slope = shadow->slope;
    const V2f moved = (ray_slope(direction) - slope) * relief;
    // Texels, as asked for, are as much longer along the slope.
    CHECK(std::abs(moved.x) <= 1.12F * detail.texel_width * std::sqrt(1 + slope.x * slope.x));
    CHECK(std::abs(moved.y) <= 1.12F * detail.texel_width * std::sqrt(1 + slope.y * slope.y));
    CellShadows others(cell);
    others.cast(test::random_direction(random, 0.02), detail);
    const auto other = others.cast(direction, detail);
    DepthGrid whole;
    whole.resize(shadow->grid.size, false);
    splat(cell, cell.pieces(2 * detail.texel_width), {slope, 0.25F * detail.texel_width, true}, whole);
    CHECK(shadow->grid.z == whole.z);
    CHECK(other->grid.z == whole.z);
    CHECK(shadows.bytes() <= max_bytes);
    CHECK(shadows.cast(direction, detail) == shadow);
    CHECK(shadows.cast(direction, {0.005F, 2, 0.25F, true}) != shadow);
    // The thinnest ply bounds the texels.
    CHECK(shadows.cast(direction, {1, 2, 0.25F, true}) == shadows.cast(direction, {2, 2, 0.25F, true}));
  }
}

TEST_CASE("the grid of a window shades its points as a whole one does") {
  Random random(6);
  const Yarns yarns(stranded(random, false), period);
  const CellYarn cell(yarns, plane, {});
  CellShadows shadows(cell);
  const V2f heights(yarns.geometry().min_z, yarns.geometry().max_z);
  const auto is_lit = [&](const CellShadow& shadow, const V3f& point) {
    std::array<int, 2> texel{};
    for (int axis = 0; axis < 2; ++axis) {
      const float texels = static_cast<float>(shadow.grid.period[axis]);
      const float at = (point[axis] - (point.z - plane) * shadow.slope[axis]) * texels / period[axis] -
                       static_cast<float>(shadow.grid.window_origin[axis]);
      texel[axis] = static_cast<int>(at - std::floor(at / texels) * texels);
    }
    REQUIRE(texel[0] < shadow.grid.width);
    REQUIRE(texel[1] < shadow.grid.height);
    return shadow.grid.z[std::size_t{1} * texel[1] * shadow.grid.stride + texel[0]] <= point.z;
  };
  int same = 0;
  int count = 0;
  for (int i = 0; i < 50; ++i) {
    const V3f direction = test::random_direction(random, 0.2);
    const V2f slope = ray_slope(test::random_direction(random, 0.2));
    CellSize image{.repeat_samples = {64, 64}, .window_samples = {16, 16}};
    for (int axis = 0; axis < 2; ++axis) image.window_origin[axis] = static_cast<int>(random.uniform() * 64);
    const ShadowDetail detail{0.01F, 2, 0.25F, true};
    const auto own = shadows.cast(direction, detail, {image, slope, heights});
    const auto whole = shadows.cast(direction, detail);
    for (int k = 0; k < 200; ++k, ++count) {
      V3f point(0, 0, heights.x + static_cast<float>(random.uniform()) * (heights.y - heights.x));
      for (int axis = 0; axis < 2; ++axis)
        point[axis] =
            (static_cast<float>(image.window_origin[axis]) + 16 * static_cast<float>(random.uniform())) *
                period[axis] / 64 +
            slope[axis] * (point.z - plane);
      same += is_lit(*own, point) == is_lit(*whole, point) ? 1 : 0;
    }
  }
  CHECK(same > 0.97 * count);
}

}  // namespace selvedge
