#include "viewer/frame/backdrop.h"

#include "format/base/parallel.h"
#include "viewer/scene/view_rays.h"

namespace selvedge {

void add_backdrop(const Camera& camera, const std::function<V3f(const V3d&)>& radiance, Frame& frame) {
  const ViewRays rays = view_rays(camera, frame.width, frame.height);
  parallel_for(0, frame.height, [&](int y) {
    for (int x = 0; x < frame.width; ++x) {
      V4f& pixel = frame.pixels[static_cast<std::size_t>(y) * frame.width + x];
      const float right = static_cast<float>(x) + 0.5F - 0.5F * static_cast<float>(frame.width);
      const float up = 0.5F * static_cast<float>(frame.height) - static_cast<float>(y) - 0.5F;
      const V3d away = -V3d(rays.base + rays.right * right + rays.up * up).normalized();
      const V3f seen = radiance(away) * (1 - pixel.w);
      pixel = V4f(pixel.x + seen.x, pixel.y + seen.y, pixel.z + seen.z, 1);
    }
  });
}

}  // namespace selvedge
