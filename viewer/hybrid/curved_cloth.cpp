#include "viewer/hybrid/curved_cloth.h"

#include <algorithm>
#include <limits>

namespace selvedge {

float grazing_depth(const V3f& view, float curvature, float thickness) {
  const float level2 = view.x * view.x + view.y * view.y;
  if (!(curvature > 0) || !(thickness > 0) || !(level2 > 0)) return std::numeric_limits<float>::infinity();
  const float rise = std::max(view.z, 0.0F);
  return 0.5F * rise * rise / (level2 * std::min(curvature, 0.25F / thickness));
}

float curvature_along(const CurvedTriangle& triangle, const V2f& period, const V2f& across, const V3f& along,
                      float normal_length) {
  const auto edge = [&](int corner) {
    const V2f step = triangle.uv[corner] - triangle.uv[0];
    return V2f(step.x * period.x, -step.y * period.y);
  };
  const V2f a = edge(1);
  const V2f b = edge(2);
  const float area = a.x * b.y - a.y * b.x;
  if (area == 0) return 0;
  // across = of_a a + of_b b
  const float of_a = (across.x * b.y - across.y * b.x) / area;
  const float of_b = (a.x * across.y - a.y * across.x) / area;
  const V3f turn =
      (triangle.normals[1] - triangle.normals[0]) * of_a + (triangle.normals[2] - triangle.normals[0]) * of_b;
  return turn.dot(along) / normal_length;
}

}  // namespace selvedge
