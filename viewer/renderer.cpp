#include "viewer/renderer.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>

#include "format/base/parallel.h"
#include "viewer/render_checks.h"
#include "viewer/renderer_state.h"

namespace selvedge {
namespace {

/// Pixels that are drawn, read back and evaluated at a time: bounds the memory of large frames.
constexpr int pixels_per_band = 1 << 21;
constexpr int bands_per_frame = 6;
constexpr int rasteriser_tile = 64;

Result<std::unique_ptr<GraphicsContext>> make_context(const RenderOptions& options) {
  if (options.context == ContextKind::egl) return make_egl_context();
  if (options.context == ContextKind::automatic && options.path == RenderPath::shader) {
    if (auto context = make_egl_context()) return context;
  }
  return make_osmesa_context();
}

/// A multiple of the supersampling, and an even number of rows, so that OpenGL's quads of 2 x 2 pixels lie
/// the same in every band. Whole tiles of the rasteriser, few enough that a band is drawn while the one
/// before is shaded.
int rows_per_band(int width, int height, int supersample) {
  const int share = (height / bands_per_frame + rasteriser_tile - 1) / rasteriser_tile * rasteriser_tile;
  const int rows = std::clamp(share, 1, std::max(pixels_per_band / width, 1));
  const int step = 2 * supersample;
  return std::max(rows / step, 1) * step;
}

}  // namespace

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Renderer::~Renderer() {
  // OpenGL's objects need their context.
  if (state_ && state_->context) static_cast<void>(state_->context->make_current());
}
const std::vector<std::string>& Renderer::remarks() const { return state_->remarks; }

Result<std::unique_ptr<Renderer>> Renderer::create(const Scene& scene, const std::vector<Fabric>& fabrics,
                                                   const RenderOptions& options,
                                                   std::unique_ptr<GraphicsContext> context) {
  Watch watch;
  if (const auto good = check_options(options); !good) return tl::unexpected(good.error());
  if (const auto good = check_fabrics(scene, fabrics); !good) return tl::unexpected(good.error());
  const Result<std::vector<V3d>> points = world_points(scene);
  if (!points) return tl::unexpected(points.error());

  auto state = std::make_unique<State>();
  State& s = *state;
  s.options = options;
  // Coordinates relative to the scene's centre keep their digits in float.
  Imath::Box3d bounds;
  for (const V3d& point : *points) bounds.extendBy(point);
  s.origin = bounds.center();
  const Result<std::vector<Surface>> surfaces = build_surfaces(scene, s.origin);
  if (!surfaces) return tl::unexpected(surfaces.error());
  Result<Materials> materials = materials_of(scene, *surfaces, fabrics.size(), s.remarks);
  if (!materials) return tl::unexpected(materials.error());
  s.materials = std::move(*materials);
  s.mesh = merge(*surfaces);
  for (const Fabric& fabric : fabrics) s.packed.push_back(pack(fabric));

  if (!context) {
    Result<std::unique_ptr<GraphicsContext>> own = make_context(options);
    if (!own) return tl::unexpected(own.error());
    context = std::move(*own);
  }
  s.context = std::move(context);
  if (auto good = s.context->make_current(); !good) return tl::unexpected(good.error());
  const Result<GlFunctions> gl = load_gl_functions(*s.context);
  if (!gl) return tl::unexpected(gl.error());
  s.gl = *gl;
  s.width = options.width * options.supersample;
  s.height = options.height * options.supersample;
  if (options.path == RenderPath::shader) {
    Result<std::unique_ptr<ShaderPath>> shader = ShaderPath::create(s.gl, s.mesh, s.materials, fabrics);
    if (!shader) return tl::unexpected(shader.error());
    s.shader = std::move(*shader);
  }
  s.band_rows = rows_per_band(s.width, s.height, options.supersample);
  if (options.path == RenderPath::paper) {
    if (auto good = s.make_paper(scene, *surfaces, fabrics); !good) return tl::unexpected(good.error());
  } else if (!s.shader) {
    if (auto good = s.need_pass(); !good) return tl::unexpected(good.error());
  }
  watch.add_to(s.prepare);
  return std::unique_ptr<Renderer>(new Renderer(std::move(state)));
}

Result<void> Renderer::draw(const Camera& camera, const RenderOptions& look, Frame& frame,
                            RenderStats& stats) {
  State& s = *state_;
  stats = {};
  stats.prepare = s.prepare;
  stats.triangles = static_cast<std::int64_t>(s.mesh.triangles.size());
  stats.remarks = s.remarks;
  if (auto good = s.context->make_current(); !good) return good;
  Watch watch;
  if (s.paper) {
    if (auto good = check_paper(look); !good) return good;
  }
  if (auto good = check_shadows(look); !good) return good;
  if (auto good = s.draw_shadows(look, !s.shader); !good) return good;
  if (look.shadows > 0) {
    watch.add_to(stats.shadows);
    if (s.shadows->views().size() < look.lights.size())
      stats.remarks.push_back(
          fmt::format("{} of {} lights cast no shadows: points, wide cones, and what comes after {} others",
                      look.lights.size() - s.shadows->views().size(), look.lights.size(), max_shadows));
  }
  frame.width = s.options.width;
  frame.height = s.options.height;
  frame.pixels.resize(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height));
  if (s.shader) return s.draw_shader(camera, look, frame, watch, stats);
  if (s.paper) {
    for (int first_row = 0; first_row < s.height; first_row += s.band_rows) {
      if (auto good = s.draw_paper(camera, look, first_row, frame, watch, stats); !good) return good;
    }
    return {};
  }
  return s.draw_hybrid(camera, look, frame, watch, stats);
}

Result<void> Renderer::resize(const RenderOptions& options) {
  State& s = *state_;
  if (auto good = check_options(options); !good) return good;
  const int width = options.width * options.supersample;
  const int height = options.height * options.supersample;
  s.options = options;
  if (width == s.width && height == s.height) return {};
  s.width = width;
  s.height = height;
  s.band_rows = rows_per_band(width, height, options.supersample);
  if (auto good = s.context->make_current(); !good) return good;
  if (s.paper) {
    if (auto good = s.paper->resize({width, height, s.band_rows}); !good) return good;
  }
  if (!s.pass) return {};
  return s.pass->resize({width, height, s.band_rows});
}

Result<std::optional<PixelProbe>> Renderer::probe(const Camera& camera, const RenderOptions& look,
                                                  const V2i& pixel) {
  State& s = *state_;
  if (const auto good = s.context->make_current(); !good) return tl::unexpected(good.error());
  if (const auto good = s.need_pass(); !good) return tl::unexpected(good.error());
  Watch watch;
  RenderStats unwanted;
  const int row = s.height - 1 - pixel.y;
  const ProjectedVertices projected = project(s.mesh, clip_matrix(camera, s.origin), s.width, s.height);
  s.pass->place(projected);
  const IndexScene index{s.mesh, projected, s.materials.materials, s.packed, look.levels};
  if (const auto good = s.draw_shadows(look, true); !good) return tl::unexpected(good.error());
  const ShadingScene shading = s.shading_of(camera, look);
  std::array<DrawnSide, 2>& sides = s.bands[0].sides;
  // A band of one row, and of it the tile that holds the pixel.
  FrameTiles where{row, 1, {}};
  where.tiles.resize((s.width + tile_side - 1) / tile_side);
  where.tiles[pixel.x / tile_side] = 1;
  if (const auto good = s.draw_nearest(list_triangles(s.mesh, projected, s.materials.materials, where), where,
                                       sides, watch, unwanted);
      !good)
    return tl::unexpected(good.error());
  const auto i = static_cast<std::size_t>(pixel.x);
  const std::optional<NearestSurface> nearest = nearest_surface(sides, i);
  if (!nearest) return std::nullopt;
  PixelTriangles pixels;
  pixels.count = 1;
  pixels.x[0] = static_cast<std::uint16_t>(pixel.x);
  pixels.y[0] = static_cast<std::uint16_t>(row);
  pixels.triangle[0] = nearest->triangle;
  pixels.back[0] = nearest->back;
  const VisibleSide& seen = sides[nearest->back ? 1 : 0].seen;
  pixels.has_pbr = !seen.colours.empty();
  if (pixels.has_pbr) pixels.pbr[0] = {seen.colours[i], seen.pbr[i]};
  return probe_pixel(index, shading, pixels);
}

Result<void> Renderer::texel_edges(const Camera& camera, const RenderOptions& look,
                                   std::vector<OverlayPixel>& overlay) {
  State& s = *state_;
  if (auto good = s.context->make_current(); !good) return good;
  if (auto good = s.need_pass(); !good) return good;
  Watch watch;
  RenderStats unwanted;
  const ProjectedVertices projected = project(s.mesh, clip_matrix(camera, s.origin), s.width, s.height);
  s.pass->place(projected);
  const IndexScene index{s.mesh, projected, s.materials.materials, s.packed, look.levels};
  std::array<DrawnSide, 2>& sides = s.bands[0].sides;
  overlay.resize(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height));
  for (int first_row = 0; first_row < s.height; first_row += s.band_rows) {
    const FrameTiles where{first_row, std::min(s.band_rows, s.height - first_row), {}};
    if (auto good = s.draw_nearest(list_triangles(s.mesh, projected, s.materials.materials, where), where,
                                   sides, watch, unwanted);
        !good)
      return good;
    draw_texel_edges(index, sides, first_row, where.rows, overlay);
  }
  return {};
}

Result<Frame> render(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
                     const RenderOptions& options, RenderStats* stats) {
  RenderStats unwanted;
  const Result<std::unique_ptr<Renderer>> renderer = Renderer::create(scene, fabrics, options);
  if (!renderer) return tl::unexpected(renderer.error());
  Frame frame;
  if (auto good = (*renderer)->draw(camera, options, frame, stats != nullptr ? *stats : unwanted); !good)
    return tl::unexpected(good.error());
  return frame;
}

}  // namespace selvedge
