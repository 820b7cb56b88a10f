#include "converter/stitch/flat_yarn.h"

#include <algorithm>

namespace selvedge {

V3d squeeze_at(const Yarn& yarn, std::size_t segment, double t) {
  if (is_round(yarn)) return {0, 0, 0};
  if (yarn.squeezes.empty())
    return squeeze_of(yarn.flattening, derivative_at(yarn.segments[segment], t).normalized());
  return squeeze_between(yarn.squeezes[segment], yarn.squeezes[(segment + 1) % yarn.squeezes.size()], t);
}

V3d separating_direction(const V3d& apart, const YarnSection& a, const YarnSection& b, int steps) {
  V3d direction = apart.normalized();
  if (a.squeeze == V3d(0, 0, 0) && b.squeeze == V3d(0, 0, 0)) return direction;
  // With supports h = sqrt(d.S d), the distance is largest where apart - (S_a / h_a + S_b / h_b) d is along
  // d. Near contact that is small, so that apart is nearly a multiple of the sum, whose inverse each step
  // takes: one is enough where the sections are alike. Any direction is safe.
  for (int step = 0; step < steps; ++step) {
    V3d sum[3] = {V3d(0), V3d(0), V3d(0)};
    for (const YarnSection* s : {&a, &b}) {
      const double thin = 1 - s->squeeze.length2();
      const double scale = s->radius * s->radius / support_of(*s, direction);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          sum[i][j] += scale * ((i == j ? thin : 0) + s->squeeze[i] * s->squeeze[j] * (1 + thin) / thin);
    }
    // By the adjugate, as the determinant is positive.
    direction =
        V3d(apart.dot(sum[1].cross(sum[2])), apart.dot(sum[2].cross(sum[0])), apart.dot(sum[0].cross(sum[1])))
            .normalized();
  }
  return direction;
}

double min_half_thickness(const StitchPattern& pattern) {
  double thinnest = half_thickness_of(pattern.yarns.front());
  for (const Yarn& yarn : pattern.yarns) thinnest = std::min(thinnest, half_thickness_of(yarn));
  return thinnest;
}

}  // namespace selvedge
