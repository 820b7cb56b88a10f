#include "viewer/render_checks.h"

#include <fmt/format.h>

#include "viewer/hybrid/layers.h"
#include "viewer/light/shadows.h"
#include "viewer/paper/limits.h"

namespace selvedge {

namespace {

Result<void> refuse(const char* option, std::string reason) {
  return fail(Code::option_out_of_range, "", option, std::move(reason));
}

Result<void> check_paper(const DrawOptions& o) {
  if (o.levels.area || o.levels.bias != 0)
    return refuse("--filter",
                  "the paper's path takes one texel of a level, the nearest, and OpenGL's level as it is");
  if (o.shadows > 0)
    return refuse("--shadows",
                  "the paper's frames do not have the pixel's place, which shadows need: take --path hybrid");
  if (o.around)
    return refuse("--environment", "the paper's path knows no light from all around: take --path hybrid");
  return check_paper_lights(o.lights);
}

}  // namespace

Result<void> check_size(const FrameSize& size) {
  if (size.supersample < 1 || size.supersample > 16)
    return refuse("--supersample", "must lie between 1 and 16");
  const int limit = index_pass_side_limit / size.supersample;
  if (size.width < 1 || size.height < 1 || size.width > limit || size.height > limit)
    return refuse("--size", fmt::format("must lie between 1x1 and {0}x{0}", limit));
  if (size.layers < 1 || size.layers > max_layers)
    return refuse("--layers", fmt::format("must lie between 1 and {}", max_layers));
  return {};
}

Result<void> check_draw(RenderPath path, const DrawOptions& o) {
  if (o.levels.forced < -1) return refuse("--level", "must not be negative");
  if (path == RenderPath::shader && o.power != PowerKind::exact)
    return refuse("--power", "is the processor's; with --path shader OpenGL computes its own powers");
  if (path == RenderPath::paper) return check_paper(o);
  if (o.shadows != 0 && (o.shadows < min_shadow_size || o.shadows > max_shadow_size))
    return refuse("--shadows", fmt::format("must lie between {} and {}", min_shadow_size, max_shadow_size));
  return {};
}

Result<void> check_options(const RenderOptions& options) {
  if (auto good = check_size(options); !good) return good;
  return check_draw(options.path, options);
}

}  // namespace selvedge
