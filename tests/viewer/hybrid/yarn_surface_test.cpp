#include "viewer/hybrid/yarn_surface.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/format/yarn_data.h"

namespace selvedge {
namespace {

constexpr V2f period(2.5F, 1.75F);

/// Glossy curves with hairs and thick places, one turned over.
YarnData stranded(Random& random) {
  YarnData data = test::tangle(random, period, 6);
  for (std::size_t c = 0; c < data.curves.size(); ++c) {
    YarnCurve& curve = data.curves[c];
    curve.gloss = {0.3F, 0.4F};
    curve.fibre_slope = 0.4F;
    curve.hairs = {c == 4 ? -60 : 60, 0.4F, 0.3F, 0.02F, 0.9F};
    if (c % 2 == 1) curve.flattening = 0.5F;
    if (c % 3 == 0) continue;  // smooth
    const int count = static_cast<int>(5 + 7 * c);
    curve.strands = {c == 4 ? -count : count, 5, -17, static_cast<int>(c), 0.2F, 3};
  }
  return data;
}

V3f upwards(Random& random) {
  const double z = 0.1 + 0.9 * random.uniform();
  const double turn = 2 * std::numbers::pi * random.uniform();
  const double r = std::sqrt(1 - z * z);
  return V3f(V3d(r * std::cos(turn), r * std::sin(turn), z));
}

}  // namespace

TEST_CASE("many points of yarn have the strands, direct and indirect light of each by itself") {
  Random random(3);
  const Yarns yarns(stranded(random), period);
  int seen = 0;
  int of_hairs = 0;
  int apart = 0;
  for (int packet = 0; packet < 2000; ++packet) {
    YarnLanes beside;
    YarnLanes view;
    YarnLanes light;
    for (std::size_t i = 0; i < yarn_lanes; ++i) {
      beside.set(i, V3f(static_cast<float>(random.uniform()), static_cast<float>(random.uniform()), 0));
      view.set(i, upwards(random));
      light.set(i, upwards(random));
    }
    YarnHits hits;
    const std::uint32_t met = yarns.trace(V2d(0, 0), beside, 0.3F, view, 0xffff, hits);
    if (met == 0) continue;
    YarnSurface surface;
    YarnReflection reflection;
    find_surface(yarns, {}, hits, met, view, {}, surface);
    reflect(surface, light, view, reflection);
    for (std::size_t i = 0; i < yarn_lanes; ++i) {
      if ((met >> i & 1) == 0) continue;
      YarnPoint point = yarns.point_at({hits.segment[i], hits.from_start.at(i)});
      yarns.add_strands(point, view.at(i));
      const V3f direct = yarns.direct(point, light.at(i), view.at(i));
      const V3f indirect = indirect_light(yarns.transfer_at(point), light.at(i)) * point.brightness;
      const float error = (reflection.direct.at(i) - direct).length() / (1 + direct.length()) +
                          (reflection.indirect.at(i) - indirect).length() +
                          (surface.normal.at(i) - point.strand).length();
      ++seen;
      of_hairs += point.hair ? 1 : 0;
      apart += error < 1e-3F ? 0 : 1;
    }
  }
  MESSAGE(apart, " of ", seen);
  CHECK(seen > 5000);
  CHECK(of_hairs > 500);
  // Rounding takes either of two strands within 10^-4 of their edge.
  CHECK(apart < seen / 1000);
}

TEST_CASE("strands thinner than a pixel are not seen, but make yarn darker and its highlight wider") {
  Random random(3);
  YarnData data = stranded(random);
  for (YarnCurve& curve : data.curves) curve.strands.irregularity = 0;
  const Yarns yarns(std::move(data), period);
  for (int packet = 0; packet < 100; ++packet) {
    YarnLanes beside;
    YarnLanes view;
    for (std::size_t i = 0; i < yarn_lanes; ++i) {
      beside.set(i, V3f(static_cast<float>(random.uniform()), static_cast<float>(random.uniform()), 0));
      view.set(i, upwards(random));
    }
    YarnHits hits;
    const std::uint32_t met = yarns.trace(V2d(0, 0), beside, 0.3F, view, 0xffff, hits);
    if (met == 0) continue;
    YarnSurface::Floats wide;
    wide.fill(1e6F);
    YarnSurface surface;
    find_surface(yarns, {}, hits, met, view, wide, surface);
    for (std::size_t i = 0; i < yarn_lanes; ++i) {
      if ((met >> i & 1) == 0) continue;
      const YarnPoint point = yarns.point_at({hits.segment[i], hits.from_start.at(i)});
      const YarnCurve& curve = yarns.data().curves[point.curve];
      CHECK((surface.normal.at(i) - point.normal).length() < 1e-5F);
      CHECK((surface.fibre.at(i) - point.fibre).length() < 1e-5F);
      const V3f smooth = curve.albedo * ((1 - curve.gloss.weight) * std::numbers::inv_pi_v<float>);
      const bool has_strands = curve.strands.count != 0 && !point.hair;
      CHECK((surface.matt.at(i).x < 0.99F * smooth.x) == has_strands);
      CHECK((surface.roughness[i] > 1.01F * curve.gloss.roughness) == has_strands);
    }
  }
}

}  // namespace selvedge
