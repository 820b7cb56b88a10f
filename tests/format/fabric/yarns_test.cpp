#include "format/fabric/yarns.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "format/fabric/header.h"
#include "tests/format/fabrics.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

struct Entry {
  double distance = std::numeric_limits<double>::max();
  int segment = -1;
};

/// The ends of a segment of a curve, of which the first node has the number `first`.
std::array<V3d, 2> ends_of(const YarnData& data, const V2f& period, const YarnCurve& curve, int first,
                           int i) {
  V3d end(data.nodes[first + (i + 1) % curve.nodes]);
  if (i + 1 == curve.nodes)
    end += V3d(curve.repeat_offset.x, curve.repeat_offset.y, 0) * V3d(period.x, period.y, 0);
  return {V3d(data.nodes[first + i]), end};
}

/// The same by its definition, in double precision: every segment and its copies, one after the other.
Entry first_entry(const YarnData& data, const V2f& period, const V3d& origin, const V3d& d, double length,
                  double from) {
  const V3d end = origin + d * length;
  Entry best;
  int first = 0;
  for (const YarnCurve& curve : data.curves) {
    const auto r = static_cast<double>(curve.radius);
    for (int i = 0; i < curve.nodes; ++i) {
      const auto [a, b] = ends_of(data, period, curve, first, i);
      const V3d axis = (b - a).normalized();
      const V3d normal = d.cross(axis);
      const double reach = (b - a).length() + r;
      const auto copies = [&](int k) {  // that the ray can come near to
        const auto p = static_cast<double>(period[k]);
        return V2i(static_cast<int>(std::ceil((std::min(origin[k], end[k]) - reach - a[k]) / p)),
                   static_cast<int>(std::floor((std::max(origin[k], end[k]) + reach - a[k]) / p)));
      };
      for (int sx = copies(0).x; sx <= copies(0).y; ++sx) {
        for (int sy = copies(1).x; sy <= copies(1).y; ++sy) {
          const V3d off = origin - a - V3d(sx, sy, 0) * V3d(period.x, period.y, 0);
          if (off.cross(d).length() > reach) continue;  // passes far by
          const double h = normal.length2() * r * r - std::pow(off.dot(normal), 2);
          const auto meet = [&](double t) {
            if (t > from && t < best.distance) best = {t, first + i};
          };
          const double along = axis.dot(off);
          if (h > 0) {
            const double t = (along * axis.dot(d) - d.dot(off) - std::sqrt(h)) / normal.length2();
            const double at = along + t * axis.dot(d);
            if (at > 0 && at < (b - a).length()) meet(t);
          }
          const double g = r * r - off.cross(d).length2();
          if (g > 0) meet(-d.dot(off) - std::sqrt(g));
        }
      }
    }
    first += curve.nodes;
  }
  return best;
}

/// Whether a point lies within any segment or copy of it.
bool is_inside(const YarnData& data, const V2f& period, const V3d& point) {
  int first = 0;
  for (const YarnCurve& curve : data.curves) {
    for (int i = 0; i < curve.nodes; ++i) {
      const auto [a, b] = ends_of(data, period, curve, first, i);
      const V3d axis = (b - a).normalized();
      for (int sx = -2; sx <= 2; ++sx) {
        for (int sy = -2; sy <= 2; ++sy) {
          V3d off = point - a;
          for (int k = 0; k < 2; ++k) {
            const auto p = static_cast<double>(period[k]);
            off[k] -= (std::round(off[k] / p) + (k == 0 ? sx : sy)) * p;
          }
          const double along = std::clamp(axis.dot(off), 0.0, (b - a).length());
          if ((off - axis * along).length() < static_cast<double>(curve.radius)) return true;
        }
      }
    }
    first += curve.nodes;
  }
  return false;
}

}  // namespace

TEST_CASE("a straight yarn covers its width, and its surface is a cylinder's") {
  const Yarns yarns(straight(2, 0.5F), {2, 2});
  int met = 0;
  for (int i = 0; i < 1000; ++i) {
    const double v = (i + 0.5) / 1000;
    const auto hit = yarns.trace({0.3, v}, 0.5F, {0, 0, 1});
    const double off = std::abs(2 * v - 1);  // mm from the axis
    CHECK(hit.has_value() == (off < 0.5));
    if (!hit) continue;
    ++met;
    const YarnPoint point = yarns.point_at(*hit);
    CHECK(std::abs(static_cast<double>(point.normal.z) - std::sqrt(1 - 4 * off * off)) < 2e-5);
    CHECK(static_cast<double>(point.fibre.x) == doctest::Approx(1));
  }
  CHECK(met == 500);
}

TEST_CASE(
    "what rays meet and what hides the light is what the segments say in double precision, at any size, far "
    "away and a tenth of a degree above the cloth") {
  Random random(7);
  int differ = 0;
  int elsewhere = 0;
  int shadows_differ = 0;
  int met = 0;
  int hidden = 0;
  constexpr int rays = 60000;
  for (int scene = 0; scene < 3; ++scene) {
    const float unit = std::array{1.0F, 0.01F, 10000.0F}[static_cast<std::size_t>(scene)];
    const V2f period = V2f(2.5F, 1.75F) * unit;
    const YarnData data = tangle(random, period, 3 + 2 * scene);
    REQUIRE(validate(data, period));
    const Yarns yarns(data, period);
    const float high = yarns.geometry().max_z;
    const float low = yarns.geometry().min_z;
    const float plane = 0.1F * unit;
    const auto way = [&](double from, double to, const V3d& d) { return (to - from) / d.z; };
    for (int i = 0; i < rays / 3; ++i) {
      const V2d uv(random.uniform() * 6 - 3, random.uniform() * 6 - 3);
      const bool grazes = i % 32 < 2;
      const V3f view = grazes ? random_direction(random, 0.001, 0.002) : random_direction(random, 0.06);
      V3d up(view);
      up.z = std::max(up.z, 1.0 / 32);
      up.normalize();
      const V3d at(uv.x * static_cast<double>(period.x), -uv.y * static_cast<double>(period.y),
                   static_cast<double>(plane));
      const V3d origin = at + up * way(plane, high, up);
      const Entry truth = first_entry(data, period, origin, -up, way(low, high, up), 0);
      // Whole repeats are exact in double precision, so that the truth may leave them out.
      const V2d away = i % 2 == 0 ? V2d(0) : V2d(10000, -10000);
      const auto hit = yarns.trace(uv + away, plane, view);
      met += truth.segment >= 0 ? 1 : 0;
      if (hit.has_value() != (truth.segment >= 0)) ++differ;
      if (!hit || truth.segment < 0) continue;
      const V3d place = origin - up * truth.distance;
      V3d off = V3d(data.nodes[hit->segment]) + V3d(hit->start_offset) - place;
      for (int k = 0; k < 2; ++k) off[k] -= std::round(off[k] / period[k]) * period[k];
      const auto radius = static_cast<double>(data.curves[hit->segment / 12].radius);
      // Where a ray grazes a yarn, rounding moves the point by the root of itself.
      if (off.length() > 0.01 * radius) ++elsewhere;

      const YarnPoint point = yarns.point_at(*hit);
      CHECK(std::isfinite(yarns.shade(uv, plane, view, view).radiance.length2()));
      const V3f light = random_direction(random, 0.06);
      if (!(point.normal.dot(light) > 0)) continue;
      const V3d start =
          V3d(data.nodes[hit->segment]) + V3d(hit->start_offset) + V3d(point.normal) * (radius / 64);
      const V3d towards = V3d(light).normalized();
      const bool shadow =
          is_inside(data, period, start) ||
          first_entry(data, period, start, towards, way(start.z, high, towards), 0).segment >= 0;
      hidden += shadow ? 1 : 0;
      if (yarns.is_occluded(*hit, point, light) != shadow) ++shadows_differ;
    }
  }
  CHECK(met > rays / 4);
  CHECK(hidden > met / 10);
  // None of 3,000,000 rays met yarn that is not there or missed what is, and 2 met another yarn behind.
  CHECK(differ == 0);
  CHECK(elsewhere <= 1);
  CHECK(shadows_differ <= 1);
}

TEST_CASE("below the horizon nothing is lit, and opacity is the rim's") {
  const Yarns yarns(straight(2, 0.5F), {2, 2});
  const Shading low = yarns.shade({0.1, 0.5}, 0.5F, {0, 0, 1}, V3f(0.6F, 0.0F, -0.8F));
  CHECK(low.alpha == yarns.shade({0.1, 0.5}, 0.5F, {0, 0, 1}, V3f(1, 0, 0)).alpha);
  CHECK(low.radiance == V3f(0, 0, 0));
  CHECK(yarns.shade({0.1, 0.5}, 0.5F, V3f(1, 0, 0), {0, 0, 1}).radiance == V3f(0, 0, 0));
}

TEST_CASE("a yarn of albedo 1 under its own sun reflects what a Lambert cylinder does") {
  YarnData data = straight(2, 0.5F);
  data.curves[0].albedo = {1, 0.5F, 0.25F};
  const Yarns yarns(data, {2, 2});
  const Shading top = yarns.shade({0.4, 0.5}, 0.5F, {0, 0, 1}, {0, 0, 1});
  CHECK(top.alpha == 1);
  CHECK(top.radiance.x == doctest::Approx(std::numbers::inv_pi_v<float>));
  CHECK(top.radiance.z == doctest::Approx(0.25F * std::numbers::inv_pi_v<float>));
  // Halfway to the edge the normal leans by 30 degrees.
  const Shading side = yarns.shade({0.4, 0.5 - 0.125}, 0.5F, {0, 0, 1}, {0, 0, 1});
  CHECK(static_cast<double>(side.radiance.x) == doctest::Approx(std::sqrt(0.75) / std::numbers::pi));
}

TEST_CASE(
    "indirect light is the sum that the header states, the angle counted from the first direction across") {
  YarnData data = straight(2, 0.5F);
  data.curves[0].albedo = {0, 0, 0};
  // One coefficient at a time: function i of the angle, k of the light, red.
  const V3f light = V3f(0.2F, 0.5F, 0.8F).normalized();
  const auto by_light = light_basis(light);
  for (int i = 0; i < angle_function_count; ++i) {
    for (int k = 0; k < yarn_light_function_count; ++k) {
      std::fill(data.station_light.begin(), data.station_light.end(), 0.0F);
      data.station_light[(i * yarn_light_function_count + k) * 3] = 1;
      const Yarns yarns(data, {2, 2});
      // Along x the angle is 0 at the top and grows towards -y, which is growing v.
      const double angle = std::asin(0.5);
      const std::array<double, 5> by_angle{1, std::cos(angle), std::sin(angle), std::cos(2 * angle),
                                           std::sin(2 * angle)};
      const Shading s = yarns.shade({0.4, 0.5 + 0.125}, 0.5F, light, {0, 0, 1});
      CHECK(static_cast<double>(s.radiance.x) ==
            doctest::Approx(std::max(0.0, by_angle[i] * static_cast<double>(by_light[k]))).epsilon(1e-4));
    }
  }
}

TEST_CASE("refuses plies of more nodes than a file may have, and plies that stand still") {
  YarnData data = straight(2, 0.04F);
  data.curves[0].nodes = 4096;
  data.curves[0].repeat_offset = {64, 0};
  data.nodes.clear();
  for (int i = 0; i < 4096; ++i) data.nodes.emplace_back(static_cast<float>(i) / 32, 1, 0.5F);
  data.curves[0].plies = {4, 64, 0, 0, {0, 0, 0}};
  CHECK(validate(data, {2, 2}));
  data.curves[0].plies.count = 5;
  CHECK(validate(data, {2, 2}).error().place == "nodes");
  // A ring as narrow as the way from its axis to a ply in the middle.
  data.curves[0].repeat_offset = {0, 0};
  data.curves[0].radius = 0.5F;
  data.curves[0].nodes = 4;
  data.curves[0].plies = {2, 1, 0, 0, {0, 0, 0}};
  data.nodes = {{1.25F, 1, 0.5F}, {1, 1.25F, 0.5F}, {0.75F, 1, 0.5F}, {1, 0.75F, 0.5F}};
  CHECK(validate(data, {2, 2}));
  data.curves[0].plies.phase = 1.57079637F;
  CHECK(validate(data, {2, 2}).error().place == "curve 0");
}

TEST_CASE("values of yarn have all fields, then the nodes, and fewer or more fields are read") {
  const V2f period(2, 2);
  YarnData data = straight(2, 0.5F);
  data.curves[0].gloss.lustre = 0.625F;
  data.curves[0].plies = {3, 8, -7, 0.75F, {0.5F, 0.25F, -0.125F}, 1};
  data.curves[0].strands = {-45, 6, 135, 77, 0.25F, 3, 0.375F, 0.5F, 0.25F};
  const YarnCounts counts = counts_of(data);
  CHECK(counts.values_per_curve == 36);
  const auto read = [&](std::vector<float> values, int fields) {
    values.insert(values.begin() + 36, 9.0F);  // of a later version
    values.erase(values.begin() + fields, values.begin() + 37);
    YarnCounts changed = counts;
    changed.values_per_curve = fields;
    return need(yarns_from_values(values, indirect_values(data), changed, period));
  };
  const std::vector<float> values = curve_values(data);
  CHECK(values.size() == static_cast<std::size_t>(curve_value_count(counts)));
  CHECK(values[36] == data.nodes[0].x);
  CHECK(read(values, 36) == data);
  CHECK(read(values, 37) == data);
  CHECK(read(values, 31).curves[0].strands.contrast == default_contrast);
  CHECK(read(values, 14).curves[0].plies.shift == -7);
  CHECK(read(values, 11).curves[0].plies == YarnPlies());
}

TEST_CASE("plies of a straight yarn are the helices of the formula, right-handed for a positive shift") {
  for (const int shift : {4, -5}) {
    YarnData data = straight(2, 0.5F);
    data.curves[0].plies = {3, 8, shift, 0.75F, {0, 0, 0}};
    REQUIRE(validate(data, {2, 2}));
    const Yarns yarns(data, {2, 2});
    const auto segments = yarns.geometry().segments;
    REQUIRE(segments.size() == 3 * 4 * 8);
    const double radius = 0.5 * unit_ply_radius(3);
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const double fraction = static_cast<double>(i % 32) / 32;
      const double angle = 0.75 + 2 * std::numbers::pi * (static_cast<double>(i / 32) + shift * fraction) / 3;
      // Along x, angle 0 is up and a right angle is x cross z, which is -y.
      const V3d out(0, -std::sin(angle), std::cos(angle));
      const V3d place = V3d(2 * fraction, 1, 0.5) + out * (0.5 - radius);
      CHECK((V3d(segments[i].start) - place).length() < 1e-6);
      CHECK((V3d(segments[i].axis_to_ply[0]) - out).length() < 1e-6);
      CHECK(static_cast<double>(segments[i].radius) == doctest::Approx(radius));
      CHECK(static_cast<double>(segments[i].start_station) == doctest::Approx(fraction));
      // The last segment of a ply reaches the first of that which it goes on as.
      const bool last = i % 32 == 31;
      const std::size_t ply = (i / 32 + (last ? 3 * 2 + shift : 0)) % 3;
      const V3f next = segments[last ? 32 * ply : i + 1].start + V3f(last ? 2.0F : 0.0F, 0, 0);
      CHECK((segments[i].start + segments[i].along - next).length() < 1e-6F);
    }
  }
}

TEST_CASE("rays meet plies as they meet round yarns in their places") {
  Random random(5);
  const V2f period(2.5F, 1.75F);
  YarnData data = tangle(random, period, 3);
  data.curves[0].plies = {3, 5, 6, 0.5F, {0, 0, 0}};
  data.curves[2].plies = {2, 4, -2, -1, {0, 0, 0}};
  REQUIRE(validate(data, period));
  const Yarns yarns(data, period);
  // Plies that meet themselves are chains of their own.
  YarnData round;
  const auto segments = yarns.geometry().segments;
  for (std::size_t i = 0; i < segments.size();) {
    YarnCurve curve = data.curves[segments[i].curve];
    curve.nodes *= curve.plies.divisions;
    curve.radius = ply_or_yarn_radius(curve);
    curve.plies = {};
    round.curves.push_back(curve);
    for (int n = 0; n < curve.nodes; ++n) round.nodes.push_back(segments[i++].start);
  }
  round.station_light.assign(std::size_t{light_values_per_station} * counts_of(round).stations, 0);
  REQUIRE(validate(round, period));
  const Yarns chains(round, period);
  int met = 0;
  for (int i = 0; i < 5000; ++i) {
    const V2d uv(random.uniform() * 4 - 2, random.uniform() * 4 - 2);
    const V3f view = V3f(V3d(random.uniform() - 0.5, random.uniform() - 0.5, 0.4)).normalized();
    const auto hit = yarns.trace(uv, 0.1F, view);
    const auto other = chains.trace(uv, 0.1F, view);
    REQUIRE(hit.has_value() == other.has_value());
    if (!hit) continue;
    ++met;
    CHECK(hit->segment == other->segment);
    const YarnPoint point = yarns.point_at(*hit);
    const YarnPoint same = chains.point_at(*other);
    CHECK((point.normal - same.normal).length() < 1e-3F);
    CHECK((point.fibre - same.fibre).length() < 1e-3F);
  }
  CHECK(met > 1000);
}

TEST_CASE("indirect light of plies belongs to the axis and its sides, and the groove changes it") {
  YarnData data = straight(2, 0.5F);
  data.curves[0].plies = {3, 8, 0, 0, {0.5F, 0, -0.25F}};
  data.station_light[0] = data.station_light[1] = data.station_light[2] = 0.25F;
  const Yarns yarns(data, {2, 2});
  int outermost = 0;
  for (int i = 0; i < 1000; ++i) {
    const V2d uv(0.3, (i + 0.5) / 1000);
    const auto hit = yarns.trace(uv, 0.5F, {0, 0, 1});
    if (!hit) continue;
    const YarnPoint point = yarns.point_at(*hit);
    // Without turns the plies are cylinders, E their way out of the axis.
    const int ply = hit->segment / 32;
    const double angle = 2 * std::numbers::pi * ply / 3;
    const V3d out(0, -std::sin(angle), std::cos(angle));
    CHECK(static_cast<double>(point.outward_cosine) ==
          doctest::Approx(out.dot(V3d(point.normal))).epsilon(1e-4));
    CHECK(point.angle_cosine == doctest::Approx(point.normal.z).epsilon(1e-4));
    const LightTransfer transfer = yarns.transfer_at(point);
    CHECK(transfer[0] == doctest::Approx(0.25F * (1 + 0.5F * point.outward_cosine)));
    CHECK(transfer[1] == 0.25F);
    CHECK(transfer[2] == doctest::Approx(0.25F * (1 - 0.25F * point.outward_cosine)));
    CHECK(point.ply_side.x == doctest::Approx(out.z).epsilon(1e-4));
    CHECK(angle_factors({3, 8, 0, 0, {}, 1}, point)[3] == point.ply_side.x);
    CHECK(angle_factors({3, 8, 0, 0, {}, 0}, point)[3] ==
          angle_basis(point.angle_cosine, point.angle_sine)[3]);
    if (point.outward_cosine > 0.99F) ++outermost;
  }
  CHECK(outermost > 20);
}
