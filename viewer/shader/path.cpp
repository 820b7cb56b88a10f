#include "viewer/shader/path.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "format/base/guard.h"
#include "format/cells/cell_texels.h"
#include "format/fabric/gpu_words.h"
#include "format/fabric/yarn_sky.h"
#include "viewer/gl/glsl.h"
#include "viewer/gl/objects.h"
#include "viewer/scene/view_rays.h"

namespace selvedge {
namespace {

// Uniform locations, texture units and bindings in triangle_*.glsl, shade_pixel.glsl, level_options.glsl and
// lights.glsl.
namespace triangle {
enum Uniform : GLint {
  to_clip,
  first_triangle,
  culls_back,
};
enum Unit : GLuint { depth_unit = 1, frame_unit };
}  // namespace triangle
namespace shading {
enum Uniform : GLint {
  to_clip,
  frame_size,
  ray_base,
  ray_right,
  ray_up,
  lights_in_use,
  forced_level,
  ambient = 10,
  points,
  around_stride,
  skies,
  last_reflection,
  environment
};
enum Unit : GLuint { triangles_unit, colours_unit, pbr_unit, shadows_unit };
enum Binding : GLuint { fabrics, vertices, triangles, surfaces, lights, shadows, around, reflections };
}  // namespace shading

/// Of a surface.
enum SurfaceFlag : std::int32_t {
  keeps_opacity_flag = 1,
  unlit_flag = 2,
  shines_flag = 4,
  tinted_flag = 8,
  bends_flag = 16,
  occluded_flag = 32
};

constexpr std::uint32_t highest_bit = 0x80000000U;

/// Appends what the fabrics make of light from all around, as around.glsl has it, and returns its place.
std::size_t append_skies(std::span<const FabricSides> fabrics, std::vector<std::uint32_t>& words) {
  const std::size_t first = words.size();
  std::size_t at = first;
  words.resize(first + 6 * fabrics.size());
  const auto append = [&](std::span<const float> values) {
    words[at++] = static_cast<std::uint32_t>(words.size());
    for (const float value : values) words.push_back(std::bit_cast<std::uint32_t>(value));
  };
  for (const FabricSides& fabric : fabrics) {
    for (const Fabric* seen : {fabric.front, fabric.turned.get()}) {
      const Fabric* const through = seen != nullptr ? seen->side_of(Side::through) : nullptr;
      const bool has_yarn = seen != nullptr && seen->levels.front().yarns();
      append(seen != nullptr ? smooth_response(*seen) : std::vector<float>());
      append(has_yarn ? sky_of(*seen->levels.front().yarns()) : std::vector<float>());
      append(through != nullptr ? smooth_response(*through) : std::vector<float>());
    }
  }
  return first;
}

void set_uniform(const GlFunctions& gl, GLint at, const V3f& v) { gl.Uniform3f(at, v.x, v.y, v.z); }

}  // namespace

Result<std::unique_ptr<ShaderPath>> ShaderPath::create(const GlFunctions& gl, const PreparedScene& scene,
                                                       std::span<const Fabric> fabrics,
                                                       const FrameSize& size) {
  std::unique_ptr<ShaderPath> path(new ShaderPath(gl, scene));
  return result_of([&] {
    path->load(fabrics);
    value_or_throw(path->resize(size));
    return std::move(path);
  });
}

void ShaderPath::load(std::span<const Fabric> fabrics) {
  shows_yarn_ = std::ranges::any_of(
      fabrics, [](const Fabric& fabric) { return !fabric.levels.empty() && fabric.levels.front().yarns(); });
  for (std::size_t later = 0; later < 2; ++later)
    triangle_programs_[later] = value_or_throw(pbr_.triangle_program(objects_, "", later != 0));
  shading_program(false, false);

  const MergedSurfaces& mesh = scene_.mesh;
  std::vector<std::uint32_t> words = gpu_words(fabrics);
  skies_ = static_cast<GLint>(append_skies(scene_.fabrics, words));
  std::vector<V4f> vertices;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const V3f& p = mesh.positions[i];
    const auto& [normal_u, tangent_v] = mesh.attributes[i];
    vertices.emplace_back(p.x, p.y, p.z, normal_u[3]);
    vertices.emplace_back(normal_u[0], normal_u[1], normal_u[2], tangent_v[3]);
    vertices.emplace_back(tangent_v[0], tangent_v[1], tangent_v[2], 0.0F);
  }
  std::vector<std::array<std::uint32_t, 4>> triangles;
  for (const MergedTriangle& t : mesh.triangles)
    triangles.push_back(
        {t.corners[0], t.corners[1], t.corners[2], t.surface | (t.handedness < 0 ? highest_bit : 0)});
  std::vector<std::array<std::int32_t, 2>> surfaces;
  for (std::size_t i = 0; i < scene_.materials.surfaces.size(); ++i) {
    const SurfaceMaterial& material = scene_.materials.surfaces[i];
    const PbrMaterial& pbr = scene_.materials.pbr[i];
    surfaces.push_back(
        {material.fabric, (material.keeps_opacity ? keeps_opacity_flag : 0) | (pbr.unlit ? unlit_flag : 0) |
                              (pbr.emissive != V3f(0, 0, 0) ? shines_flag : 0) |
                              (material.tinted ? tinted_flag : 0) | (material.bends ? bends_flag : 0) |
                              (material.occluded ? occluded_flag : 0)});
  }

  GLint64 max_bytes = 0;
  gl_.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &max_bytes);
  const std::size_t largest =
      std::max({words.size() * sizeof(words[0]), vertices.size() * sizeof(V4f), triangles.size() * 16});
  if (largest > static_cast<std::size_t>(max_bytes)) {
    throw Failure{{Code::option_out_of_range,
                   {},
                   "--path",
                   fmt::format("shader: {} bytes in one buffer; this OpenGL allows {}. The hybrid path has "
                               "no such limit",
                               largest, max_bytes)}};
  }
  spans_ = spans_of(mesh);
  buffers_ = {objects_.buffer(words), objects_.buffer(vertices), objects_.buffer(triangles),
              objects_.buffer(surfaces)};
  any_ = objects_.query(GL_ANY_SAMPLES_PASSED);
  empty_array_ = objects_.vertex_array();
  array_ = objects_.vertex_array();
  // u and v are one group apart.
  constexpr std::size_t stride = 3 * sizeof(V4f);
  add_attribute(gl_, array_, {0, buffers_[1], 3, 0, stride});
  add_attribute(gl_, array_, {1, buffers_[1], 1, 3 * sizeof(float), stride});
  add_attribute(gl_, array_, {2, buffers_[1], 1, 7 * sizeof(float), stride});
  pbr_.attach(array_);
  gl_.VertexArrayElementBuffer(array_, objects_.buffer(corners_of(mesh)));
  value_or_throw(check_errors(gl_, "upload"));
}

GLuint ShaderPath::shading_program(bool shadows, bool around) {
  GLuint& program = shading_programs_[(shadows ? 1 : 0) + (around ? 2 : 0)];
  if (program != 0) return program;
  const std::string definitions = pbr_.definitions() + (shadows ? "#define SHADOWS\n" : "") +
                                  (shows_yarn_ ? "#define YARN\n" : "") + (around ? "#define AROUND\n" : "");
  return program = value_or_throw(objects_.program(
             shader_text("", {glsl::frame_vertex}),
             shader_text(
                 definitions,
                 {glsl::lights, shadows ? glsl::shadow_offsets : "", shadows ? glsl::shadow_lookup : "",
                  glsl::word_layout, glsl::fabric_words, around ? glsl::around : "", glsl::evaluate,
                  shows_yarn_ ? glsl::yarn : "", pbr_.needed() ? glsl::pbr_brdf : "", glsl::footprint,
                  glsl::level_options, glsl::fabric_surface, glsl::shade_pixel})));
}

Result<void> ShaderPath::resize(const FrameSize& size) {
  const int width = size.width * size.supersample;
  const int height = size.height * size.supersample;
  size_ = size;
  if (width == width_ && height == height_) return {};
  targets_.clear();
  width_ = height_ = 0;
  for (TriangleTarget& round : rounds_) {
    const auto made = pbr_.make_target(targets_, GL_DEPTH_COMPONENT32F, width, height);
    if (!made) return tl::unexpected(made.error());
    round = *made;
  }
  result_colour_ = targets_.plain_texture(GL_RGBA32F, width, height);
  const Result<GLuint> result = targets_.framebuffer(std::span(&result_colour_, 1));
  if (!result) return tl::unexpected(result.error());
  result_ = *result;
  width_ = width;
  height_ = height;
  return {};
}

/// Draws the triangle numbers of a round.
void ShaderPath::draw_round(int round, const std::array<GLfloat, 16>& clip) {
  const GLuint framebuffer = rounds_[round % 2].framebuffer;
  constexpr std::array<GLuint, 4> nothing{0, 0, 0, 0};
  constexpr GLfloat farthest = 1;
  gl_.ClearNamedFramebufferuiv(framebuffer, GL_COLOR, 0, nothing.data());
  gl_.ClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &farthest);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  gl_.Disable(GL_BLEND);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_LESS);
  gl_.UseProgram(triangle_programs_[round == 0 ? 0 : 1]);
  gl_.UniformMatrix4fv(triangle::to_clip, 1, GL_FALSE, clip.data());
  if (round > 0) {
    gl_.BindTextureUnit(triangle::depth_unit, rounds_[(round + 1) % 2].depth);
    gl_.BindTextureUnit(triangle::frame_unit, result_colour_);
  }
  gl_.BindVertexArray(array_);
  gl_.BeginQuery(GL_ANY_SAMPLES_PASSED, any_);
  for (const TriangleSpan& span : spans_) {
    gl_.Uniform1i(triangle::first_triangle, static_cast<GLint>(span.first + 1));
    gl_.Uniform1i(triangle::culls_back, scene_.materials.surfaces[span.surface].culls_back ? 1 : 0);
    pbr_.use(span.surface);
    draw_triangles(gl_, span.first, span.end);
  }
  gl_.EndQuery(GL_ANY_SAMPLES_PASSED);
}

/// Shades a round and composites it behind the accumulated light.
void ShaderPath::shade_round(int round, const FrameView& view, GLuint program,
                             const std::array<GLfloat, 16>& clip) {
  const ViewRays rays = view_rays(view.camera, width_, height_);
  const LevelOptions& levels = view.options.levels;
  const TriangleTarget& seen = rounds_[round % 2];
  gl_.BindFramebuffer(GL_FRAMEBUFFER, result_);
  gl_.Disable(GL_DEPTH_TEST);
  gl_.Enable(GL_BLEND);
  gl_.BlendFunc(GL_ONE_MINUS_DST_ALPHA, GL_ONE);
  gl_.UseProgram(program);
  gl_.UniformMatrix4fv(shading::to_clip, 1, GL_FALSE, clip.data());
  gl_.Uniform2f(shading::frame_size, static_cast<GLfloat>(width_), static_cast<GLfloat>(height_));
  set_uniform(gl_, shading::ray_base, rays.base);
  set_uniform(gl_, shading::ray_right, rays.right);
  set_uniform(gl_, shading::ray_up, rays.up);
  gl_.Uniform1i(shading::lights_in_use, static_cast<GLint>(view.options.lights.size()));
  gl_.Uniform1i(shading::forced_level, levels.forced);
  if (shows_yarn_) gl_.Uniform1i(shading::points, levels.points);
  if (view.options.around) {
    gl_.Uniform1i(shading::around_stride, view.around_vertices.empty() ? 0 : 3 * smooth_functions);
    gl_.Uniform1i(shading::skies, skies_);
  }
  gl_.BindTextureUnit(shading::triangles_unit, seen.triangles);
  if (pbr_.needed()) {
    gl_.Uniform1f(shading::ambient, view.options.ambient);
    gl_.BindTextureUnit(shading::colours_unit, seen.colours);
    gl_.BindTextureUnit(shading::pbr_unit, seen.pbr);
    gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, shading::reflections, reflections_.name);
  }
  if (pbr_.needed() && view.options.around) {
    const Reflections* reflections = view.reflections.get();
    gl_.Uniform1i(shading::last_reflection,
                  reflections ? static_cast<GLint>(reflections->levels.size()) - 1 : 0);
    const EnvironmentOptions of = reflections ? reflections->levels[0].options : EnvironmentOptions{};
    gl_.Uniform2f(shading::environment, static_cast<GLfloat>(of.turn / 360),
                  static_cast<GLfloat>(of.strength));
  }
  if (view.shadows != nullptr) gl_.BindTextureUnit(shading::shadows_unit, view.shadows->texture());
  gl_.BindVertexArray(empty_array_);
  gl_.DrawArrays(GL_TRIANGLES, 0, 3);
}

template <class T>
void ShaderPath::load(const std::vector<T>& values, GrowingBuffer& buffer) {
  const std::size_t bytes = values.size() * sizeof(T);
  if (buffer.name == 0 || buffer.room < bytes) {
    buffer.room = std::max(bytes, 4 * sizeof(V4f));
    buffer.name = objects_.buffer(buffer.room, nullptr, GL_DYNAMIC_STORAGE_BIT);
  }
  if (bytes > 0) gl_.NamedBufferSubData(buffer.name, 0, static_cast<GLsizeiptr>(bytes), values.data());
}

void ShaderPath::set_lights(const FrameView& view) {
  std::vector<V4f> groups;
  for (const Light& light : view.options.lights) {
    const V3f d(light.direction);
    const V3f p(light.position - scene_.origin);
    groups.emplace_back(d.x, d.y, d.z, static_cast<float>(light.kind));
    groups.emplace_back(light.irradiance.x, light.irradiance.y, light.irradiance.z,
                        static_cast<float>(light.range));
    groups.emplace_back(p.x, p.y, p.z, static_cast<float>(light.cos_inner));
    groups.emplace_back(static_cast<float>(light.cos_outer), 0.0F, light.of_environment ? 1.0F : 0.0F, 0.0F);
  }
  if (view.shadows != nullptr) {
    for (std::size_t i = 0; i < view.shadows->views().size(); ++i)
      groups[4 * view.shadows->views()[i].light + 3].y = static_cast<float>(i + 1);
    gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, shading::shadows, view.shadows->buffer());
  }
  load(groups, lights_);
  for (GLuint binding = 0; binding < buffers_.size(); ++binding)
    gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffers_[binding]);
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, shading::lights, lights_.name);
}

static_assert(sizeof(SmoothLight) == 3 * smooth_functions * sizeof(float));

/// Loads light from all around, which stays the same for many frames.
void ShaderPath::set_around(const FrameView& view) {
  const SmoothLight& all = *view.options.around;
  if (around_loaded_.empty() || around_loaded_[0] != all ||
      !std::ranges::equal(view.around_vertices, std::span(around_loaded_).subspan(1))) {
    around_loaded_.assign(1, all);
    around_loaded_.insert(around_loaded_.end(), view.around_vertices.begin(), view.around_vertices.end());
    load(around_loaded_, around_);
  }
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, shading::around, around_.name);
}

/// Loads what core materials reflect, as pbr_brdf.glsl has it.
void ShaderPath::set_reflections(const FrameView& view) {
  if (reflections_.name != 0 && reflections_loaded_ == view.reflections) return;
  reflections_loaded_ = view.reflections;
  std::vector<float> numbers;
  for (const V2f& share : reflected_shares()) numbers.insert(numbers.end(), {share.x, share.y});
  if (view.reflections) {
    const auto& levels = view.reflections->levels;
    std::size_t first = numbers.size() + 2 * levels.size();
    for (const Environment& level : levels) {
      // Whole numbers below 2^24.
      numbers.insert(numbers.end(), {static_cast<float>(first), static_cast<float>(level.width)});
      first += 3 * level.radiance.size();
    }
    for (const Environment& level : levels) {
      for (const V3f& c : level.radiance) numbers.insert(numbers.end(), {c.x, c.y, c.z});
    }
  }
  load(numbers, reflections_);
}

void ShaderPath::draw_rounds(const FrameView& view, RenderStats& stats) {
  const GLuint program = shading_program(view.shadows != nullptr, view.options.around.has_value());
  set_lights(view);
  if (view.options.around) set_around(view);
  if (pbr_.needed()) set_reflections(view);
  const std::array<GLfloat, 16> clip = gl_matrix(clip_matrix(view.camera, scene_.origin));
  constexpr std::array<GLfloat, 4> empty{0, 0, 0, 0};
  gl_.ClearNamedFramebufferfv(result_, GL_COLOR, 0, empty.data());
  // Dithering is on by default and would change coded values.
  gl_.Disable(GL_DITHER);
  gl_.Disable(GL_CULL_FACE);
  gl_.Disable(GL_STENCIL_TEST);
  gl_.Viewport(0, 0, width_, height_);
  for (int round = 0; round < size_.layers && !view.options.ends(); ++round) {
    draw_round(round, clip);
    GLuint any = 0;
    gl_.GetQueryObjectuiv(any_, GL_QUERY_RESULT, &any);
    if (any == 0) break;
    stats.layers = round + 1;
    shade_round(round, view, program, clip);
  }
  gl_.Disable(GL_BLEND);
  value_or_throw(check_errors(gl_, "drawing"));
}

Result<void> ShaderPath::draw(const FrameView& view, Frame& frame, RenderStats& stats) {
  Stopwatch watch;
  if (view.shadows != nullptr) {
    gl_.Finish();
    watch.add_to(stats.shadows);
  }
  const bool maps = view.shadows != nullptr && !view.shadows->views().empty();
  FrameView seen = view;
  if (!maps) seen.shadows = nullptr;
  if (auto good = result_of([&] { draw_rounds(seen, stats); }); !good) return good;
  gl_.Finish();
  watch.add_to(stats.geometry);
  large_.resize(width_ * height_);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, result_);
  gl_.NamedFramebufferReadBuffer(result_, GL_COLOR_ATTACHMENT0);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 4);
  gl_.ReadPixels(0, 0, width_, height_, GL_RGBA, GL_FLOAT, large_.data());
  watch.add_to(stats.read_back);
  stats.covered_pixels = std::ranges::count_if(large_, [](const V4f& p) { return p.w > 0; });
  box_filter(large_, 0, size_.supersample, frame);
  watch.add_to(stats.filter);
  return {};
}

}  // namespace selvedge
