#include "converter/light/yarn_brdf.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/light/path_tracer.h"

using namespace selvedge;

namespace {

constexpr double pi = std::numbers::pi;

YarnBrdf yarn(double albedo, float weight, float roughness, float lustre = 0) {
  YarnBrdf s;
  s.normal = V3d(0.2, -0.3, 0.8).normalized();
  s.fibre_direction = s.normal.cross(V3d(0, 1, 0)).normalized();
  s.albedo = V3d(albedo);
  s.gloss = {weight, roughness, lustre};
  return s;
}

/// Unit, at this elevation's cosine and azimuth from the fibre.
V3d direction(const YarnBrdf& s, double cosine, double azimuth) {
  const double planar = std::sqrt(1 - cosine * cosine);
  return s.fibre_direction * (planar * std::cos(azimuth)) +
         s.normal.cross(s.fibre_direction) * (planar * std::sin(azimuth)) + s.normal * cosine;
}

/// Fraction of the light from `l` that is reflected, by the midpoint rule.
double albedo_by_quadrature(const YarnBrdf& s, const V3d& l) {
  constexpr int rows = 300;
  constexpr int columns = 600;
  double sum = 0;
  for (int i = 0; i < rows; ++i) {
    // Equal steps of the squared cosine: the cosine's weight is in them.
    const double cosine = std::sqrt((i + 0.5) / rows);
    for (int j = 0; j < columns; ++j)
      sum += reflectance(s, l, direction(s, cosine, 2 * pi * (j + 0.5) / columns)).x;
  }
  return sum * pi / (rows * columns);
}

}  // namespace

TEST_CASE("yarn is reciprocal") {
  const YarnBrdf s = yarn(0.4, 0.7F, 0.2F, 0.5F);
  for (std::uint32_t i = 0; i < 200; ++i) {
    PathSampler sampler(i, 1);
    const V3d a = cosine_direction(s.normal, sampler.next_pair());
    const V3d b = cosine_direction(s.normal, sampler.next_pair());
    CHECK(reflectance(s, a, b).x == doctest::Approx(reflectance(s, b, a).x).epsilon(1e-12));
  }
}

TEST_CASE("yarn reflects no more light than falls on it, from any direction") {
  for (const auto& [roughness, weight] : {std::pair(0.1F, 1.0F), {0.3F, 1.0F}, {1.0F, 1.0F}, {0.2F, 0.3F}}) {
    const float lustre = weight < 1 ? 0.5F : 0.0F;
    const YarnBrdf white = yarn(1, weight, roughness, lustre);
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
          if (const auto sample = sample_bsdf(white, l, sampler.next_pair()))
            kept += sample->weight.x / count;
        }
        // Weights lie in [0, 2]: deviation of the mean at most 1 / 128, less by even spreading.
        CHECK(std::abs(kept - albedo) < 4.0 / 128);
      }
    }
  }
}

TEST_CASE("yarn with lustre reflects all light that matt yarn does, most of it about the mirror direction") {
  for (const float lustre : {0.02F, 0.1F, 0.5F, 0.75F, max_lustre}) {
    CAPTURE(lustre);
    const YarnBrdf s = yarn(0.6, 0, 0.3F, lustre);
    for (const double azimuth : {0.0, 0.7, pi / 2}) {
      for (const double cosine : {0.1, 0.5, 1.0}) {
        const V3d l = direction(s, cosine, azimuth);
        CHECK(albedo_by_quadrature(s, l) == doctest::Approx(0.6).epsilon(2e-3));
        constexpr std::uint32_t count = 16384;
        double mean = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
          PathSampler sampler(i, 4);
          if (const auto sample = sample_bsdf(s, l, sampler.next_pair())) mean += sample->weight.x / count;
        }
        CHECK(mean == doctest::Approx(0.6).epsilon(0.01));
      }
    }
    const V3d l = direction(s, 0.7, 0);
    CHECK(reflectance(s, l, direction(s, 0.7, pi)).x > reflectance(s, l, l).x);
  }
}

TEST_CASE("a packet has the gloss of single points") {
  GlossPacket packet;
  std::array<YarnBrdf, packet_size> surfaces;
  std::array<V3d, packet_size> views;
  for (std::size_t i = 0; i < packet_size; ++i) {
    const auto k = static_cast<float>(i);
    surfaces[i] = yarn(0.5, 0.1F + 0.05F * k, 0.05F + 0.05F * k, 0.05F * k);
    views[i] = direction(surfaces[i], 0.05 + 0.05 * static_cast<double>(i), 0.4 * static_cast<double>(i));
    if (i == 3) surfaces[i].gloss.weight = 0;
    packet.set_lane(i, surfaces[i], views[i]);
  }
  for (std::uint32_t k = 0; k < 200; ++k) {
    const V3f light(V3d(1, 0, 0) * (k == 0 ? 1.0 : 0.0) + cosine_direction({0, 0, 1}, sobol_point(k, 9)));
    const V3f unit = light.normalized();
    GlossPacket::Lanes body;
    GlossPacket::Lanes gloss;
    packet.reflectance(unit, body, gloss);
    for (std::size_t i = 0; i < packet_size; ++i) {
      const double dull = 0.5 * (1 - static_cast<double>(surfaces[i].gloss.weight));
      const bool lit = V3d(unit).dot(surfaces[i].normal) > 0;
      const double exact = lit ? reflectance(surfaces[i], V3d(unit), views[i]).x : 0;
      const auto sum = lit ? static_cast<double>(body[i]) * dull + static_cast<double>(gloss[i]) : 0;
      // Single precision; at a width of 0.05 the half vector's rounding counts 400 times, twice.
      CHECK(sum == doctest::Approx(exact).epsilon(1e-3));
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
          const V2d p = sobol_point(static_cast<std::uint32_t>(i), seed);
          const int rows = count / columns;
          ++in[static_cast<int>(p.x * columns) * rows + static_cast<int>(p.y * rows)];
        }
        CHECK(std::count(in.begin(), in.end(), 1) == count);
      }
    }
  }
}
