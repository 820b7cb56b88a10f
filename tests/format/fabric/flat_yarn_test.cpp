#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "format/fabric/header.h"
#include "tests/format/fabrics.h"
#include "tests/format/yarn_data.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

constexpr double root = std::numbers::sqrt2 / 2;

/// A level yarn along (1, 1) through cells of 2 x 2 mm, its axis at 0.4 mm.
YarnData aslant(float flattening) {
  YarnData data = straight(2, 0.3F);
  data.curves[0].repeat_offset = {1, 1};
  data.curves[0].flattening = flattening;
  for (int i = 0; i < 4; ++i) {
    const float along = 0.5F * static_cast<float>(i);
    data.nodes[i] = {along, along, 0.4F};
  }
  return data;
}

/// The ellipse that the yarn and its copies have across it, in closed form: `at` and `way` are across and up.
struct Ellipses {
  double a, b;
  std::optional<double> meet(const V2d& at, const V2d& way) const {
    std::optional<double> first;
    for (int copy = -60; copy <= 60; ++copy) {
      const double s = at.x - copy * 2 * root;
      const double z = at.y - static_cast<double>(0.4F);
      const double p = std::pow(way.x / a, 2) + std::pow(way.y / b, 2);
      const double q = s * way.x / (a * a) + z * way.y / (b * b);
      const double r = std::pow(s / a, 2) + std::pow(z / b, 2) - 1;
      if (q * q < p * r) continue;
      const double t = (-q - std::sqrt(q * q - p * r)) / p;
      if (t > 0 && (!first || t < *first)) first = t;
    }
    return first;
  }
};

V2d across_and_up(const V3d& p) { return {(p.x - p.y) * root, p.z}; }

}  // namespace

TEST_CASE("rays meet the elliptic cylinder that a straight flat yarn is, and are hidden by it") {
  Random random(11);
  for (const float flattening : {0.3F, 0.6F, 1.0F}) {
    const auto q = static_cast<double>(flattening);
    const Ellipses truth{static_cast<double>(0.3F) / std::sqrt(q), static_cast<double>(0.3F) * std::sqrt(q)};
    const YarnData data = aslant(flattening);
    REQUIRE(validate(data, {2, 2}));
    const Yarns yarns(data, {2, 2});
    int met = 0;
    int hidden = 0;
    int differ = 0;
    for (int i = 0; i < 4000; ++i) {
      const V2d uv(random.uniform() * 4, random.uniform() * 4);
      const V3f view = random_direction(random, 0.05);
      const V3d up = V3d(view).normalized();
      const V3d origin = V3d(uv.x * 2, -uv.y * 2, 0) + up * (2 / up.z);
      const auto way = truth.meet(across_and_up(origin), across_and_up(-up));
      const bool above = way && origin.z - *way * up.z > 0;
      const auto hit = yarns.trace(uv, 0, view);
      if (hit.has_value() != above) {
        ++differ;
        continue;
      }
      if (!hit) continue;
      ++met;
      const V2d at = across_and_up(V3d(data.nodes[hit->segment] + hit->start_offset));
      const double z = at.y - static_cast<double>(0.4F);
      CHECK(std::pow(at.x / truth.a, 2) + std::pow(z / truth.b, 2) == doctest::Approx(1).epsilon(1e-4));
      const YarnPoint point = yarns.point_at(*hit);
      const V2d normal = V2d(at.x / (truth.a * truth.a), z / (truth.b * truth.b)).normalized();
      CHECK((across_and_up(V3d(point.normal)) - normal).length() < 1e-3);
      CHECK(std::abs(point.normal.dot(point.fibre)) < 1e-5F);
      const V3f light = random_direction(random, 0.05, 0.3);
      if (!(point.normal.dot(light) > 0.02F)) continue;
      const bool shadow =
          truth.meet(at + normal * (truth.b / 64), across_and_up(V3d(light).normalized())).has_value();
      hidden += shadow ? 1 : 0;
      differ += yarns.is_occluded(*hit, point, light) != shadow ? 1 : 0;
    }
    MESSAGE(flattening, ": met ", met, ", hidden ", hidden, ", differ ", differ);
    CHECK(met > 1000);
    CHECK(hidden > 30);
    // Where a ray grazes the yarn.
    CHECK(differ <= 2);
  }
}

TEST_CASE("a flat yarn is the less flat the more steeply it stands, and keeps its area") {
  YarnData data = straight(2, 0.1F);
  const V3f steps[] = {{0, 1, 0.2F}, {0.5F, 1, 0.4F}, {1, 1, 1.0F}, {1.5F, 1, 0.3F}};
  std::copy(std::begin(steps), std::end(steps), data.nodes.begin());
  data.curves[0].flattening = 0.5F;
  const Yarns yarns(data, {2, 2});
  Random random(5);
  int met = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto hit = yarns.trace({random.uniform(), random.uniform()}, 0, {0, 0, 1});
    if (!hit) continue;
    const V3d along(yarns.geometry().segments[hit->segment].along);
    const V3d way = along.normalized();
    const V3d off(hit->start_offset);
    if (off.dot(way) < 0.2 || off.dot(way) > along.length() - 0.2) continue;
    ++met;
    const double fraction = 1 - 0.5 * (1 - std::pow(way.z, 4));  // of thickness in width
    const double area = std::pow(static_cast<double>(0.1F), 2);
    const double w2 = off.y * off.y;
    const double v2 = (off - way * way.dot(off)).length2() - w2;
    CHECK(w2 * fraction / area + v2 / (fraction * area) == doctest::Approx(1).epsilon(1e-3));
  }
  CHECK(met > 100);
}

TEST_CASE("plies of a flat yarn turn on an ellipse and are as flat as it is") {
  YarnData data = aslant(0.5F);
  data.curves[0].plies = {3, 8, 4, 0.3F, {0, 0, 0}};
  REQUIRE(validate(data, {2, 2}));
  const Yarns yarns(data, {2, 2});
  const double r = 0.3 * unit_ply_radius(3);
  for (const Yarns::Segment& s : yarns.geometry().segments) {
    const V2d at = across_and_up(V3d(s.start)) - V2d(0, 0.4);
    CHECK(std::hypot(at.x * std::sqrt(0.5), at.y / std::sqrt(0.5)) == doctest::Approx(0.3 - r).epsilon(1e-4));
    CHECK(static_cast<double>(s.radius) == doctest::Approx(r * std::sqrt(0.5)).epsilon(1e-4));
    CHECK(static_cast<double>(s.half_width(s.radius)) == doctest::Approx(r / std::sqrt(0.5)).epsilon(1e-4));
  }
}

TEST_CASE("hairs of a flat yarn begin on its ellipse, in the direction of its normal") {
  YarnData data = aslant(0.5F);
  data.curves[0].hairs = {200, 0.2F, 0, 0.01F, 1};
  REQUIRE(validate(data, {2, 2}));
  const double a = static_cast<double>(0.3F) / std::sqrt(0.5);
  const double b = static_cast<double>(0.3F) * std::sqrt(0.5);
  const YarnCurve& curve = data.curves[0];
  const auto hairs = make_hairs(curve, data.nodes, {2, 2}, make_segments(curve, data.nodes, {2, 2}));
  REQUIRE(hairs.size() == 200);
  for (const YarnHair& hair : hairs) {
    const V2d start = across_and_up(hair.points[0]) - V2d(0, static_cast<double>(0.4F));
    CHECK(std::pow(start.x / a, 2) + std::pow(start.y / b, 2) == doctest::Approx(1).epsilon(1e-4));
    const V2d normal = V2d(start.x / (a * a), start.y / (b * b)).normalized();
    CHECK((across_and_up(hair.normal) - normal).length() < 1e-4);
    // A free end leaves at no more than 70 degrees from the normal, and its first piece turns by at most 1.8
    // / 7.
    CHECK((hair.points[1] - hair.points[0]).normalized().dot(hair.normal) > std::cos(1.49));
  }
}

TEST_CASE("the surface about a station is that which rays meet") {
  // A wave that rises and bends sideways.
  const V2f period(2, 2);
  YarnData data = straight(2, 0.05F);
  data.curves[0].flattening = 0.5F;
  data.curves[0].nodes = 64;
  data.curves[0].stations = 8;
  data.station_light.resize(8 * data.station_light.size());
  data.nodes.clear();
  for (int i = 0; i < 64; ++i) {
    const float angle = std::numbers::pi_v<float> * static_cast<float>(i) / 32;
    data.nodes.emplace_back(static_cast<float>(i) / 32, 1 + 0.2F * std::cos(angle),
                            0.3F + 0.1F * std::sin(angle));
  }
  REQUIRE(validate(data, period));
  const Yarns yarns(data, period);
  const YarnFrame frame = yarns.frame_at(0, 1);
  int met = 0;
  for (int k = 0; k < 64; ++k) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / 64;
    const V3f round = frame.across * std::cos(angle) + frame.tangent.cross(frame.across) * std::sin(angle);
    if (!(frame.surface_normal(round).z > 0.2F)) continue;
    const V3f at = frame.surface_position(round);
    const auto hit = yarns.trace(
        {static_cast<double>(at.x / period.x), static_cast<double>(-at.y / period.y)}, at.z, {0, 0, 1});
    REQUIRE(hit);
    ++met;
    const YarnPoint point = yarns.point_at(*hit);
    CHECK((point.normal - frame.surface_normal(round)).length() < 0.05F);
    CHECK(point.angle_cosine == doctest::Approx(std::cos(angle)).epsilon(0.05));
  }
  CHECK(met > 10);
}
