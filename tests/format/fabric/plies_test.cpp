// Plies that follow from the axis of their yarn.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "format/fabric/yarns.h"
#include "tests/format/yarn_data.h"

using namespace selvedge;
using namespace selvedge::test;

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
