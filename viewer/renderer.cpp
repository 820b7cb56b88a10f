#include "viewer/renderer.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <future>

#include "format/parallel.h"
#include "viewer/context.h"
#include "viewer/layers.h"
#include "viewer/materials.h"
#include "viewer/paper_layers.h"
#include "viewer/render_checks.h"

namespace selvedge {
namespace {

/// Pixels that are drawn, read back and evaluated at a time: bounds the memory of large frames.
constexpr int pixels_per_band = 1 << 21;
constexpr int bands_per_frame = 6;
constexpr int rasteriser_tile = 64;

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
  std::unique_ptr<PaperPass> paper;      ///< the same
  PaperKinds kinds;
  std::vector<SurfaceLook> kind_looks;
  PaperFrames coded;
  std::unique_ptr<ShadowPass> shadows;  ///< made when shadows are asked for
  double prepare = 0;
  std::span<const ShadowMap> maps;  ///< of the frame that is being drawn
  /// Rows on their way: while one band is shaded the next is drawn.
  struct Band {
    std::array<DrawnSide, 2> sides;
    std::vector<V4f> large;  ///< pixels, where supersampled
  };
  std::array<Band, 2> bands;

  ShadingScene shading_of(const Camera& camera, const RenderOptions& look) const {
    return {camera, width,  height,     looks.looks, packed,       look.lights,
            &mesh,  origin, looks.core, maps,        look.ambient, look.power};
  }
  /// Draws the maps that the look asks for; reads them back, unless the shader path alone needs them.
  Result<void> draw_shadows(const RenderOptions& look, bool read);
  /// Makes the pass if it is not there; the shader path needs it for probes and texel edges only.
  Result<void> need_pass();
  Result<void> draw_shader(const Camera& camera, const RenderOptions& look, Frame& frame, Watch& watch,
                           RenderStats& stats);
  Result<void> make_paper(const Scene& scene, const std::vector<Surface>& surfaces,
                          const std::vector<Fabric>& fabrics);
  Result<void> draw_paper(const Camera& camera, const RenderOptions& look, int first_row, Frame& frame,
                          Watch& watch, RenderStats& stats);
  Result<void> draw_nearest(TriangleLists lists, const FrameTiles& where, std::array<DrawnSide, 2>& sides,
                            Watch& watch, RenderStats& stats);
  Result<void> draw_behind(const IndexScene& index, FrameTiles where, std::array<DrawnSide, 2>& sides,
                           DeepPixels& deep, Watch& watch, RenderStats& stats);
  Result<void> shade(const IndexScene& index, const ShadingScene& shading, int first_row, Band& band,
                     Frame& frame, RenderStats& stats);
  Result<void> draw_hybrid(const Camera& camera, const RenderOptions& look, Frame& frame, Watch& watch,
                           RenderStats& stats);
  /// Where a band's pixels go: the frame itself, or a supersampled piece of it, which filter() takes there.
  BandPixels pixels_of(Band& band, int first_row, Frame& frame) const;
  void filter(const Band& band, const BandPixels& pixels, Frame& frame) const;
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
  if (options.path == RenderPath::paper) {
    if (auto good = s.make_paper(scene, *surfaces, fabrics); !good) return tl::unexpected(good.error());
  } else if (!s.shader) {
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
  // A map is in the memory of OpenGL and in that of the program.
  constexpr std::size_t most_texels = std::size_t{1} << 28;
  const auto side = static_cast<std::size_t>(look.shadows);
  if (views.size() * side * side > most_texels) {
    return fail(
        Code::option_out_of_range, "", "--shadows",
        fmt::format("{} maps of {} texels a side are more than {} texels", views.size(), side, most_texels));
  }
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
  std::vector<V4f>& large = bands[0].large;
  shader->read(large);
  watch.add_to(stats.read_back);
  stats.layers = stats.shader.rounds;
  stats.covered_pixels = std::count_if(large.begin(), large.end(), [](const V4f& p) { return p.w > 0; });
  box_filter(large, 0, options.supersample, frame);
  watch.add_to(stats.filter);
  return {};
}

Result<void> Renderer::State::make_paper(const Scene& scene, const std::vector<Surface>& surfaces,
                                         const std::vector<Fabric>& fabrics) {
  Result<PaperKinds> found = paper_kinds(scene, surfaces, looks, fabrics, remarks);
  if (!found) return tl::unexpected(found.error());
  kinds = std::move(*found);
  kind_looks = looks_of_kinds(kinds);
  auto made = PaperPass::create(gl, mesh, looks.looks, kinds, fabrics, {width, height, band_rows});
  if (!made) return tl::unexpected(made.error());
  paper = std::move(*made);
  return {};
}

Result<void> Renderer::State::draw_paper(const Camera& camera, const RenderOptions& look, int first_row,
                                         Frame& frame, Watch& watch, RenderStats& stats) {
  const BandPixels pixels = pixels_of(bands[0], first_row, frame);
  ShadingScene shading{camera, width, height, kind_looks, packed, look.lights};
  shading.power = look.power;
  for (int y = 0; y < pixels.rows; ++y) std::fill_n(&pixels.at(0, y), pixels.width, V4f(0, 0, 0, 0));
  for (int round = 0; round < options.layers; ++round) {
    const Result<bool> any = paper->draw(clip_matrix(camera, origin), pixels.first_row, round, look.levels);
    if (!any) return tl::unexpected(any.error());
    watch.add_to(stats.geometry);
    if (!*any) break;
    paper->read(coded);
    watch.add_to(stats.read_back);
    const LayerCount count = shade_round(coded, kinds, look.levels.blend, shading, pixels);
    watch.add_to(stats.evaluation);
    if (round == 0) stats.covered_pixels += count.covered;
    stats.evaluated_pixels += count.evaluated;
    if (count.evaluated == 0) break;
    stats.layers = std::max(stats.layers, round + 1);
  }
  filter(bands[0], pixels, frame);
  watch.add_to(stats.filter);
  return {};
}

/// What lies behind the first round, at the deep pixels.
Result<void> Renderer::State::draw_behind(const IndexScene& index, FrameTiles where,
                                          std::array<DrawnSide, 2>& sides, DeepPixels& deep, Watch& watch,
                                          RenderStats& stats) {
  for (int side = 0; side < 2; ++side) {
    DrawnSide& drawn = sides[static_cast<std::size_t>(side)];
    deep.take(side, 0, drawn);
    for (int round = 1; round < options.layers && deep.has_more(side, round); ++round) {
      where.tiles = deep.tiles(side, round);
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
Result<void> Renderer::State::draw_nearest(TriangleLists lists, const FrameTiles& where,
                                           std::array<DrawnSide, 2>& sides, Watch& watch,
                                           RenderStats& stats) {
  sides[0].list = std::move(lists.front);
  sides[1].list = std::move(lists.back);
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

/// From what a band's pixels see to the frame. Draws only where the scene has surfaces without fabric.
Result<void> Renderer::State::shade(const IndexScene& index, const ShadingScene& shading, int first_row,
                                    Band& band, Frame& frame, RenderStats& stats) {
  Watch watch;
  const BandPixels pixels = pixels_of(band, first_row, frame);
  DeepPixels deep(width, pixels.rows);
  LayerCount seen = shade_band(index, shading, band.sides, options.layers, pixels, deep);
  if (!deep.empty()) {
    if (band.sides[0].seen.colours.empty()) {
      deep.cast(mesh, index.projected, band.sides, first_row);
    } else {
      watch.add_to(stats.evaluation);
      const FrameTiles where{first_row, pixels.rows, {}};
      if (auto good = draw_behind(index, where, band.sides, deep, watch, stats); !good) return good;
    }
    seen += shade_deep(index, shading, deep, options.layers, pixels);
  }
  watch.add_to(stats.evaluation);
  stats.covered_pixels += seen.covered;
  stats.evaluated_pixels += seen.evaluated;
  stats.layers = std::max(stats.layers, seen.layers);
  filter(band, pixels, frame);
  watch.add_to(stats.filter);
  return {};
}

BandPixels Renderer::State::pixels_of(Band& band, int first_row, Frame& frame) const {
  BandPixels pixels{first_row, width, std::min(band_rows, height - first_row), nullptr, width};
  if (options.supersample > 1) {
    band.large.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(pixels.rows));
    pixels.bottom = band.large.data();
  } else {
    // The frame's first row is at the top.
    pixels.bottom = frame.pixels.data() + static_cast<std::ptrdiff_t>(height - 1 - first_row) * width;
    pixels.stride = -width;
  }
  return pixels;
}

void Renderer::State::filter(const Band& band, const BandPixels& pixels, Frame& frame) const {
  if (options.supersample > 1) box_filter(band.large, pixels.first_row, options.supersample, frame);
}

/// Each band is shaded while the next is drawn.
Result<void> Renderer::State::draw_hybrid(const Camera& camera, const RenderOptions& look, Frame& frame,
                                          Watch& watch, RenderStats& stats) {
  const ProjectedVertices projected = project(mesh, clip_matrix(camera, origin), width, height);
  pass->place(projected);
  std::vector<TriangleLists> lists = list_bands(mesh, projected, looks.looks, band_rows);
  watch.add_to(stats.project);
  const IndexScene index{mesh, projected, looks.looks, packed, look.levels};
  const ShadingScene shading = shading_of(camera, look);
  // What is drawn twice, because of surfaces without fabric, cannot wait for the next band.
  const bool at_once = thread_count() == 1 || pass->has_core();
  RenderStats shaded;
  double waited = 0;
  std::future<Result<void>> shading_before;
  const auto finish_before = [&]() -> Result<void> {
    if (!shading_before.valid()) return {};
    return shading_before.get();
  };
  for (std::size_t i = 0; i < lists.size(); ++i) {
    const int first_row = static_cast<int>(i) * band_rows;
    Band& band = bands[i % 2];
    const FrameTiles where{first_row, std::min(band_rows, height - first_row), {}};
    if (auto good = draw_nearest(std::move(lists[i]), where, band.sides, watch, stats); !good) return good;
    if (auto good = finish_before(); !good) return good;
    watch.add_to(waited);
    const auto shade = [&, first_row] { return this->shade(index, shading, first_row, band, frame, shaded); };
    if (!at_once) {
      shading_before = std::async(std::launch::async, shade);
    } else if (auto good = shade(); !good) {
      return good;
    }
    watch.add_to(waited);
  }
  if (auto good = finish_before(); !good) return good;
  stats.geometry += shaded.geometry;
  stats.read_back += shaded.read_back;
  stats.evaluation = shaded.evaluation;
  stats.filter = shaded.filter;
  stats.covered_pixels = shaded.covered_pixels;
  stats.evaluated_pixels = shaded.evaluated_pixels;
  stats.layers = shaded.layers;
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
                      look.lights.size() - s.shadows->views().size(), look.lights.size(), most_shadows));
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
  const IndexScene index{s.mesh, projected, s.looks.looks, s.packed, look.levels};
  if (const auto good = s.draw_shadows(look, true); !good) return tl::unexpected(good.error());
  const ShadingScene shading = s.shading_of(camera, look);
  std::array<DrawnSide, 2>& sides = s.bands[0].sides;
  // A band of one row, and of it the tile that holds the pixel.
  FrameTiles where{row, 1, {}};
  where.tiles.resize(static_cast<std::size_t>((s.width + tile_side - 1) / tile_side));
  where.tiles[static_cast<std::size_t>(pixel.x / tile_side)] = 1;
  if (const auto good = s.draw_nearest(list_triangles(s.mesh, projected, s.looks.looks, where), where, sides,
                                       watch, unwanted);
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
  std::array<DrawnSide, 2>& sides = s.bands[0].sides;
  overlay.resize(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height));
  for (int first_row = 0; first_row < s.height; first_row += s.band_rows) {
    const FrameTiles where{first_row, std::min(s.band_rows, s.height - first_row), {}};
    if (auto good = s.draw_nearest(list_triangles(s.mesh, projected, s.looks.looks, where), where, sides,
                                   watch, unwanted);
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
