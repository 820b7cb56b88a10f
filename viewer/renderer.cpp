#include "viewer/renderer.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>

#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/gltf/memory.h"
#include "format/scene/camera.h"
#include "viewer/hybrid/path.h"
#include "viewer/light/floor.h"
#include "viewer/light/picture_textures.h"
#include "viewer/light/shadow_maps.h"

namespace selvedge {
namespace {

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
            "into "
            "--max-memory");
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
    Imath::Box3d bounds;
    for (const V3d& point : value_or_throw(world_points(source))) bounds.extendBy(point);
    scene.origin = bounds.center();
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
