#include "viewer/renderer.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>

#include "format/base/parallel.h"
#include "format/gltf/memory.h"
#include "viewer/hybrid/path.h"
#include "viewer/light/picture_textures.h"
#include "viewer/light/sky.h"
#include "viewer/scene/view_rays.h"
#include "viewer/shader/path.h"

namespace selvedge {
namespace {

Result<std::unique_ptr<GraphicsContext>> make_context(const RenderOptions& options) {
  if (options.context == ContextKind::egl) return make_egl_context();
  if (options.context == ContextKind::automatic && options.path == RenderPath::shader) {
    if (auto context = make_egl_context()) return context;
  }
  return make_osmesa_context();
}

Result<void> refuse(const char* option, std::string reason) {
  return fail(Code::option_out_of_range, "", option, std::move(reason));
}

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

Result<void> check_draw(const DrawOptions& o) {
  if (o.levels.forced < -1) return refuse("--level", "must not be negative");
  if (o.shadows != 0 && (o.shadows < min_shadow_size || o.shadows > max_shadow_size))
    return refuse("--shadows", fmt::format("must lie between {} and {}", min_shadow_size, max_shadow_size));
  return {};
}

/// Texels per side that the published path's colours of 8 bits can index.
constexpr int paper_side_limit = 256;

/// Refuses --path paper where a material has a fabric that the paper does not have. A line in `remarks` for
/// each fabric whose yarn shows as texels.
Result<void> check_paper_fabrics(const Scene& scene, const Materials& materials,
                                 const std::vector<Fabric>& fabrics, std::vector<std::string>& remarks) {
  for (std::size_t i = 0; i < fabrics.size(); ++i) {
    if (std::ranges::find(materials.surfaces, static_cast<int>(i), &SurfaceMaterial::fabric) ==
        materials.surfaces.end())
      continue;
    const std::string name = i < scene.fabrics.size() ? scene.fabrics[i].name : scene.file;
    const auto refuse = [&](const std::string& reason) {
      return fail(Code::option_out_of_range, name, "--path",
                  fmt::format("paper: {}; --path hybrid draws it", reason));
    };
    const FabricLevel& finest = fabrics[i].levels.front();
    if (finest.width > paper_side_limit || finest.height > paper_side_limit)
      return refuse(fmt::format("{} x {} texels; 8 bits index {} a side", finest.width, finest.height,
                                paper_side_limit));
    for (const FabricLevel& level : fabrics[i].levels) {
      if (level.has(LayerKind::light)) return refuse("the fabric has a light table");
      if (level.has(LayerKind::products)) return refuse("the fabric has products");
    }
    if (finest.yarns())
      remarks.push_back(fmt::format("{}: --path paper draws level 0 in place of the yarn", name));
  }
  return {};
}

/// Composites the frame over the environment that the camera sees; the frame is opaque then.
void add_backdrop(const Camera& camera, const DrawOptions& options, const Reflections* reflections,
                  Frame& frame) {
  const ViewRays rays = view_rays(camera, frame.width, frame.height);
  parallel_for(0, frame.height, [&](int y) {
    for (int x = 0; x < frame.width; ++x) {
      V4f& pixel = frame.pixels[static_cast<std::size_t>(y) * frame.width + x];
      const float right = static_cast<float>(x) + 0.5F - 0.5F * static_cast<float>(frame.width);
      const float up = 0.5F * static_cast<float>(frame.height) - static_cast<float>(y) - 0.5F;
      const V3d away = -V3d(rays.base + rays.right * right + rays.up * up).normalized();
      const V3f radiance =
          options.backdrop > 0 ? reflections->at(away, options.backdrop) : options.environment->at(away);
      const V3f seen = radiance * (1 - pixel.w);
      pixel = V4f(pixel.x + seen.x, pixel.y + seen.y, pixel.z + seen.z, 1);
    }
  });
}

}  // namespace

struct Renderer::State {
  RenderPath kind = RenderPath::hybrid;
  FrameSize size;
  std::string file;  ///< of the scene
  std::uint64_t scene_memory = 0;
  PreparedScene scene;
  std::vector<std::string> remarks;
  std::unique_ptr<GraphicsContext> context;  ///< destroyed after all objects that it owns
  GlFunctions gl;
  std::unique_ptr<PictureTextures> textures;
  std::unique_ptr<ShadowPass> shadows;  ///< created on first use
  std::optional<SkyVisibility> sky;     ///< found on first use; without directions if memory is short
  SmoothLight around;                   ///< of `around_vertices`
  std::vector<SmoothLight> around_vertices;
  std::shared_ptr<const Environment> reflected;  ///< by `reflections`
  std::shared_ptr<const Reflections> reflections;
  std::unique_ptr<FramePath> path;
  std::unique_ptr<HybridPath> probes;  ///< beside another path, created on first use
  double prepare = 0;

  /// The path that probes pixels.
  Result<HybridPath*> hybrid() {
    if (kind != RenderPath::shader) return static_cast<HybridPath*>(path.get());
    if (!probes) {
      auto made = HybridPath::create(gl, scene, size, RenderPath::hybrid);
      if (!made) return tl::unexpected(made.error());
      probes = std::move(*made);
    }
    return probes.get();
  }

  /// The mirror images of an environment, where something shows them; made once for its pictures.
  std::shared_ptr<const Reflections> reflect(const DrawOptions& options) {
    const auto& wanted = options.environment;
    const bool mirrors =
        std::ranges::any_of(scene.materials.surfaces, [](const auto& s) { return s.fabric < 0; });
    if (!wanted || (!mirrors && !(options.backdrop > 0))) return nullptr;
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

  /// Light from all around at the vertices, with shadows, if the options have both.
  Result<std::span<const SmoothLight>> shade_around(const DrawOptions& options) {
    if (!options.around || options.shadows == 0) return std::span<const SmoothLight>();
    if (!sky) {
      // 48 maps of a million triangles take six seconds.
      constexpr std::size_t most_triangles = std::size_t{1} << 20;
      const bool fits = scene.mesh.triangles.size() <= most_triangles &&
                        textures->leave(scene.mesh.positions.size() * bytes_per::shaded_vertex);
      if (!fits)
        remarks.emplace_back(
            "light from all around has no shadows: the scene has more than 2^20 triangles, or does not fit "
            "into "
            "--max-memory");
      Result<SkyVisibility> found = fits ? sky_visibility(gl, scene.mesh, scene.materials) : SkyVisibility{};
      if (!found) return tl::unexpected(found.error());
      sky = std::move(*found);
    }
    if (sky->directions.empty()) return std::span<const SmoothLight>();
    if (around_vertices.empty() || around != *options.around) {
      around = *options.around;
      around_vertices = light_at_vertices(*sky, around);
    }
    return std::span<const SmoothLight>(around_vertices);
  }

  /// Makes the textures that a frame shows.
  Result<void> make_textures(const Camera& camera) {
    Materials& materials = scene.materials;
    return textures->make(
        halvings_shown(scene.mesh, materials, scene.origin, camera, size.height * size.supersample),
        materials.pictures, file, remarks);
  }

  /// Draws the shadow maps that the options require; null without shadows.
  Result<ShadowPass*> draw_shadows(const DrawOptions& options) {
    if (options.shadows == 0) return nullptr;
    if (!shadows) {
      if (!textures->leave(ShadowPass::mask_bytes(scene.materials)))
        return tl::unexpected(beyond_memory(file, "", "the masks that cast shadows", scene_memory));
      auto made = ShadowPass::create(gl, scene.mesh, scene.materials);
      if (!made) return tl::unexpected(made.error());
      shadows = std::move(*made);
    }
    const std::vector<ShadowView> views =
        shadow_views(options.lights, scene.mesh.positions, scene.origin, options.shadows);
    // A map is stored twice, by OpenGL and by the program.
    constexpr std::size_t max_texels = std::size_t{1} << 28;
    const std::size_t side = options.shadows;
    if (views.size() * side * side > max_texels) {
      return fail(
          Code::option_out_of_range, "", "--shadows",
          fmt::format("{} maps of {} texels a side are more than {} texels", views.size(), side, max_texels));
    }
    if (const auto good = shadows->draw(views); !good) return tl::unexpected(good.error());
    return shadows.get();
  }
};

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Renderer::~Renderer() {
  // OpenGL objects are deleted in their context.
  if (state_ && state_->context) static_cast<void>(state_->context->make_current());
}
const std::vector<std::string>& Renderer::remarks() const { return state_->remarks; }

Result<std::unique_ptr<Renderer>> Renderer::create(const Scene& scene, const std::vector<Fabric>& fabrics,
                                                   const RenderOptions& options,
                                                   std::unique_ptr<GraphicsContext> context) {
  Stopwatch watch;
  if (const auto good = check_size(options); !good) return tl::unexpected(good.error());
  if (const auto good = check_draw(options); !good) return tl::unexpected(good.error());
  const Result<std::vector<V3d>> points = world_points(scene);
  if (!points) return tl::unexpected(points.error());

  auto state = std::make_unique<State>();
  State& s = *state;
  s.kind = options.path;
  s.file = scene.file;
  s.scene_memory = scene.memory_left;
  s.size = options;
  // Coordinates relative to the scene's centre keep their precision in float.
  Imath::Box3d bounds;
  for (const V3d& point : *points) bounds.extendBy(point);
  s.scene.origin = bounds.center();
  const Result<std::vector<Surface>> surfaces = build_surfaces(scene, s.scene.origin);
  if (!surfaces) return tl::unexpected(surfaces.error());
  Result<Materials> materials = materials_of(scene, *surfaces, fabrics.size(), s.remarks);
  if (!materials) return tl::unexpected(materials.error());
  s.scene.materials = std::move(*materials);
  s.scene.mesh = merge(*surfaces);
  for (const Fabric& fabric : fabrics) s.scene.fabrics.emplace_back(fabric);

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
  s.textures = std::make_unique<PictureTextures>(s.gl, scene.memory_left);
  const auto keep = [&](auto path) -> Result<void> {
    if (!path) return tl::unexpected(path.error());
    s.path = std::move(*path);
    return {};
  };
  if (s.kind == RenderPath::paper) {
    const auto good = check_paper_fabrics(scene, s.scene.materials, fabrics, s.remarks);
    if (!good) return tl::unexpected(good.error());
  }
  const auto made = s.kind == RenderPath::shader ? keep(ShaderPath::create(s.gl, s.scene, fabrics, options))
                                                 : keep(HybridPath::create(s.gl, s.scene, options, s.kind));
  if (!made) return tl::unexpected(made.error());
  watch.add_to(s.prepare);
  return std::unique_ptr<Renderer>(new Renderer(std::move(state)));
}

Result<void> Renderer::draw(const Camera& camera, const DrawOptions& options, Frame& frame,
                            RenderStats& stats) {
  State& s = *state_;
  stats = {};
  stats.triangles = static_cast<std::int64_t>(s.scene.mesh.triangles.size());
  if (auto good = s.context->make_current(); !good) return good;
  if (auto good = check_draw(options); !good) return good;
  Stopwatch watch;
  if (auto good = s.make_textures(camera); !good) return good;
  watch.add_to(s.prepare);
  stats.prepare = s.prepare;
  const Result<ShadowPass*> shadows = s.draw_shadows(options);
  if (!shadows) return tl::unexpected(shadows.error());
  const Result<std::span<const SmoothLight>> around = s.shade_around(options);
  if (!around) return tl::unexpected(around.error());
  stats.remarks = s.remarks;
  if (*shadows != nullptr) {
    watch.add_to(stats.shadows);
    if ((*shadows)->views().size() < options.lights.size())
      stats.remarks.push_back(fmt::format(
          "{} of {} lights cast no shadows: points, wide cones, and lights after the first {}",
          options.lights.size() - (*shadows)->views().size(), options.lights.size(), max_shadows));
  }
  frame.width = s.size.width;
  frame.height = s.size.height;
  frame.pixels.resize(frame.width * frame.height);
  const std::shared_ptr<const Reflections> reflections = s.reflect(options);
  watch.add_to(stats.prepare);
  if (auto good = s.path->draw({camera, options, *shadows, *around, reflections}, frame, stats); !good)
    return good;
  if (!options.environment || options.backdrop < 0 || options.ends()) return {};
  add_backdrop(camera, options, reflections.get(), frame);
  return {};
}

Result<void> Renderer::resize(const FrameSize& size) {
  State& s = *state_;
  if (auto good = check_size(size); !good) return good;
  if (auto good = s.context->make_current(); !good) return good;
  s.size = size;
  if (auto good = s.path->resize(size); !good || !s.probes) return good;
  return s.probes->resize(size);
}

Result<std::optional<PixelProbe>> Renderer::probe(const Camera& camera, const DrawOptions& options,
                                                  const V2i& pixel) {
  if (const auto good = state_->context->make_current(); !good) return tl::unexpected(good.error());
  if (const auto good = state_->make_textures(camera); !good) return tl::unexpected(good.error());
  const Result<HybridPath*> hybrid = state_->hybrid();
  if (!hybrid) return tl::unexpected(hybrid.error());
  const Result<ShadowPass*> shadows = state_->draw_shadows(options);
  if (!shadows) return tl::unexpected(shadows.error());
  const auto around = state_->shade_around(options);
  if (!around) return tl::unexpected(around.error());
  return (*hybrid)->probe({camera, options, *shadows, *around, state_->reflect(options)}, pixel);
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
