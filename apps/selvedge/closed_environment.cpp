#include "apps/selvedge/closed_environment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "format/base/guard.h"

namespace selvedge {
namespace {

constexpr int direction_count = 1 << 19;
constexpr double two_pi = 2 * std::numbers::pi;

double cosine_of(double degrees) { return std::cos(degrees * std::numbers::pi / 180); }

/// Integral of f times share(cosine) over the directions whose cosine to the axis is more than `least`: a
/// mean over a spiral, each point of which stands for the same area.
template <class Share>
V3d integral(QueriedFabric& fabric, FabricQuery query, const V3d& axis, double least, const Share& share) {
  const V3d side = axis.cross(std::abs(axis.x) < 0.5 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized();
  const V3d other = axis.cross(side);
  V3d sum(0, 0, 0);
  for (int i = 0; i < direction_count; ++i) {
    const double cosine = 1 - (1 - least) * (i + 0.5) / direction_count;
    const double turns = i * std::numbers::phi;
    const double angle = two_pi * (turns - std::floor(turns));
    const double sine = std::sqrt(1 - cosine * cosine);
    query.light = V3f(axis * cosine + (side * std::cos(angle) + other * std::sin(angle)) * sine);
    if (query.light.z <= 0 && !fabric.lets_through()) continue;
    sum += V3d(value_or_throw(fabric.shade(query)).radiance) * share(cosine);
  }
  return sum * (two_pi * (1 - least) / direction_count);
}

}  // namespace

double ClosedEnvironment::pattern(double cosine) const {
  switch (kind) {
    case Kind::constant:
      return 0;
    case Kind::cosine:
      return cosine;
    case Kind::lobe:
      return cosine > 0 ? std::pow(cosine, exponent) : 0;
    case Kind::disc:
      return cosine > cosine_of(degrees) ? 1 : 0;
  }
  return 0;
}

Shading shown(QueriedFabric& fabric, const EnvironmentQuery& query) {
  const ClosedEnvironment& e = query.environment;
  Shading result = value_or_throw(fabric.shade(query.place));
  V3d light = e.a * integral(fabric, query.place, V3d(0, 0, 1), fabric.lets_through() ? -1 : 0,
                             [](double) { return 1.0; });
  if (e.kind != ClosedEnvironment::Kind::constant) {
    // A small disc has all of the directions.
    const bool disc = e.kind == ClosedEnvironment::Kind::disc;
    const double least = disc ? cosine_of(e.degrees) : e.kind == ClosedEnvironment::Kind::lobe ? 0 : -1;
    light += e.b * integral(fabric, query.place, e.axis, least,
                            [&](double cosine) { return disc ? 1 : e.pattern(cosine); });
  }
  const double alpha = result.alpha;
  const V3d radiance = light * alpha + query.background.value_or(e.at(-V3d(query.place.view))) * (1 - alpha);
  for (int c = 0; c < 3; ++c)
    result.radiance[c] =
        static_cast<float>(std::min(radiance[c], static_cast<double>(std::numeric_limits<float>::max())));
  return result;
}

}  // namespace selvedge
