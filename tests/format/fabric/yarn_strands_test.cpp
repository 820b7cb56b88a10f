#include "format/fabric/yarn_strands.h"

#include <doctest/doctest.h>

#include "format/base/random.h"
#include "tests/format/fabric_sides.h"

using namespace selvedge;

namespace {

constexpr YarnStrands strands{31, 9, -44, 12345, 0.2F, 5};

/// Sums of values and of their squares.
struct Moments {
  int count = 0;
  double sum = 0, squares = 0;
  void add(double value) {
    ++count;
    sum += value;
    squares += value * value;
  }
  double mean() const { return sum / count; }
  double variance() const { return squares / count - mean() * mean(); }
};

}  // namespace

TEST_CASE("the hash of strands is undone by the inverse that its author publishes") {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const auto x = static_cast<std::uint32_t>(random.next());
    std::uint32_t y = hash32(x);
    y = (y ^ y >> 16) * 0x43021123U;
    y = (y ^ y >> 15 ^ y >> 30) * 0x1d69e2a5U;
    CHECK((y ^ y >> 16) == x);
  }
}

TEST_CASE("strands differ with a mean of 0 and the stated variances, and neighbours have nothing in common") {
  // As many seeds as places: 6 standard errors of a mean are 6 / sqrt(20000) deviations, of a variance less.
  constexpr int count = 20000;
  constexpr double bound = 6 / 141.4;
  Random random(2);
  std::array<Moments, 4> moments;
  Moments product;
  for (int i = 0; i < count; ++i) {
    YarnStrands own{40, 7, 0, i, 0, 1};
    const double around = (std::floor(40 * random.uniform()) + 0.5) / 40;
    const double fraction = random.uniform();
    const auto change = strand_perturbation(own, around, fraction);
    const auto next = strand_perturbation(own, around + 1.0 / 40, fraction);
    // In the middle of a strand its roundness has no slope.
    const std::array<double, 4> values{
        change.across / strand_slope_across_rms, change.along / strand_slope_along_rms,
        change.turn / strand_fibre_turn_rms, (change.brightness - 1) / default_contrast};
    for (std::size_t k = 0; k < values.size(); ++k) moments[k].add(values[k]);
    product.add(values[0] * next.across / strand_slope_across_rms);
    product.add(values[0] * values[1]);
    product.add(values[2] * values[3]);
  }
  for (const Moments& m : moments) {
    CHECK(std::abs(m.mean()) < bound);
    CHECK(std::abs(m.variance() - 1) < bound);
  }
  CHECK(std::abs(product.mean()) < bound);
}

TEST_CASE("irregular yarn changes by its irregularity, whole turns about it do not matter") {
  constexpr int count = 20000;
  Moments brightness;
  for (int i = 0; i < count; ++i) {
    const YarnStrands own{0, 2, 0, i, 0.25F, 2 + i % 4};
    const auto change = strand_perturbation(own, 0.3, i / 777.0);
    CHECK(change.across == 0);
    brightness.add((change.brightness - 1) / 0.25);
  }
  CHECK(std::abs(brightness.mean()) < 6 / 141.4);
  CHECK(std::abs(brightness.variance() - 1) < 6 / 141.4);
  for (const double around : {0.11, 0.52, 0.93})
    CHECK(strand_perturbation(strands, around + 3, 0.4).across ==
          doctest::Approx(strand_perturbation(strands, around, 0.4).across));
}

TEST_CASE("strands run on where the chain begins again, as others where they shift") {
  for (int i = 0; i < 310; ++i) {
    const double around = (i + 0.4) / 310;
    const auto end = strand_perturbation(strands, around, 1 - 1e-9);
    const auto start = strand_perturbation(strands, around, 0.0);
    CHECK(end.across == doctest::Approx(start.across).epsilon(1e-5));
    CHECK(end.along == doctest::Approx(start.along).epsilon(1e-5));
    CHECK(end.turn == doctest::Approx(start.turn).epsilon(1e-5));
    CHECK(end.brightness == doctest::Approx(start.brightness).epsilon(1e-5));
    CHECK(strand_perturbation(strands, around, 2.3).along ==
          doctest::Approx(strand_perturbation(strands, around, 0.3).along).epsilon(1e-6));
  }
  // Where nothing else leans: a roof over each strand, of slope 1/2 at its edges.
  YarnStrands one = strands;
  one.shift = 0;
  const double width = 1.0 / one.count;
  const double low = strand_perturbation(one, 4.0001 * width, 0.5).across;
  CHECK(strand_perturbation(one, 4.5 * width, 0.5).across - low == doctest::Approx(0.5).epsilon(1e-3));
  CHECK(strand_perturbation(one, 4.9999 * width, 0.5).across - low == doctest::Approx(1).epsilon(1e-3));
}

TEST_CASE("single and double precision have the same strands") {
  Random random(5);
  int apart = 0;
  for (int i = 0; i < 10000; ++i) {
    const double around = random.uniform() - 0.5;
    const double fraction = random.uniform();
    const auto a = strand_perturbation(strands, around, fraction);
    const auto b = strand_perturbation(strands, static_cast<float>(around), static_cast<float>(fraction));
    apart += std::abs(a.across - static_cast<double>(b.across)) +
                         std::abs(a.brightness - static_cast<double>(b.brightness)) <
                     1e-4
                 ? 0
                 : 1;
  }
  CHECK(apart <= 3);  // within 10^-5 of a strand's edge rounding decides
}

TEST_CASE("a strand turns normal and fibre by its slopes, and faces the viewer") {
  const V3d view = V3d(0.2, -0.1, 1).normalized();
  V3d normal(0, 0, 1);
  V3d fibre(1, 0, 0);
  perturb_by_strand(StrandPerturbation<double>{0.3, -0.1, 0, 1}, view, normal, fibre);
  // The plane that rises by 0.1 along x and falls by 0.3 along F x N = -y.
  const V3d plane = V3d(-0.1, -0.3, 1).normalized();
  CHECK((normal - plane).length() < 1e-12);
  CHECK(std::abs(fibre.dot(normal)) < 1e-12);
  CHECK(fibre.y / fibre.x == doctest::Approx(normal.y * normal.x / (normal.x * normal.x - 1)));
  normal = {0, 0, 1};
  fibre = {1, 0, 0};
  const V3d low = V3d(0, 1, 0.1).normalized();
  perturb_by_strand(StrandPerturbation<double>{0.5, 0, 0, 1}, low, normal, fibre);
  CHECK(normal.dot(low) > 0.04);
}

TEST_CASE("the strands of yarn turned over are those that it had, in a mirror") {
  YarnData data = test::four_sides().levels.front().yarns()->data();
  for (YarnCurve& curve : data.curves) curve.strands = strands;
  // The first curve stands upright at its first node, the second lies.
  for (const int curve : {0, 1}) {
    const V3f way = curve == 0 ? V3f(0, 0, 0.5F) : V3f(0.5F, 0, 0);
    const V2i& turns = data.curves[curve].repeat_offset;
    data.nodes[12 * curve + 1] = data.nodes[12 * curve] + way;
    data.nodes[12 * curve + 11] = data.nodes[12 * curve] - way +
                                  V3f(5 * static_cast<float>(turns.x), 4 * static_cast<float>(turns.y), 0);
  }
  const Yarns yarns(data, {5, 4});
  const Yarns turned(turned_over(yarns, 2.5F), {5, 4});
  const auto mirror = [](const V3f& v) { return V3f(v.x, v.y, -v.z); };
  int compared = 0;
  for (int segment = 0; segment < 24; ++segment) {
    const Yarns::Segment& s = yarns.geometry().segments[segment];
    for (int k = 0; k < 16; ++k) {
      const float angle = 0.39F * static_cast<float>(k) + 0.1F;
      const V3f beside = s.along.normalized().cross(s.across[0]);
      const V3f from_start =
          s.along * 0.4F + (s.across[0] * std::cos(angle) + beside * std::sin(angle)) * s.radius;
      YarnPoint point = yarns.point_at({segment, from_start});
      YarnPoint other = turned.point_at({segment, mirror(from_start)});
      // Seen from beside, so that no strand is turned to face the viewer.
      if (std::abs(point.normal.z) > 0.4F) continue;
      const V3f view = V3f(point.normal.x, point.normal.y, 0).normalized();
      yarns.perturb_by_strands(point, view);
      turned.perturb_by_strands(other, view);
      ++compared;
      CHECK(other.brightness == doctest::Approx(point.brightness).epsilon(1e-3));
      CHECK((mirror(other.strand_normal) - point.strand_normal).length() < 1e-2F);
      CHECK((mirror(other.fibre) - point.fibre).length() < 1e-2F);
    }
  }
  CHECK(compared > 60);
}
