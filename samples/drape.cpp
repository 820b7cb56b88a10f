#include "samples/drape.h"

namespace selvedge::samples {
namespace {

/// The body's outward direction, by central differences.
V3d outwards(const std::function<double(const V3d&)>& body, const V3d& p) {
  constexpr double h = 1e-4;
  const V3d gradient(body(p + V3d(h, 0, 0)) - body(p - V3d(h, 0, 0)),
                     body(p + V3d(0, h, 0)) - body(p - V3d(0, h, 0)),
                     body(p + V3d(0, 0, h)) - body(p - V3d(0, 0, h)));
  return gradient.normalized();
}

/// Moves a point out of the body and brakes its sliding along it.
void keep_outside(const std::function<double(const V3d&)>& body, const DrapeOptions& options,
                  const V3d& before, V3d& p) {
  const double depth = options.margin - body(p);
  if (depth <= 0) return;
  const V3d normal = outwards(body, p);
  p += normal * depth;
  V3d slide = p - before;
  slide -= normal * slide.dot(normal);
  const double length = slide.length();
  const double grip = options.friction * depth;
  p -= length > grip ? slide * (grip / length) : slide;
}

}  // namespace

std::vector<V3d> drape(const Cloth& cloth, const std::function<double(const V3d&)>& body,
                       const DrapeOptions& options) {
  std::vector<V3d> positions = cloth.positions;
  std::vector<V3d> velocities(positions.size(), V3d(0, 0, 0));
  std::vector<V3d> before = positions;
  const double h = options.step;
  for (int step = 0; step < options.steps; ++step) {
    before = positions;
    for (std::size_t v = 0; v < positions.size(); ++v) {
      if (cloth.held[v]) continue;
      velocities[v].y -= options.gravity * h;
      velocities[v] *= 1 - options.drag * h;
      positions[v] += velocities[v] * h;
    }
    for (const Thread& thread : cloth.threads) {
      const int a = thread.a, b = thread.b;
      const double weight_a = cloth.held[a] ? 0 : 1;
      const double weight_b = cloth.held[b] ? 0 : 1;
      if (weight_a + weight_b == 0) continue;
      const V3d span = positions[b] - positions[a];
      const double length = span.length();
      if (length == 0) continue;
      const V3d pull =
          span * ((length - thread.length) / (length * (weight_a + weight_b + thread.compliance / (h * h))));
      positions[a] += pull * weight_a;
      positions[b] -= pull * weight_b;
    }
    for (std::size_t v = 0; v < positions.size(); ++v) {
      if (cloth.held[v]) continue;
      keep_outside(body, options, before[v], positions[v]);
      velocities[v] = (positions[v] - before[v]) / h;
    }
  }
  return positions;
}

std::vector<V3d> smooth(const Cloth& cloth, int rounds, double swell) {
  std::vector<V3d> positions = cloth.positions;
  for (int half = 0; half < 2 * rounds; ++half) {
    const double move = half % 2 == 0 ? 0.5 : -swell;
    std::vector<V3d> sums(positions.size(), V3d(0, 0, 0));
    std::vector<int> counts(positions.size(), 0);
    for (const Thread& thread : cloth.threads) {
      if (thread.compliance > 0) continue;
      const int a = thread.a, b = thread.b;
      sums[a] += positions[b];
      ++counts[a];
      sums[b] += positions[a];
      ++counts[b];
    }
    for (std::size_t v = 0; v < positions.size(); ++v) {
      if (cloth.held[v] || counts[v] == 0) continue;
      positions[v] += (sums[v] / counts[v] - positions[v]) * move;
    }
  }
  return positions;
}

}  // namespace selvedge::samples
