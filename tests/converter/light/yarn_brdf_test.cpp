#include "converter/light/yarn_brdf.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/light/path_tracer.h"

using namespace selvedge;

namespace {

constexpr double pi = std::numbers::pi;

YarnBrdf yarn(double albedo, float weight, float roughness) {
  YarnBrdf s;
  s.normal = V3d(0.2, -0.3, 0.8).normalized();
  s.fibre = s.normal.cross(V3d(0, 1, 0)).normalized();
  s.albedo = V3d(albedo);
  s.gloss = {weight, roughness};
  return s;
}

/// Unit, at this elevation's cosine and azimuth from the fibre.
V3d direction(const YarnBrdf& s, double cosine, double azimuth) {
  const double planar = std::sqrt(1 - cosine * cosine);
  return s.fibre * (planar * std::cos(azimuth)) + s.normal.cross(s.fibre) * (planar * std::sin(azimuth)) +
         s.normal * cosine;
}

/// Share of the light from `l` that is reflected, by the midpoint rule.
double albedo_by_quadrature(const YarnBrdf& s, const V3d& l) {
  constexpr int rows = 300;
  constexpr int columns = 600;
  double sum = 0;
  for (int i = 0; i < rows; ++i) {
    // Equal steps of the squared cosine: the cosine's weight is in them.
    const double cosine = std::sqrt((i + 0.5) / rows);
    for (int j = 0; j < columns; ++j) {
      sum += reflectance(s, l, direction(s, cosine, 2 * pi * (j + 0.5) / columns)).x;
    }
  }
  return sum * pi / (rows * columns);
}

}  // namespace

TEST_CASE("yarn is reciprocal") {
  const YarnBrdf s = yarn(0.4, 0.7F, 0.2F);
  for (std::uint32_t i = 0; i < 200; ++i) {
    PathSampler sampler(i, 1);
    const V3d a = cosine_direction(s.normal, sampler.next());
    const V3d b = cosine_direction(s.normal, sampler.next());
    CHECK(reflectance(s, a, b).x == doctest::Approx(reflectance(s, b, a).x).epsilon(1e-12));
  }
}

TEST_CASE("yarn reflects no more light than falls on it, from any direction") {
  for (const float roughness : {0.1F, 0.3F, 1.0F}) {
    const YarnBrdf white = yarn(1, 1, roughness);
    for (const double cosine : {0.02, 0.1, 0.3, 0.6, 0.9, 1.0}) {
      for (const double azimuth : {0.0, 0.4, 0.8, 1.2, pi / 2}) {
        const V3d l = direction(white, cosine, azimuth);
        const double albedo = albedo_by_quadrature(white, l);
        CAPTURE(roughness);
        CAPTURE(cosine);
        CAPTURE(azimuth);
        // 180,000 points: at a width of 0.1 the midpoint rule is good to 1e-3 from almost level.
        CHECK(albedo <= 1 + 1e-3);
        CHECK(albedo > 0.3);
        // A second way to the same integral: what the sampling of paths keeps.
        double kept = 0;
        constexpr std::uint32_t count = 4096;
        for (std::uint32_t i = 0; i < count; ++i) {
          PathSampler sampler(i, 2);
          if (const auto sample = sample_bsdf(white, l, sampler.next())) kept += sample->weight.x / count;
        }
        // Weights lie in [0, 1]: deviation of the mean at most 1 / 128, less by even spreading.
        CHECK(std::abs(kept - albedo) < 4.0 / 128);
      }
    }
  }
}

TEST_CASE("a packet has the gloss of single points") {
  GlossPacket packet;
  std::array<YarnBrdf, packet_size> surfaces;
  std::array<V3d, packet_size> views;
  for (std::size_t i = 0; i < packet_size; ++i) {
    surfaces[i] = yarn(0.5, 0.1F + 0.05F * static_cast<float>(i), 0.05F + 0.05F * static_cast<float>(i));
    views[i] = direction(surfaces[i], 0.05 + 0.05 * static_cast<double>(i), 0.4 * static_cast<double>(i));
    if (i == 3) surfaces[i].gloss.weight = 0;
    packet.set(i, surfaces[i], views[i]);
  }
  for (std::uint32_t k = 0; k < 200; ++k) {
    const V3f light(V3d(1, 0, 0) * (k == 0 ? 1.0 : 0.0) + cosine_direction({0, 0, 1}, spread_point(k, 9)));
    const V3f unit = light.normalized();
    std::array<float, packet_size> result;
    packet.reflectance(unit, result);
    for (std::size_t i = 0; i < packet_size; ++i) {
      const double exact =
          static_cast<double>(surfaces[i].gloss.weight) * gloss_reflectance(surfaces[i], V3d(unit), views[i]);
      // Single precision; at a width of 0.05 the half vector's rounding counts 400 times, twice.
      CHECK(static_cast<double>(result[i]) == doctest::Approx(exact).epsilon(1e-3));
    }
  }
}

TEST_CASE("any power of two of spread points is spread over every elementary interval") {
  for (const std::uint64_t seed : {1ULL, 0x123456789abcdef0ULL}) {
    for (int k = 0; k <= 8; ++k) {
      const int count = 1 << k;
      for (int columns = 1; columns <= count; columns *= 2) {
        std::vector<int> in(static_cast<std::size_t>(count), 0);
        for (int i = 0; i < count; ++i) {
          const V2d p = spread_point(static_cast<std::uint32_t>(i), seed);
          const int rows = count / columns;
          ++in[static_cast<int>(p.x * columns) * rows + static_cast<int>(p.y * rows)];
        }
        CHECK(std::count(in.begin(), in.end(), 1) == count);
      }
    }
  }
}
