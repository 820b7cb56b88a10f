#include "viewer/swatch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/scene/swatch.h"
#include "viewer/scene/material.h"

namespace selvedge {

Result<Swatch> make_swatch(const Fabric& fabric, const SwatchOptions& options) {
  const auto refuse = [](const char* option, std::string reason) {
    return fail(Code::option_out_of_range, "", option, std::move(reason));
  };
  const auto levels = static_cast<int>(fabric.levels.size());
  if (options.level != -1 && (options.level < 0 || options.level >= levels))
    return refuse("--level", fmt::format("must lie between 0 and {}", levels - 1));
  if (!(options.pixels_per_texel > 0 && options.pixels_per_texel <= 1024))
    return refuse("--pixels-per-texel", "must lie above 0 and up to 1024");
  const double length = options.view.length();
  if (!std::isfinite(length) || !(options.view.z > 0))
    return refuse("--view", "must have z > 0 and be finite");

  const V2d pixels =
      V2d(fabric.repeat_texels(std::max(options.level, 0))) * V2d(options.repeats) * options.pixels_per_texel;
  if (!(pixels.x <= max_frame_side && pixels.y <= max_frame_side))
    return refuse("--pixels-per-texel",
                  fmt::format("the swatch would be larger than {} pixels", max_frame_side));

  Swatch swatch;
  swatch.width = std::max(1, static_cast<int>(std::lround(pixels.x)));
  swatch.height = std::max(1, static_cast<int>(std::lround(pixels.y)));
  const V2d size = V2d(fabric.period_mm) * V2d(options.repeats) / 1000.0;
  swatch.scene = swatch_scene(V2d(fabric.period_mm), {0, 0}, options.repeats);

  swatch.camera.projection = Projection::parallel;
  swatch.camera.position = V3d(size.x / 2, -size.y / 2, 0);
  swatch.camera.to_viewer = options.view / length;
  swatch.camera.window_half_size = size / 2;
  swatch.camera.near = -1;
  swatch.camera.far = 1;
  return swatch;
}

}  // namespace selvedge
