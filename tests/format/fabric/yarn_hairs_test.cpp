#include "format/fabric/yarn_hairs.h"

#include <doctest/doctest.h>

#include <cmath>

#include "format/base/random.h"
#include "format/fabric/header.h"
#include "tests/format/yarn_data.h"

using namespace selvedge;

namespace {

constexpr V2f period(4, 2);

/// A straight yarn along x, of plies where there is more than one.
YarnData hairy(int plies, const YarnHairs& hairs) {
  YarnData data;
  YarnCurve curve;
  curve.stations = 5;
  curve.repeat_offset = {1, 0};
  curve.radius = 0.25F;
  curve.fibre_slope = 0.3F;
  curve.hairs = hairs;
  curve.strands = {12, 5, 7, 4711, 0, 3};
  if (plies > 1) curve.plies = {plies, 20, 2, 0.5F, {0, 0, 0}};
  for (int n = 0; n < 8; ++n) data.nodes.emplace_back(0.5F * static_cast<float>(n), 1, 1);
  curve.nodes = 8;
  data.curves.push_back(curve);
  data.station_light.assign(std::size_t{light_values_per_station} * curve.stations, 0);
  return data;
}

std::vector<YarnHair> grown(const YarnData& data) {
  return make_hairs(data.curves[0], data.nodes, period, make_segments(data.curves[0], data.nodes, period));
}

double length_of(const std::array<V3d, hair_point_count>& points) {
  double sum = 0;
  for (int k = 1; k < hair_point_count; ++k) sum += (points[k] - points[k - 1]).length();
  return sum;
}

/// Fraction of rays from straight above that meet hairs.
double cover(const Yarns& yarns, float width) {
  constexpr int side = 1000;
  int met = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const auto hit = yarns.trace(V2d(x + 0.5, y + 0.5) / side, 0, V3f(0, 0, 1), width);
      if (hit && yarns.geometry().segments[hit->segment].hair_threshold > 0) ++met;
    }
  }
  return met / static_cast<double>(side * side);
}

}  // namespace

TEST_CASE("lengths of hairs are exponential up to three times their mean, and free ends are arcs") {
  const YarnHairs hairs{20000, 0.5F, 0, 0.01F, 1};
  double sum = 0;
  double squares = 0;
  double straight = 0;
  for (int h = 0; h < hairs.count; ++h) {
    const auto points = hair_points(hairs, 99, h);
    const double length = length_of(points);
    sum += length;
    squares += length * length;
    CHECK(points[0] == V3d(0, 0, 0));
    CHECK(length < 1.5);
    // A chain of seven equal chords that turn alike: its ends are sin(7 a) / sin(a) chords apart, a half the
    // turn.
    const V3d first = points[1] - points[0];
    const double half =
        std::atan2(first.cross(points[2] - points[1]).length(), first.dot(points[2] - points[1])) / 2;
    CHECK(7 * 2 * half > 0.29);
    CHECK(7 * 2 * half < 1.81);
    CHECK(points[7].length() == doctest::Approx(length / 7 * std::sin(7 * half) / std::sin(half)));
    straight += points[7].length() / length;
  }
  const double n = hairs.count;
  const double mean = 0.5 * (1 - 3 / std::expm1(3.0));
  const double deviation = std::sqrt(squares / n - sum / n * sum / n);
  CHECK(std::abs(sum / n - mean) < 4 * deviation / std::sqrt(n));
  CHECK(straight / n < 0.98);
}

TEST_CASE("a fraction of hairs are loops, which end on the plane of their roots, along the fibres") {
  const YarnHairs hairs{20000, 0.5F, 0.3F, 0.01F, 1};
  int loops = 0;
  for (int h = 0; h < hairs.count; ++h) {
    const auto points = hair_points(hairs, 7, h);
    if (std::abs(points[7].z) > 1e-12) continue;
    ++loops;
    CHECK(points[7].x > 0);
    CHECK(std::abs(points[7].y) < 1e-12);
    CHECK(points[3].z > 0);
  }
  CHECK(std::abs(loops - 6000) < 4 * std::sqrt(20000 * 0.3 * 0.7));
}

TEST_CASE("hairs begin evenly over the surface of a yarn and of its plies") {
  for (const int plies : {1, 3}) {
    const YarnData data = hairy(plies, {8000, 0.3F, 0.2F, 0.01F, 1});
    const auto chain = make_segments(data.curves[0], data.nodes, period);
    const auto radius = static_cast<double>(ply_or_yarn_radius(data.curves[0]));
    V3d mean(0, 0, 0);
    double along = 0;
    for (const YarnHair& hair : grown(data)) {
      mean += hair.normal;
      along += hair.points[0].x / 4;
      // A root lies as far from the nearest chain as that is thick.
      double nearest = 1;
      for (const Yarns::Segment& s : chain) {
        for (const double shift : {-4.0, 0.0, 4.0}) {
          const V3d off = hair.points[0] - V3d(s.start) - V3d(shift, 0, 0);
          const double fraction = std::clamp(off.dot(V3d(s.along)) / V3d(s.along).length2(), 0.0, 1.0);
          nearest = std::min(nearest, (off - V3d(s.along) * fraction).length());
        }
      }
      CHECK(nearest <= radius * 1.001);
      if (plies == 1) CHECK(nearest == doctest::Approx(radius).epsilon(1e-5));
      CHECK(hair.normal.length() == doctest::Approx(1));
      CHECK(hair.root_angle.x * hair.root_angle.x + hair.root_angle.y * hair.root_angle.y ==
            doctest::Approx(1));
    }
    CHECK(mean.length() / 8000 < 4 / std::sqrt(8000.0));
    if (plies == 1) CHECK(std::abs(along / 8000 - 0.5) < 4 * std::sqrt(1 / 12.0 / 8000));
  }
}

TEST_CASE("the hairs of yarn turned over are those that it had, in a mirror") {
  for (const int plies : {1, 3}) {
    // Lying, and upright at its first node.
    for (const bool upright : {false, true}) {
      YarnData data = hairy(plies, {50, 0.3F, 0.4F, 0.01F, 1});
      data.curves[0].strands.irregularity = 0.2F;
      if (upright) {
        data.nodes = {{1, 1, 1}, {1, 1, 1.5F}, {1.5F, 1, 2}, {2, 1, 1.5F}, {2, 1, 1}, {1.5F, 1.1F, 0.5F}};
        data.curves[0].nodes = 6;
        data.curves[0].repeat_offset = {0, 0};
      }
      const Yarns yarns(data, period);
      const YarnData turned = turned_over(yarns, 2.5F);
      const auto before = grown(data);
      const auto after = grown(turned);
      REQUIRE(before.size() == after.size());
      for (std::size_t h = 0; h < before.size(); ++h) {
        for (int k = 0; k < hair_point_count; ++k) {
          const V3d& p = after[h].points[k];
          CHECK((V3d(p.x, p.y, 2.5 - p.z) - before[h].points[k]).length() < 1e-5);
        }
        CHECK(after[h].root_angle.z == doctest::Approx(before[h].root_angle.z).epsilon(1e-4));
      }
    }
  }
}

TEST_CASE("wide rays meet fewer and wider hairs, of the same cover in the mean") {
  const Yarns yarns(hairy(1, {600, 0.5F, 0.2F, 0.002F, 0.75F}), period);
  const double as_they_are = cover(yarns, 0);
  CHECK(as_they_are > 0.05);
  // 600 hairs, of which a fraction of 3/10 is left: their lengths vary by about 0.8 of the mean.
  const double error = 4 * 0.8 * std::sqrt((1 - 0.3) / (600 * 0.3));
  CHECK(cover(yarns, 0.01F) == doctest::Approx(as_they_are).epsilon(error));
  CHECK(cover(yarns, 0.002F) == as_they_are);
}

TEST_CASE("yarn is as thick as its mean and as uneven as it says, apart from its colour") {
  YarnStrands strands{0, 2, 0, 12, 0.1F, 20000};
  double sum = 0;
  double squares = 0;
  double products = 0;
  constexpr int steps = 200000;
  for (int i = 0; i < steps; ++i) {
    const double fraction = (i + 0.5) / steps;
    const double thick = strand_swell(strands, fraction, thickness_noise_byte) - 1;
    sum += thick;
    squares += thick * thick;
    products += thick * (strand_swell(strands, fraction, colour_noise_byte) - 1);
  }
  // Each of the 20,000 places counts once.
  CHECK(std::abs(sum / steps) < 4 * 0.1 / std::sqrt(20000.0));
  CHECK(std::sqrt(squares / steps) == doctest::Approx(0.1).epsilon(0.02));
  CHECK(std::abs(products / steps) < 4 * 0.01 / std::sqrt(20000.0));
  strands.irregularity = 0;
  CHECK(strand_swell(strands, 0.3, thickness_noise_byte) == 1);
}

TEST_CASE(
    "segments are as thick as their yarn in their middle, and plies lie further out where it is thick") {
  YarnData data = hairy(1, {});
  data.curves[0].strands = {0, 2, 0, 5, 0.3F, 4};
  const auto round = make_segments(data.curves[0], data.nodes, period);
  for (std::size_t i = 0; i < round.size(); ++i) {
    const double middle = (static_cast<double>(i) + 0.5) / 8;
    CHECK(static_cast<double>(round[i].radius) ==
          doctest::Approx(0.25 * strand_swell(data.curves[0].strands, middle, thickness_noise_byte)));
    CHECK(round[i].bounding_radius == std::max(round[i].radius, round[(i + 7) % 8].radius));
  }
  data.curves[0].plies = {3, 4, 1, 0, {0, 0, 0}};
  for (const Yarns::Segment& s : make_segments(data.curves[0], data.nodes, period)) {
    const double thick =
        strand_swell(data.curves[0].strands, static_cast<double>(s.start_station) / 5, thickness_noise_byte);
    const double off = V2d(static_cast<double>(s.start.y) - 1, static_cast<double>(s.start.z) - 1).length();
    CHECK(off == doctest::Approx(0.25 * (1 - unit_ply_radius(3)) * thick).epsilon(1e-4));
  }
}

TEST_CASE("values of hairs are read back") {
  const YarnData data = hairy(2, {-40, 0.5F, 0.25F, 0.01F, 0.5F});
  CHECK(data == *yarns_from_values(curve_values(data), indirect_values(data), counts_of(data), period));
}

TEST_CASE("hairs too short for a direction are not there, however they are looked at") {
  for (const float length : {1e-6F, 1e-18F, 1e-22F, 1e-38F}) {
    CAPTURE(length);
    const YarnData data = hairy(2, {200, length, 0.5F, 0.05F, 1});
    REQUIRE(validate(data, period));
    const Yarns yarns(data, period);
    for (const Yarns::Segment& s : yarns.geometry().segments) CHECK(std::isfinite(s.inverse_length2));
    Random random(1);
    int seen = 0;
    for (int i = 0; i < 2000; ++i) {
      const V3f view =
          V3f(V3d(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform())).normalized();
      const auto hit = yarns.trace({random.uniform(), random.uniform()}, 1, view);
      if (!hit) continue;
      const YarnPoint point = yarns.point_at(*hit);
      ++seen;
      CHECK((point.station >= 0 && point.station <= 5 && std::isfinite(point.normal.length())));
      CHECK(std::isfinite(yarns.shade({0, 0}, 1, view, view).radiance.x));
    }
    CHECK(seen > 100);
  }
}
