#include "fitter/gloss/gloss.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace selvedge {
namespace {

std::vector<V3d> in_frame(const GlossKind& kind, const std::vector<V3d>& directions) {
  const V3d binormal = kind.normal.cross(kind.tangent);
  std::vector<V3d> result;
  for (const V3d& d : directions)
    result.emplace_back(d.dot(kind.tangent), d.dot(binormal), d.dot(kind.normal));
  return result;
}

/// g without units.
std::vector<double> values_of(const GlossKind& kind, const GlossDirections& directions) {
  const std::vector<V3d> lights = in_frame(kind, directions.lights);
  std::vector<double> g(directions.count(), 0);
  double* to = g.data();
  for (const V3d& v : in_frame(kind, directions.views)) {
    for (const V3d& l : lights) {
      if (l.z > 0) {
        double sum = 0;
        for (std::size_t j = 0; j < kind.shapes.size(); ++j) {
          const auto& d = kind.shapes[j].direction;
          const double base = d[0] * l.x * v.x + d[1] * l.y * v.y + d[2] * l.z * v.z;
          if (base > 0 && kind.sizes[j] > 0) sum += kind.sizes[j] * std::pow(base, kind.shapes[j].exponent);
        }
        for (std::size_t c = 0; c < 3; ++c) to[c] = l.z * (kind.rho[c] + sum);
      }
      to += 3;
    }
  }
  return g;
}

}  // namespace

GlossDirections gloss_directions(const DirectionGrid& views, const DirectionGrid& lights) {
  GlossDirections result;
  for (const V3f& d : directions_of(views)) result.views.emplace_back(d);
  for (const V3f& d : directions_of(lights)) result.lights.emplace_back(d);
  return result;
}

std::vector<double> gloss_values(const GlossKind& kind, const GlossDirections& directions,
                                 const std::vector<float>& unit) {
  std::vector<double> g = values_of(kind, directions);
  for (std::size_t i = 0; i < g.size(); ++i) g[i] /= static_cast<double>(unit[i % unit.size()]);
  return g;
}

void normalise(SlabGloss& gloss, const GlossDirections& directions) {
  std::vector<double> texels(gloss.kinds.size(), 0);
  for (const std::uint16_t kind : gloss.kind_of) texels[kind] += 1;
  std::vector<double> power(3 * directions.lights.size(), 0);
  for (std::size_t k = 0; k < gloss.kinds.size(); ++k) {
    const std::vector<double> g = values_of(gloss.kinds[k], directions);
    for (std::size_t i = 0; i < g.size(); ++i) power[i % power.size()] += texels[k] * g[i] * g[i];
  }
  const auto all = static_cast<double>(gloss.kind_of.size() * directions.views.size());
  const double square =
      std::accumulate(power.begin(), power.end(), 0.0) / static_cast<double>(power.size()) / all;
  if (square > 0) {
    const double factor = 1 / std::sqrt(square);
    for (GlossKind& kind : gloss.kinds) {
      for (double& rho : kind.rho) rho *= factor;
      for (double& size : kind.sizes) size *= factor;
    }
    for (double& p : power) p *= factor * factor;
  }
  // A minimum, so that noise is not scaled up for lights with almost no radiance.
  constexpr double min_share = 1e-6;
  const double min_power = min_share * *std::max_element(power.begin(), power.end());
  gloss.unit.clear();
  for (const double p : power) {
    const double unit = std::sqrt(std::max(p, min_power) / all);
    gloss.unit.push_back(unit > 0 ? static_cast<float>(unit) : 1);
  }
}

SlabFactors factors_of(const SlabGloss& gloss, const GlossDirections& directions) {
  SlabFactors factors;
  factors.kind = gloss.kind_of;
  for (const GlossKind& kind : gloss.kinds) {
    for (const double g : gloss_values(kind, directions, gloss.unit)) {
      factors.value.push_back(static_cast<float>(g));
    }
  }
  return factors;
}

void set_gloss(const SlabGloss& gloss, FabricLevel& level) {
  Layer lobes{3 * parameter_count(static_cast<int>(gloss.kinds.front().shapes.size())), {}};
  Layer frame{6, {}};
  for (const std::uint16_t index : gloss.kind_of) {
    const GlossKind& kind = gloss.kinds[index];
    for (const V3f& axis : {V3f(kind.normal), V3f(kind.tangent)}) {
      frame.values.insert(frame.values.end(), {axis.x, axis.y, axis.z});
    }
    for (const double rho : kind.rho) {
      lobes.values.push_back(static_cast<float>(rho));
      for (std::size_t j = 0; j < kind.shapes.size(); ++j) {
        const LobeShape& shape = kind.shapes[j];
        const double c = kind.sizes[j] > 0 ? std::pow(kind.sizes[j], 1 / shape.exponent) : 0;
        for (const double d : shape.direction) lobes.values.push_back(static_cast<float>(c * d));
        lobes.values.push_back(static_cast<float>(shape.exponent));
      }
    }
  }
  level.set(LayerKind::lobes, std::move(lobes));
  level.set(LayerKind::frame, std::move(frame));
}

}  // namespace selvedge
