#include "viewer/renderer.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "format/parallel.h"
#include "viewer/context.h"
#include "viewer/layers.h"
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
  if (o.layers < 1 || o.layers > most_layers)
    return refuse("--layers", fmt::format("must lie between 1 and {}", most_layers));
  if (o.levels.forced < -1) return refuse("--level", "must not be negative");
  const int taps = tap_limit(o.levels.linear);
  if (o.levels.taps < 1 || o.levels.taps > taps)
    return refuse("--anisotropy", fmt::format("must lie between 1 and {}{}", taps,
                                              o.levels.linear ? " with --filter linear" : ""));
  return {};
}

Result<void> check_shadows(const RenderOptions& o) {
  if (o.shadows == 0 || (o.shadows >= least_shadow_size && o.shadows <= most_shadow_size)) return {};
  return fail(Code::option_out_of_range, "", "--shadows",
              fmt::format("must lie between {} and {}", least_shadow_size, most_shadow_size));
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

Result<std::unique_ptr<GraphicsContext>> make_context(const RenderOptions& options) {
  if (options.context == ContextKind::egl) return make_egl_context();
  if (options.context == ContextKind::automatic && options.path == RenderPath::shader) {
    if (auto context = make_egl_context()) return context;
  }
  return make_osmesa_context();
}

/// A multiple of the supersampling.
int rows_per_band(int width, int height, int supersample) {
  const int rows = std::max(pixels_per_band / width / supersample, 1) * supersample;
  return std::min(rows, (height + supersample - 1) / supersample * supersample);
}

}  // namespace

struct Renderer::State {
  RenderOptions options;
  int width = 1;  ///< of the supersampled frame
  int height = 1;
  int band_rows = 1;
  V3d origin{0, 0, 0};
  MergedSurfaces mesh;
  Looks looks;
  std::vector<std::string> remarks;
  std::vector<PackedFabric> packed;
  std::unique_ptr<GraphicsContext> context;
  GlFunctions gl;
  std::unique_ptr<VisibilityPass> pass;  ///< goes before its context
  std::unique_ptr<ShaderPath> shader;    ///< draws in place of the pass, where it is there
  std::unique_ptr<ShadowPass> shadows;   ///< made when shadows are asked for
  double prepare = 0;
  std::span<const ShadowMap> maps;  ///< of the frame that is being drawn
  std::array<DrawnSide, 2> sides;
  std::vector<V4f> large;  ///< pixels of a supersampled band

  ShadingScene shading_of(const Camera& camera, const RenderOptions& look) const {
    return {camera, width,  height,     looks.looks, packed,      look.lights,
            &mesh,  origin, looks.core, maps,        look.ambient};
  }
  /// Draws the maps that the look asks for; reads them back, unless the shader path alone needs them.
  Result<void> draw_shadows(const RenderOptions& look, bool read);
  /// Makes the pass if it is not there; the shader path needs it for probes and texel edges only.
  Result<void> need_pass();
  Result<void> draw_shader(const Camera& camera, const RenderOptions& look, Frame& frame, Watch& watch,
                           RenderStats& stats);
  Result<void> draw_nearest(const IndexScene& index, const FrameTiles& where, Watch& watch,
                            RenderStats& stats);
  Result<void> draw_behind(const IndexScene& index, FrameTiles where, DeepPixels& deep, Watch& watch,
                           RenderStats& stats);
  Result<void> draw_band(const IndexScene& index, const ShadingScene& shading, const BandPixels& pixels,
                         Watch& watch, RenderStats& stats);
};

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
  if (const auto good = check(options); !good) return tl::unexpected(good.error());
  if (const auto good = check(scene, fabrics); !good) return tl::unexpected(good.error());
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
  Result<Looks> looks = looks_of(scene, *surfaces, fabrics.size(), s.remarks);
  if (!looks) return tl::unexpected(looks.error());
  s.looks = std::move(*looks);
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
    Result<std::unique_ptr<ShaderPath>> shader = ShaderPath::create(s.gl, s.mesh, s.looks, fabrics);
    if (!shader) return tl::unexpected(shader.error());
    s.shader = std::move(*shader);
  }
  s.band_rows = rows_per_band(s.width, s.height, options.supersample);
  if (!s.shader) {
    if (auto good = s.need_pass(); !good) return tl::unexpected(good.error());
  }
  watch.add_to(s.prepare);
  return std::unique_ptr<Renderer>(new Renderer(std::move(state)));
}

Result<void> Renderer::State::need_pass() {
  if (pass) return {};
  auto made = VisibilityPass::create(gl, mesh, looks, {width, height, band_rows});
  if (!made) return tl::unexpected(made.error());
  pass = std::move(*made);
  return {};
}

Result<void> Renderer::State::draw_shadows(const RenderOptions& look, bool read) {
  maps = {};
  if (look.shadows == 0) return {};
  if (!shadows) {
    auto made = ShadowPass::create(gl, mesh, looks);
    if (!made) return tl::unexpected(made.error());
    shadows = std::move(*made);
  }
  const std::vector<ShadowView> views = shadow_views(look.lights, mesh.positions, origin, look.shadows);
  if (auto good = shadows->draw(views); !good) return good;
  if (read)
    maps = shadows->read();
  else
    gl.Finish();
  return {};
}

Result<void> Renderer::State::draw_shader(const Camera& camera, const RenderOptions& look, Frame& frame,
                                          Watch& watch, RenderStats& stats) {
  const ShaderFrame how{width,       height,       options.layers,
                        look.levels, look.ambient, look.shadows > 0 ? shadows.get() : nullptr};
  if (auto good = shader->draw(camera, origin, look.lights, how, &stats.shader); !good) return good;
  gl.Finish();
  watch.add_to(stats.geometry);
  shader->read(large);
  watch.add_to(stats.read_back);
  stats.layers = stats.shader.rounds;
  stats.covered_pixels = std::count_if(large.begin(), large.end(), [](const V4f& p) { return p.w > 0; });
  box_filter(large, 0, options.supersample, frame);
  watch.add_to(stats.filter);
  return {};
}

/// What lies behind the first round, at the deep pixels.
Result<void> Renderer::State::draw_behind(const IndexScene& index, FrameTiles where, DeepPixels& deep,
                                          Watch& watch, RenderStats& stats) {
  for (int side = 0; side < 2; ++side) {
    DrawnSide& drawn = sides[static_cast<std::size_t>(side)];
    deep.take(side, 0, drawn);
    for (int round = 1; round < options.layers && deep.has_more(side, round); ++round) {
      where.tiles = deep.tiles(width, where.rows, side, round);
      drawn.list = sift_triangles(mesh, index.projected, drawn.list, where);
      if (auto good = pass->draw(side, round, where.first_row, drawn.list); !good) return good;
      pass->finish();
      watch.add_to(stats.geometry);
      pass->read(side, round, where, drawn.seen);
      watch.add_to(stats.read_back);
      deep.take(side, round, drawn);
    }
  }
  return {};
}

/// Both sides of the cloth, the first round.
Result<void> Renderer::State::draw_nearest(const IndexScene& index, const FrameTiles& where, Watch& watch,
                                           RenderStats& stats) {
  TriangleLists lists = list_triangles(mesh, index.projected, looks.looks, where);
  sides[0].list = std::move(lists.front);
  sides[1].list = std::move(lists.back);
  watch.add_to(stats.project);
  for (int side = 0; side < 2; ++side) {
    auto good = pass->draw(side, 0, where.first_row, sides[static_cast<std::size_t>(side)].list);
    if (!good) return good;
  }
  pass->finish();
  watch.add_to(stats.geometry);
  for (int side = 0; side < 2; ++side) pass->read(side, 0, where, sides[static_cast<std::size_t>(side)].seen);
  watch.add_to(stats.read_back);
  return {};
}

Result<void> Renderer::State::draw_band(const IndexScene& index, const ShadingScene& shading,
                                        const BandPixels& pixels, Watch& watch, RenderStats& stats) {
  const FrameTiles where{pixels.first_row, pixels.rows, {}};
  if (auto good = draw_nearest(index, where, watch, stats); !good) return good;
  DeepPixels deep;
  LayerCount count = shade_band(index, shading, sides, options.layers, pixels, deep);
  if (!deep.empty()) {
    watch.add_to(stats.evaluation);
    if (sides[0].seen.colours.empty()) {
      deep.cast(mesh, index.projected, sides, pixels);
      watch.add_to(stats.geometry);
    } else if (auto good = draw_behind(index, where, deep, watch, stats); !good) {
      return good;
    }
    count += shade_deep(index, shading, deep, options.layers, pixels);
  }
  watch.add_to(stats.evaluation);
  stats.covered_pixels += count.covered;
  stats.evaluated_pixels += count.evaluated;
  stats.layers = std::max(stats.layers, count.layers);
  return {};
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
  if (auto good = check_shadows(look); !good) return good;
  if (auto good = s.draw_shadows(look, !s.shader); !good) return good;
  if (look.shadows > 0) {
    watch.add_to(stats.shadows);
    if (s.shadows->views().size() < look.lights.size())
      stats.remarks.push_back(
          fmt::format("{} of {} lights cast no shadows: points, wide cones, and what comes after {} others",
                      look.lights.size() - s.shadows->views().size(), look.lights.size(), most_shadows));
  }
  const int n = s.options.supersample;
  frame.width = s.options.width;
  frame.height = s.options.height;
  frame.pixels.resize(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height));
  if (s.shader) return s.draw_shader(camera, look, frame, watch, stats);
  const ProjectedVertices projected = project(s.mesh, clip_matrix(camera, s.origin), s.width, s.height);
  s.pass->place(projected);
  watch.add_to(stats.project);
  const IndexScene index{s.mesh, projected, s.looks.looks, s.packed, look.levels};
  const ShadingScene shading = s.shading_of(camera, look);
  if (n > 1) s.large.resize(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.band_rows));
  for (int first_row = 0; first_row < s.height; first_row += s.band_rows) {
    BandPixels pixels{first_row, s.width, std::min(s.band_rows, s.height - first_row), s.large.data(),
                      s.width};
    if (n == 1) {
      // The frame itself, whose first row is at the top.
      pixels.bottom = frame.pixels.data() + static_cast<std::ptrdiff_t>(s.height - 1 - first_row) * s.width;
      pixels.stride = -s.width;
    }
    if (auto good = s.draw_band(index, shading, pixels, watch, stats); !good) return good;
    if (n > 1) {
      const auto count = static_cast<std::size_t>(s.width) * static_cast<std::size_t>(pixels.rows);
      box_filter(std::span<const V4f>(s.large).first(count), first_row, n, frame);
    }
    watch.add_to(stats.filter);
  }
  return {};
}

Result<void> Renderer::resize(const RenderOptions& options) {
  State& s = *state_;
  if (auto good = check(options); !good) return good;
  const int width = options.width * options.supersample;
  const int height = options.height * options.supersample;
  s.options = options;
  if (width == s.width && height == s.height) return {};
  s.width = width;
  s.height = height;
  s.band_rows = rows_per_band(width, height, options.supersample);
  if (auto good = s.context->make_current(); !good) return good;
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
  const IndexScene index{s.mesh, projected, s.looks.looks, s.packed, look.levels};
  if (const auto good = s.draw_shadows(look, true); !good) return tl::unexpected(good.error());
  const ShadingScene shading = s.shading_of(camera, look);
  // A band of one row, and of it the tile that holds the pixel.
  FrameTiles where{row, 1, {}};
  where.tiles.resize(static_cast<std::size_t>((s.width + tile_side - 1) / tile_side));
  where.tiles[static_cast<std::size_t>(pixel.x / tile_side)] = 1;
  if (const auto good = s.draw_nearest(index, where, watch, unwanted); !good)
    return tl::unexpected(good.error());
  const auto i = static_cast<std::size_t>(pixel.x);
  const std::optional<NearestSurface> nearest = nearest_surface(s.sides, i);
  if (!nearest) return std::nullopt;
  PixelTriangles pixels;
  pixels.count = 1;
  pixels.x[0] = static_cast<std::uint16_t>(pixel.x);
  pixels.y[0] = static_cast<std::uint16_t>(row);
  pixels.triangle[0] = nearest->triangle;
  pixels.back[0] = nearest->back;
  const VisibleSide& seen = s.sides[nearest->back ? 1 : 0].seen;
  pixels.has_core = !seen.colours.empty();
  if (pixels.has_core) pixels.core[0] = {seen.colours[i], seen.core[i]};
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
  const IndexScene index{s.mesh, projected, s.looks.looks, s.packed, look.levels};
  overlay.resize(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height));
  for (int first_row = 0; first_row < s.height; first_row += s.band_rows) {
    const FrameTiles where{first_row, std::min(s.band_rows, s.height - first_row), {}};
    if (auto good = s.draw_nearest(index, where, watch, unwanted); !good) return good;
    draw_texel_edges(index, s.sides, first_row, where.rows, overlay);
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
