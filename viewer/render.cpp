#include "viewer/render.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "viewer/materials.h"

namespace selvedge {
namespace {

/// Pixels that are drawn, read back and evaluated at a time: bounds the memory of large frames, and holds a
/// frame of 1920 x 1080 whole.
constexpr int pixels_per_band = 1 << 21;

/// Adds the time since the last call to one of the stages.
class Watch {
 public:
  void add_to(double& stage) {
    const auto now = std::chrono::steady_clock::now();
    stage += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

Result<void> check(const RenderOptions& o) {
  const auto refuse = [](const char* option, std::string reason) -> Result<void> {
    return fail(Code::option_out_of_range, "", option, std::move(reason));
  };
  if (o.supersample < 1 || o.supersample > 16) return refuse("--supersample", "must lie between 1 and 16");
  const int limit = index_pass_side_limit / o.supersample;
  if (o.width < 1 || o.height < 1 || o.width > limit || o.height > limit)
    return refuse("--size", fmt::format("must lie between 1x1 and {0}x{0}", limit));
  if (o.layers < 1 || o.layers > 64) return refuse("--layers", "must lie between 1 and 64");
  if (o.forced_level < -1) return refuse("--level", "must not be negative");
  return {};
}

Result<void> check(const Scene& scene, const std::vector<Fabric>& fabrics) {
  for (std::size_t i = 0; i < fabrics.size(); ++i) {
    const std::vector<FabricLevel>& levels = fabrics[i].levels;
    const std::string name = i < scene.fabrics.size() ? scene.fabrics[i].name : "";
    if (levels.empty()) return fail(Code::fabric_malformed, name, "", "the fabric has no level");
    for (std::size_t k = 0; k < levels.size(); ++k) {
      const auto step = static_cast<int>(k);
      if (levels[k].width != level_size(levels[0].width, step) ||
          levels[k].height != level_size(levels[0].height, step))
        return fail(Code::fabric_malformed, name, fmt::format("level {}", k),
                    "its size does not follow from level 0");
    }
    if (levels.size() > static_cast<std::size_t>(level_count(levels[0].width, levels[0].height)))
      return fail(Code::fabric_malformed, name, "", "there are more levels than sizes");
  }
  return {};
}

/// An even number of rows, so that OpenGL's quads of 2 x 2 pixels lie the same in every band, and a multiple
/// of the supersampling.
int rows_per_band(int width, int height, int supersample) {
  const int step = 2 * supersample;
  const int rows = std::max(pixels_per_band / width / step, 1) * step;
  return std::min(rows, (height + step - 1) / step * step);
}

}  // namespace

Result<Frame> render(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
                     const RenderOptions& options, RenderStats* stats) {
  RenderStats unwanted;
  RenderStats& s = stats != nullptr ? *stats : unwanted;
  s = {};
  Watch watch;
  if (const auto good = check(options); !good) return tl::unexpected(good.error());
  if (const auto good = check(scene, fabrics); !good) return tl::unexpected(good.error());
  const Result<std::vector<V3d>> points = world_points(scene);
  if (!points) return tl::unexpected(points.error());

  // Coordinates relative to the scene's centre keep their digits in float.
  Imath::Box3d bounds;
  for (const V3d& point : *points) bounds.extendBy(point);
  const V3d origin = bounds.center();
  const Result<std::vector<Surface>> surfaces = build_surfaces(scene, origin);
  if (!surfaces) return tl::unexpected(surfaces.error());
  if (surfaces->size() > 65534)
    return fail(Code::gltf_unsupported, scene.file, "", "more than 65534 surfaces to draw");
  for (const Surface& surface : *surfaces)
    s.triangles += static_cast<std::int64_t>(surface.indices.size() / 3);
  const Result<Looks> looks = looks_of(scene, *surfaces, fabrics.size(), s.remarks);
  if (!looks) return tl::unexpected(looks.error());

  const Result<std::unique_ptr<GraphicsContext>> context = make_osmesa_context();
  if (!context) return tl::unexpected(context.error());
  if (const auto good = (*context)->make_current(); !good) return tl::unexpected(good.error());
  const Result<GlFunctions> gl = load_gl_functions(**context);
  if (!gl) return tl::unexpected(gl.error());

  const int n = options.supersample;
  const int width = options.width * n;
  const int height = options.height * n;
  const int band_rows = rows_per_band(width, height, n);
  const Result<std::unique_ptr<IndexPass>> pass =
      IndexPass::create(*gl, *surfaces, looks->looks, fabrics, looks->images,
                        {width, height, band_rows, options.blend_levels, options.forced_level});
  if (!pass) return tl::unexpected(pass.error());
  watch.add_to(s.prepare);

  const M44d clip = clip_matrix(camera, origin);
  const ShadingScene shading{camera, width, height, looks->looks, fabrics, options.lights};
  const std::size_t band_pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(band_rows);
  Frame frame{options.width, options.height, {}};
  frame.pixels.resize(static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height),
                      V4f(0, 0, 0, 0));
  std::vector<V4f> pixels(band_pixels, V4f(0, 0, 0, 0));
  std::vector<std::uint8_t> finished(band_pixels);
  PixelLayer layer;
  for (int first_row = 0; first_row < height; first_row += band_rows) {
    std::fill(pixels.begin(), pixels.end(), V4f(0, 0, 0, 0));
    for (int k = 0; k < options.layers; ++k) {
      const Result<bool> any = (*pass)->draw(clip, first_row, k, finished);
      if (!any) return tl::unexpected(any.error());
      watch.add_to(s.geometry);
      if (!*any) break;
      (*pass)->read(layer);
      watch.add_to(s.read_back);
      const LayerCount count = shade_layer(shading, layer, first_row, pixels, finished);
      watch.add_to(s.evaluation);
      if (k == 0) s.covered_pixels += count.covered;
      s.evaluated_pixels += count.covered;
      s.layers = std::max(s.layers, k + 1);
      if (count.open == 0) break;
    }
    box_filter(pixels, first_row, n, frame);
    watch.add_to(s.filter);
  }
  return frame;
}

}  // namespace selvedge
