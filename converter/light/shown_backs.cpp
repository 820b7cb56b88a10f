#include "converter/light/shown_backs.h"

#include "converter/light/sobol.h"
#include "converter/light/yarn_brdf.h"

namespace selvedge {
namespace {

/// Share of rays that may meet backs of triangles before both sides count as outside.
constexpr double max_backs = 0.005;

}  // namespace

bool shows_backs(const RayScene& scene, int bounces, bool from_below) {
  constexpr std::uint32_t count = 4096;
  const V2d period = scene.period();
  const double above = static_cast<double>(scene.bounds().max.z) + period.x;
  int hits = 0;
  int backs = 0;
  for (std::uint32_t i = 0; i < (from_below ? 2 * count : count); ++i) {
    const bool down = i < count;
    PathSampler sampler(i, 0);
    const V2d share = sampler.next();
    V3d origin(share.x * period.x, share.y * period.y, down ? above : -period.x);
    V3d direction = cosine_direction({0, 0, down ? -1.0 : 1.0}, sampler.next());
    SurfacePoint point;
    for (int k = 0; k <= bounces && scene.trace(origin, direction, point); ++k) {
      ++hits;
      if (point.back) {
        ++backs;
        break;
      }
      origin = scene.leave(point);
      direction = cosine_direction(V3d(point.face_normal), sampler.next());
    }
  }
  return backs > max_backs * hits;
}

}  // namespace selvedge
