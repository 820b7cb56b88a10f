#include "viewer/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <future>

#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/gltf/memory.h"
#include "format/scene/camera.h"
#include "viewer/cells/cell_pass.h"
#include "viewer/hybrid/layers.h"
#include "viewer/light/floor.h"
#include "viewer/light/picture_textures.h"
#include "viewer/light/shadow_maps.h"

namespace selvedge {
namespace {

/// `pixel`: from the lower left. Its cell image has been made.
PixelProbe probe_pixel(const FrameScene& scene, TriangleSide seen, const V2i& pixel, const PbrPixel& pbr) {
  const GarmentPoint point = garment_point(scene, seen, pixel.x, pixel.y);
  PixelProbe probe;
  probe.pixel = V2i(pixel.x, scene.projected.height - 1 - pixel.y);
  probe.surface = point.surface;
  probe.triangle = point.triangle;
  probe.is_back = point.is_back;
  probe.position = scene.prepared.origin + V3d(point.position);
  probe.fabric = scene.prepared.materials.surfaces[probe.surface].fabric;
  bool through = false;
  if (probe.fabric >= 0) {
    const Fabric& fabric = scene.prepared.fabrics[probe.fabric].seen_from(point.is_back);
    through = fabric.find_side(Side::through) != nullptr;
    probe.uv = V2d(point.uv);
    const V2f repeats(std::hypot(point.duv_dx.x, point.duv_dy.x), std::hypot(point.duv_dx.y, point.duv_dy.y));
    probe.texels_per_pixel = V2d(repeats) * V2d(fabric.repeat_texels(0));
    const auto& yarns = fabric.levels.front().yarns();
    const V2f images = yarns ? repeats * V2f(yarns->tiles_per_repeat()) : repeats;
    const CellLevels levels = shown_levels(fabric, images, scene.view.options.levels.forced_level);
    const auto add = [&](int level, float weight) {
      if (!(weight > 0)) return;
      const V2i texels = fabric.repeat_texels(std::max(level, 0));
      probe.texels.push_back(
          {level, {wrap_texel(probe.uv.x, texels.x), wrap_texel(probe.uv.y, texels.y)}, weight});
    };
    add(-1, levels.yarn_weight);
    add(levels.finer_level, (1 - levels.yarn_weight) * (1 - levels.coarser_weight));
    add(levels.finer_level + 1, (1 - levels.yarn_weight) * levels.coarser_weight);
  }
  const GarmentFrame frame = garment_frame(scene, point);
  probe.to_viewer = frame.to_frame(point.to_viewer);
  for (const ArrivingLight& light : lights_at(scene, point, frame, through))
    probe.to_lights.push_back(light.direction);
  const V4f light = shade_surface(scene, seen, pixel, pbr);
  probe.alpha = light.w;
  if (probe.alpha > 0) probe.radiance = V3f(light.x, light.y, light.z) / probe.alpha;
  return probe;
}

/// Surfaces behind each other that a frame may have, the mean over its pixels.
constexpr int max_depth = 1024;

// The functions below throw Failure.

[[noreturn]] void refuse(const char* option, std::string reason) {
  throw Failure{{Code::option_out_of_range, "", option, std::move(reason)}};
}

void check_size(const FrameSize& size) {
  if (size.supersample < 1 || size.supersample > 16) refuse("--supersample", "must lie between 1 and 16");
  const int limit = max_frame_side / size.supersample;
  if (size.width < 1 || size.height < 1 || size.width > limit || size.height > limit)
    refuse("--size", fmt::format("must lie between 1x1 and {0}x{0}", limit));
  if (size.layers < 1 || size.layers > max_layers)
    refuse("--layers", fmt::format("must lie between 1 and {}", max_layers));
}

void check_draw(const DrawOptions& o) {
  if (o.levels.forced_level < -1) refuse("--level", "must not be negative");
  if (o.shadow_map_size != 0 && (o.shadow_map_size < min_shadow_size || o.shadow_map_size > max_shadow_size))
    refuse("--shadows", fmt::format("must lie between {} and {}", min_shadow_size, max_shadow_size));
}

/// Texels per side that the published path's colours of 8 bits can index.
constexpr int paper_side_limit = 256;

/// Refuses --path paper where a material has a fabric that the paper does not have. A line in `remarks` for
/// each fabric whose yarn shows as texels.
void check_paper_fabrics(const Scene& scene, const Materials& materials, const std::vector<Fabric>& fabrics,
                         std::vector<std::string>& remarks) {
  for (std::size_t i = 0; i < fabrics.size(); ++i) {
    if (std::ranges::find(materials.surfaces, static_cast<int>(i), &SurfaceMaterial::fabric) ==
        materials.surfaces.end())
      continue;
    const std::string name = i < scene.fabrics.size() ? scene.fabrics[i].name : scene.file;
    const auto refuse_fabric = [&](const std::string& reason) {
      throw Failure{{Code::option_out_of_range, name, "--path",
                     fmt::format("paper: {}; --path hybrid draws it", reason)}};
    };
    const FabricLevel& finest = fabrics[i].levels.front();
    if (finest.width > paper_side_limit || finest.height > paper_side_limit)
      refuse_fabric(fmt::format("{} x {} texels; 8 bits index {} a side", finest.width, finest.height,
                                paper_side_limit));
    for (const FabricLevel& level : fabrics[i].levels) {
      if (level.has(LayerKind::light)) refuse_fabric("the fabric has a light table");
      if (level.has(LayerKind::products)) refuse_fabric("the fabric has products");
    }
    if (finest.yarns())
      remarks.push_back(fmt::format("{}: --path paper draws level 0 in place of the yarn", name));
  }
}

/// Composites the frame over the environment that the camera sees; the frame is opaque then.
void add_backdrop(const Camera& camera, const DrawOptions& options, const Reflections* reflections,
                  Frame& frame) {
  const ViewDirections rays = view_directions(camera, frame.width, frame.height);
  parallel_for(0, frame.height, [&](int y) {
    for (int x = 0; x < frame.width; ++x) {
      V4f& pixel = frame.pixels[static_cast<std::size_t>(y) * frame.width + x];
      const float right = static_cast<float>(x) + 0.5F - 0.5F * static_cast<float>(frame.width);
      const float up = 0.5F * static_cast<float>(frame.height) - static_cast<float>(y) - 0.5F;
      const V3d away = -V3d(rays.centre_direction + rays.step_right * right + rays.step_up * up).normalized();
      const V3f radiance = options.backdrop_roughness > 0 ? reflections->at(away, options.backdrop_roughness)
                                                          : options.environment->radiance_at(away);
      const V3f seen = radiance * (1 - pixel.w);
      pixel = V4f(pixel.x + seen.x, pixel.y + seen.y, pixel.z + seen.z, 1);
    }
  });
}

}  // namespace

/// Draws frames on all paths (RenderPath; paper section 6): OpenGL or the CPU finds the triangles at the
/// pixels, the CPU their texels and light. Throws GRAPHICS_UNAVAILABLE where OpenGL fails.
class FrameRenderer {
 public:
  /// `gl` and `scene` must outlive the object. With RenderPath::paper, what OpenGL would write in the
  /// published path is rounded to its colours of 8 bits, nearest texels alone; with RenderPath::raster, the
  /// CPU finds the triangles, if all surfaces have a fabric.
  FrameRenderer(const GlFunctions& gl, const PreparedScene& scene, const FrameSize& size, RenderPath kind)
      : scene_(scene),
        kind_(kind),
        bands_(bands_of(size)),
        layers_(size.layers),
        pass_(gl, scene.mesh, scene.materials, bands_),
        cells_(scene) {}

  void resize(const FrameSize& size) {
    bands_ = bands_of(size);
    layers_ = size.layers;
    pass_.resize(bands_);
  }
  /// Takes another shape of the scene's mesh; all but positions, normals and tangents are as they were.
  void update_shape() { cells_.update_shape(); }
  /// Fills all pixels of `frames`, one for each of the view's tints, which have the size of the last resize()
  /// already; adds to `stats`. The context must be current whenever a function of the path is called, the
  /// destructor included.
  void draw(const FrameView& view, std::span<Frame> frames, RenderStats& stats) {
    Stopwatch watch;
    const ProjectedVertices projected =
        project(scene_.mesh, clip_matrix(view.camera, scene_.origin), bands_.width, bands_.height);
    const bool casts = this->casts(view.options);
    if (!casts) pass_.set_vertices(projected);
    std::vector<TriangleLists> lists =
        list_bands(scene_.mesh, projected, scene_.materials.surfaces, bands_.rows);
    const FrameScene scene = begin(view, projected);
    watch.add_lap(stats.project_seconds);
    // Surfaces without fabric need further rounds of the same band, so drawing and shading cannot overlap.
    const DrawOptions& options = view.options;
    const bool at_once = thread_count() == 1 || pass_.has_pbr() || casts;
    std::future<void> shading_before;
    const auto finish_before = [&] {
      if (shading_before.valid()) shading_before.get();
    };
    for (std::size_t i = 0; i < lists.size() && !options.is_interrupted(); ++i) {
      const int first_row = static_cast<int>(i) * bands_.rows;
      Band& band = in_flight_[i % 2];
      const int rows = bands_.band_row_count(first_row);
      if (options.blocks != nullptr &&
          !options.blocks->has_drawn_rows(first_row / bands_.supersample, rows / bands_.supersample))
        continue;
      watch = {};
      band.surfaces.is_cpu_raster = casts;
      if (casts) {
        for (std::size_t side = 0; side < 2; ++side)
          band.surfaces.sides[side].triangle_list = std::move(lists[i][side]);
        band.surfaces.draw_band(scene, first_row, rows);
        watch.add_lap(stats.geometry_seconds);
      } else {
        draw_nearest(std::move(lists[i]), first_row, rows, band.surfaces.sides, watch, stats);
      }
      finish_before();
      // Drawing and shading that overlap have their own members of the statistics.
      const auto shade = [&, first_row] { this->shade(scene, first_row, band, frames, stats); };
      if (at_once)
        shade();
      else
        shading_before = std::async(std::launch::async, shade);
    }
    finish_before();
    if (!view.options.is_interrupted()) {
      const CellMemory memory = cells_.end();
      stats.peak_image_bytes = static_cast<std::int64_t>(memory.peak_bytes);
      if (memory.is_coarser)
        stats.remarks.push_back(
            fmt::format("cell images are coarser than wanted: these take {:.0f} MiB, --image-memory is {}",
                        std::ceil(memory.wanted_bytes / (1 << 20)), view.options.cells.memory_bytes >> 20));
    }
  }

  /// As Renderer::probe_surface().
  std::optional<PixelProbe> probe_surface(const FrameView& view, const V2i& pixel) {
    Stopwatch watch;
    RenderStats unwanted;
    const int row = bands_.height - 1 - pixel.y;
    const ProjectedVertices projected =
        project(scene_.mesh, clip_matrix(view.camera, scene_.origin), bands_.width, bands_.height);
    pass_.set_vertices(projected);
    std::array<DrawnSide, 2>& sides = in_flight_[0].surfaces.sides;
    // A band of one row.
    std::vector<TriangleLists> lists =
        list_bands(scene_.mesh, projected, scene_.materials.surfaces, bands_.rows);
    draw_nearest(std::move(lists[row / bands_.rows]), row, 1, sides, watch, unwanted);
    const std::size_t side = sides[1].depth[pixel.x] < sides[0].depth[pixel.x] ? 1 : 0;
    if (!(sides[side].depth[pixel.x] < 1)) return std::nullopt;
    const TriangleSide seen = sides[side].surface_at(pixel.x, side);
    const FrameScene scene = begin(view, projected);
    if (cells_.shows(seen)) cells_.mark_visible(seen, pixel.x, row);
    cells_.render();
    return probe_pixel(scene, seen, V2i(pixel.x, row), sides[side].pbr_at(pixel.x));
  }

 private:
  /// A band in progress: while one is shaded the next is drawn.
  struct Band {
    BandSurfaces surfaces;
    std::vector<std::vector<V4f>> large;  ///< supersampled pixels, of each picture
  };

  /// Whether the CPU finds the triangles: of blocks it draws no others.
  bool casts(const DrawOptions& options) const {
    return kind_ != RenderPath::paper && !pass_.has_pbr() &&
           (kind_ == RenderPath::raster || options.blocks != nullptr);
  }
  /// Begins a frame.
  FrameScene begin(const FrameView& view, const ProjectedVertices& projected) {
    const bool is_paper = kind_ == RenderPath::paper;
    cells_.begin(view, !is_paper, bands_.supersample, projected);
    return {scene_, view, projected, cells_, is_paper};
  }
  /// Draws the first round of both sides of the cloth.
  void draw_nearest(TriangleLists lists, int first_row, int rows, std::array<DrawnSide, 2>& sides,
                    Stopwatch& watch, RenderStats& stats) {
    for (int side = 0; side < 2; ++side) {
      sides[side].triangle_list = std::move(lists[side]);
      pass_.draw(side, 0, first_row, sides[side].triangle_list);
    }
    pass_.finish();
    watch.add_lap(stats.geometry_seconds);
    for (int side = 0; side < 2; ++side) pass_.read(side, 0, rows, sides[side]);
    watch.add_lap(stats.read_back_seconds);
  }
  /// Draws the surfaces behind the first round at deep pixels.
  void draw_behind(int first_row, int rows, std::array<DrawnSide, 2>& sides, DeepPixels& deep,
                   Stopwatch& watch, RenderStats& stats) {
    for (int side = 0; side < 2; ++side) {
      DrawnSide& drawn = sides[side];
      bool has_more = deep.add_depth_layer(side, 0, drawn);
      for (int round = 1; round < layers_ && has_more; ++round) {
        pass_.draw(side, round, first_row, drawn.triangle_list);
        pass_.finish();
        watch.add_lap(stats.geometry_seconds);
        pass_.read(side, round, rows, drawn);
        watch.add_lap(stats.read_back_seconds);
        has_more = deep.add_depth_layer(side, round, drawn);
      }
    }
  }
  /// Shades a band into the frame. Draws only if the scene has surfaces without fabric.
  void shade(const FrameScene& scene, int first_row, Band& band, std::span<Frame> frames,
             RenderStats& stats) {
    Stopwatch watch;
    const BandPixels pixels = pixels_of(bands_, first_row, frames, band.large);
    DeepPixels deep;
    stats += shade_band(scene, cells_, band.surfaces, layers_, pixels, deep);
    if (!deep.empty()) {
      watch.add_lap(stats.evaluation_seconds);
      draw_behind(first_row, pixels.rows, band.surfaces.sides, deep, watch, stats);
      stats += shade_deep_pixels(scene, cells_, deep, layers_, pixels);
    }
    watch.add_lap(stats.evaluation_seconds);
    for (std::size_t i = 0; i < frames.size() && bands_.supersample > 1; ++i)
      box_filter(band.large[i], first_row, bands_.supersample, frames[i]);
    watch.add_lap(stats.filter_seconds);
  }

  const PreparedScene& scene_;
  RenderPath kind_;
  FrameBands bands_;
  int layers_;
  VisibilityPass pass_;
  std::array<Band, 2> in_flight_;
  CellPass cells_;
};

struct Renderer::State {
  FrameSize size;
  RenderPath kind = RenderPath::hybrid;
  Tints own_tints;
  std::string file;  ///< of the scene
  std::uint64_t scene_memory = 0;
  PreparedScene scene;
  std::vector<std::string> remarks;
  std::unique_ptr<GraphicsContext> context;  ///< destroyed after all objects that it owns
  GlFunctions gl;
  std::unique_ptr<PictureTextures> textures;
  std::optional<Occluders> occluders;  ///< found on first use
  std::vector<ShadowView> shadowed;    ///< the views that `shadow_maps` are drawn for
  std::vector<ShadowMap> shadow_maps;
  std::optional<Floor> floor;        ///< found on first use
  std::optional<SkyVisibility> sky;  ///< found on first use; without directions if memory is short
  bool is_sky_old = false;           ///< of another shape
  SmoothLight around;                ///< of `vertex_lights`
  std::vector<SmoothLight> vertex_lights;
  std::shared_ptr<const Environment> reflected;  ///< by `reflections`
  std::shared_ptr<const Reflections> reflections;
  std::unique_ptr<FrameRenderer> path;
  double prepare = 0;

  /// The mirror images of an environment, where something shows them; made once for its pictures.
  std::shared_ptr<const Reflections> reflect(const DrawOptions& options) {
    const auto& wanted = options.environment;
    const bool mirrors =
        std::ranges::any_of(scene.materials.surfaces, [](const auto& s) { return s.fabric < 0; });
    if (!wanted || (!mirrors && !(options.backdrop_roughness > 0))) return nullptr;
    if (reflected && (reflected == wanted || reflected->radiance == wanted->radiance)) {
      if (reflections->levels[0].options == wanted->options) return reflections;
      Reflections other = *reflections;
      for (Environment& level : other.levels) level.options = wanted->options;
      reflections = std::make_shared<const Reflections>(std::move(other));
    } else {
      reflections = std::make_shared<const Reflections>(reflections_of(*wanted));
    }
    reflected = wanted;
    return reflections;
  }

  const Occluders& casting() {
    if (!occluders) {
      if (!textures->reserve_bytes(Occluders::mask_bytes(scene.materials)))
        throw Failure{memory_limit_error(file, "", "the masks that cast shadows", scene_memory)};
      occluders.emplace(scene.mesh, scene.materials);
    }
    return *occluders;
  }

  /// Light from all around at the vertices, with shadows, if the options have both.
  std::span<const SmoothLight> shade_around(const DrawOptions& options) {
    if (!options.smooth_light || options.shadow_map_size == 0) return {};
    if (!sky) {
      // 48 maps of a million triangles take a second.
      constexpr std::size_t max_triangles = std::size_t{1} << 20;
      const bool fits = scene.mesh.triangles.size() <= max_triangles &&
                        textures->reserve_bytes(scene.mesh.positions.size() * bytes_per_shaded_vertex);
      if (!fits)
        remarks.emplace_back(
            "light from all around has no shadows: the scene has more than 2^20 triangles, or does not fit "
            "into --max-memory");
      sky.emplace();
      if (fits) *sky = sky_visibility(scene.mesh, casting());
    }
    if (sky->directions.empty()) return {};
    // Maps of a whole sky take longer than a frame that moves, unless they show little.
    constexpr std::size_t few_triangles = 1 << 12;
    if (is_sky_old && (!options.cells.is_moving || scene.mesh.triangles.size() <= few_triangles)) {
      *sky = sky_visibility(scene.mesh, casting());
      vertex_lights.clear();
      is_sky_old = false;
    }
    if (vertex_lights.empty() || around != *options.smooth_light) {
      around = *options.smooth_light;
      vertex_lights = light_at_vertices(*sky, around);
    }
    return vertex_lights;
  }

  /// Refuses files of few bytes whose surfaces would take hours.
  void check_depth(const Camera& camera) const {
    const M44d clip = clip_matrix(camera, scene.origin);
    const double depth =
        mean_depth_complexity(scene.mesh, project(scene.mesh, clip, size.width, size.height));
    if (depth > max_depth) {
      throw Failure{
          {Code::file_too_large, file, "",
           fmt::format("{:.0f} surfaces lie behind each other at a pixel, more than {}", depth, max_depth)}};
    }
  }

  /// Makes the textures that a frame shows.
  void make_textures(const Camera& camera) {
    Materials& materials = scene.materials;
    textures->make_textures(
        shown_halvings(scene.mesh, materials, scene.origin, camera, size.height * size.supersample),
        materials.pictures, file, remarks);
  }

  /// Draws the shadow maps that the options require, where the last frame had others.
  std::span<const ShadowMap> draw_shadows(const DrawOptions& options) {
    if (options.shadow_map_size == 0) return {};
    const std::vector<ShadowView> views =
        shadow_views(options.lights, scene.mesh.positions, scene.origin, options.shadow_map_size);
    constexpr std::size_t max_texels = std::size_t{1} << 28;
    const std::size_t side = options.shadow_map_size;
    if (views.size() * side * side > max_texels)
      refuse("--shadows", fmt::format("{} maps of {} texels a side are more than {} texels", views.size(),
                                      side, max_texels));
    if (views == shadowed) return shadow_maps;
    shadow_maps.clear();
    shadow_maps.resize(views.size());
    const Occluders& casts = casting();
    parallel_for(0, static_cast<int>(views.size()), [&](int i) { shadow_maps[i] = casts.draw(views[i]); });
    shadowed = views;
    return shadow_maps;
  }

  void load(const Scene& source, const std::vector<Fabric>& fabrics, const RenderOptions& options,
            std::unique_ptr<GraphicsContext> own) {
    Stopwatch watch;
    check_size(options);
    check_draw(options);
    file = source.file;
    scene_memory = source.memory_left;
    size = options;
    kind = options.path;
    for (const Fabric& fabric : fabrics) scene.fabrics.emplace_back(fabric);
    context = own ? std::move(own)
                  : value_or_throw(options.context == ContextKind::egl ? make_egl_context()
                                                                       : make_osmesa_context());
    value_or_throw(context->make_current());
    gl = value_or_throw(load_gl_functions(*context));
    prepare_scene(source);
    if (kind == RenderPath::paper) check_paper_fabrics(source, scene.materials, fabrics, remarks);
    watch.add_lap(prepare);
  }

  /// Makes everything that depends on the vertices.
  void prepare_scene(const Scene& source) {
    shadowed.clear();
    shadow_maps.clear();
    floor.reset();
    // Coordinates relative to the scene's centre keep their precision in float.
    scene.origin = bounding_box(value_or_throw(world_points(source))).center();
    const std::vector<Surface> surfaces = value_or_throw(build_surfaces(source, scene.origin));
    MergedSurfaces mesh = merge(surfaces);
    own_tints = tints_of(source);
    if (path && scene.mesh.differs_by_shape(mesh)) {
      scene.mesh = std::move(mesh);
      path->update_shape();
      is_sky_old = true;
      return;
    }
    path.reset();
    occluders.reset();
    sky.reset();
    is_sky_old = false;
    vertex_lights.clear();
    remarks.clear();
    scene.materials = materials_of(source, surfaces, remarks);
    scene.mesh = std::move(mesh);
    textures = std::make_unique<PictureTextures>(gl, scene_memory);
    path = std::make_unique<FrameRenderer>(gl, scene, size, kind);
  }

  void draw(const Camera& camera, const DrawOptions& options, std::span<const Tints> tints,
            std::span<Frame> frames, RenderStats& stats) {
    if (tints.size() == 1 && std::ranges::all_of(tints[0], [](const V3f& tint) { return tint == V3f(1); }))
      tints = {};
    stats = {};
    stats.triangles = static_cast<std::int64_t>(scene.mesh.triangles.size());
    value_or_throw(context->make_current());
    check_draw(options);
    Stopwatch watch;
    check_depth(camera);
    make_textures(camera);
    watch.add_lap(prepare);
    stats.prepare_seconds = prepare;
    stats.decoded_pictures = textures->decoded_count();
    const std::span<const ShadowMap> maps = draw_shadows(options);
    const std::span<const SmoothLight> shaded = shade_around(options);
    stats.remarks = remarks;
    if (options.shadow_map_size > 0) watch.add_lap(stats.shadow_seconds);
    if (options.shadow_map_size > 0 && maps.size() < options.lights.size())
      stats.remarks.push_back(
          fmt::format("{} of {} lights cast no shadows: points, wide cones, and lights after the first {}",
                      options.lights.size() - maps.size(), options.lights.size(), max_shadows));
    if (std::ranges::any_of(maps,
                            [&](const ShadowMap& map) { return map.view.size < options.shadow_map_size; }))
      stats.remarks.push_back(
          fmt::format("shadows of lights are coarser: more than {} surfaces lie behind each other",
                      Occluders::max_overdraw));
    for (Frame& frame : frames) {
      frame.width = size.width;
      frame.height = size.height;
      frame.pixels.resize(frame.width * frame.height);
    }
    const std::shared_ptr<const Reflections> mirrored = reflect(options);
    watch.add_lap(stats.prepare_seconds);
    path->draw({camera, options, maps, shaded, mirrored, tints}, frames, stats);
    if (!options.environment || options.is_interrupted()) return;
    if (options.backdrop_roughness < 0 && !floor) floor = find_floor(scene.mesh);
    for (Frame& frame : frames) {
      if (options.backdrop_roughness >= 0)
        add_backdrop(camera, options, mirrored.get(), frame);
      else
        add_floor(*floor, camera, scene.origin, frame);
    }
  }
};

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Renderer::~Renderer() {
  // OpenGL objects are deleted in their context.
  if (state_ && state_->context) static_cast<void>(state_->context->make_current());
}
const Tints& Renderer::own_tints() const { return state_->own_tints; }

Result<std::unique_ptr<Renderer>> Renderer::create(const Scene& scene, const std::vector<Fabric>& fabrics,
                                                   const RenderOptions& options,
                                                   std::unique_ptr<GraphicsContext> context) {
  auto state = std::make_unique<State>();
  return catch_failure([&] {
    state->load(scene, fabrics, options, std::move(context));
    return std::unique_ptr<Renderer>(new Renderer(std::move(state)));
  });
}

Result<void> Renderer::draw(const Camera& camera, const DrawOptions& options, Frame& frame,
                            RenderStats& stats) {
  return catch_failure([&] { state_->draw(camera, options, {&state_->own_tints, 1}, {&frame, 1}, stats); });
}

Result<void> Renderer::draw(const Camera& camera, const DrawOptions& options, std::span<const Tints> tints,
                            std::vector<Frame>& frames, RenderStats& stats) {
  frames.resize(tints.size());
  return catch_failure([&] { state_->draw(camera, options, tints, frames, stats); });
}

Result<void> Renderer::replace(const Scene& scene) {
  State& s = *state_;
  return catch_failure([&] {
    value_or_throw(s.context->make_current());
    Stopwatch watch;
    s.prepare_scene(scene);
    watch.add_lap(s.prepare);
  });
}

Tints tints_of(const Scene& scene) {
  Tints tints;
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& primitive = scene.primitives[instance.primitive];
    const int material = primitive.material;
    if (primitive.indices.empty()) continue;
    const bool has_fabric = material >= 0 && scene.materials[material].fabric.has_value();
    tints.push_back(has_fabric ? scene.materials[material].garment_textures.tint : V3f(1, 1, 1));
  }
  return tints;
}

Result<void> Renderer::resize(const FrameSize& size) {
  State& s = *state_;
  return catch_failure([&] {
    check_size(size);
    value_or_throw(s.context->make_current());
    s.size = size;
    s.path->resize(size);
  });
}

Result<std::optional<PixelProbe>> Renderer::probe_surface(const Camera& camera, const DrawOptions& options,
                                                          const V2i& pixel) {
  State& s = *state_;
  return catch_failure([&] {
    value_or_throw(s.context->make_current());
    s.make_textures(camera);
    const std::span<const ShadowMap> shadows = s.draw_shadows(options);
    return s.path->probe_surface(
        {camera, options, shadows, s.shade_around(options), s.reflect(options), {&s.own_tints, 1}}, pixel);
  });
}

Result<Frame> render(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
                     const RenderOptions& options, RenderStats* stats) {
  return catch_failure([&] {
    RenderStats unwanted;
    Frame frame;
    const auto renderer = value_or_throw(Renderer::create(scene, fabrics, options));
    value_or_throw(renderer->draw(camera, options, frame, stats != nullptr ? *stats : unwanted));
    return frame;
  });
}

}  // namespace selvedge
