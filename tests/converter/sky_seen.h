// A white furnace: what a path sees of a sky of radiance 1 all around. Shared by the tests of light.
#pragma once

#include "converter/light/path_tracer.h"

namespace selvedge::test {

/// The light of one path from `origin` in `direction`.
inline double sky_seen(const RayScene& scene, const PathTracer& tracer, const V3d& origin,
                       const V3d& direction, PathSampler& sampler) {
  SurfacePoint at;
  if (!scene.trace(origin, direction, at)) return 1;
  V3d towards = -direction;
  V3d throughput(1, 1, 1);
  for (int depth = 0;; ++depth) {
    const auto next = tracer.continue_path(at, towards, depth, sampler, throughput);
    if (!next) return 0;
    if (!scene.trace(scene.offset_origin(at, *next), *next, at)) return throughput.x;
    towards = -*next;
  }
}

}  // namespace selvedge::test
