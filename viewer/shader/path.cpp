#include "viewer/shader/path.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "viewer/gl/objects.h"
#include "viewer/glsl.h"
#include "viewer/scene/view_rays.h"
#include "viewer/shader/buffers.h"

namespace selvedge {
namespace {

// Locations of the uniforms, units and bindings, as written in triangle_*.glsl, shade_pixel.glsl and
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
  blend_levels,
  max_taps,
  level_bias,
  linear,
  ambient
};
enum Unit : GLuint { triangles_unit, colours_unit, pbr_unit, shadows_unit };
enum Binding : GLuint { fabrics, vertices, triangles, surfaces, lights, shadows };
}  // namespace shading

/// Of a surface.
enum SurfaceFlag : std::int32_t { keeps_opacity_flag = 1, unlit_flag = 2, shines_flag = 4 };

constexpr std::uint32_t highest_bit = 0x80000000U;

GLuint make_buffer(const GlFunctions& gl, std::size_t bytes, const void* data, GLbitfield flags = 0) {
  GLuint buffer = 0;
  gl.CreateBuffers(1, &buffer);
  gl.NamedBufferStorage(buffer, static_cast<GLsizeiptr>(std::max<std::size_t>(bytes, 16)),
                        bytes >= 16 ? data : nullptr, flags | (bytes < 16 ? GL_DYNAMIC_STORAGE_BIT : 0U));
  if (bytes > 0 && bytes < 16) gl.NamedBufferSubData(buffer, 0, static_cast<GLsizeiptr>(bytes), data);
  return buffer;
}

template <class T>
GLuint make_buffer(const GlFunctions& gl, const std::vector<T>& values) {
  return make_buffer(gl, values.size() * sizeof(T), values.data());
}

void set_uniform(const GlFunctions& gl, GLint at, const V3f& v) { gl.Uniform3f(at, v.x, v.y, v.z); }

}  // namespace

Result<std::unique_ptr<ShaderPath>> ShaderPath::create(const GlFunctions& gl, const MergedSurfaces& mesh,
                                                       const Materials& materials,
                                                       std::span<const Fabric> fabrics) {
  std::unique_ptr<ShaderPath> path(new ShaderPath(gl, mesh, materials));
  if (const auto good = path->load(mesh, fabrics); !good) return tl::unexpected(good.error());
  return path;
}

Result<void> ShaderPath::load(const MergedSurfaces& mesh, std::span<const Fabric> fabrics) {
  for (std::size_t later = 0; later < 2; ++later) {
    const Result<GLuint> program = core_.triangle_program("", later != 0);
    if (!program) return tl::unexpected(program.error());
    triangle_programs_[later] = *program;
  }
  if (const auto program = shading_program(false); !program) return tl::unexpected(program.error());

  const std::vector<std::uint32_t> words = shader_words(fabrics);
  std::vector<V4f> vertices;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const V3f& p = mesh.positions[i];
    const auto& [normal_u, tangent_v] = mesh.attributes[i];
    vertices.emplace_back(p.x, p.y, p.z, normal_u[3]);
    vertices.emplace_back(normal_u[0], normal_u[1], normal_u[2], tangent_v[3]);
    vertices.emplace_back(tangent_v[0], tangent_v[1], tangent_v[2], 0.0F);
  }
  std::vector<std::array<std::uint32_t, 4>> triangles;
  std::vector<std::uint32_t> indices;
  for (const MergedTriangle& t : mesh.triangles) {
    if (spans_.empty() || triangles.back()[3] % highest_bit != t.surface)
      spans_.push_back({t.surface, triangles.size(), triangles.size()});
    ++spans_.back().end;
    triangles.push_back(
        {t.corners[0], t.corners[1], t.corners[2], t.surface | (t.handedness < 0 ? highest_bit : 0)});
    indices.insert(indices.end(), t.corners.begin(), t.corners.end());
  }
  std::vector<std::array<std::int32_t, 2>> surfaces;
  for (std::size_t i = 0; i < materials_.materials.size(); ++i) {
    const SurfaceMaterial& look = materials_.materials[i];
    const PbrMaterial& pbr = materials_.pbr[i];
    surfaces.push_back({look.fabric, (look.keeps_opacity ? keeps_opacity_flag : 0) |
                                         (pbr.unlit ? unlit_flag : 0) |
                                         (pbr.emissive != V3f(0, 0, 0) ? shines_flag : 0)});
  }

  GLint64 room = 0;
  gl_.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &room);
  const std::size_t largest =
      std::max({words.size() * sizeof(words[0]), vertices.size() * sizeof(V4f), triangles.size() * 16});
  if (largest > static_cast<std::size_t>(room)) {
    return fail(Code::option_out_of_range, {}, "--path",
                fmt::format("shader: {} bytes in one buffer; this OpenGL allows {}. The hybrid path has no "
                            "such limit",
                            largest, room));
  }
  fabrics_ = make_buffer(gl_, words);
  vertices_ = make_buffer(gl_, vertices);
  triangles_ = make_buffer(gl_, triangles);
  surfaces_ = make_buffer(gl_, surfaces);
  indices_ = make_buffer(gl_, indices);
  gl_.CreateQueries(GL_ANY_SAMPLES_PASSED, 1, &any_);
  gl_.CreateQueries(GL_TIMESTAMP, static_cast<GLsizei>(clocks_.size()), clocks_.data());

  gl_.CreateVertexArrays(1, &empty_array_);
  gl_.CreateVertexArrays(1, &array_);
  constexpr GLsizei stride = 3 * sizeof(V4f);
  gl_.VertexArrayVertexBuffer(array_, 0, vertices_, 0, stride);
  const auto attribute = [&](GLuint location, GLint components, GLuint offset) {
    gl_.EnableVertexArrayAttrib(array_, location);
    gl_.VertexArrayAttribFormat(array_, location, components, GL_FLOAT, GL_FALSE, offset);
    gl_.VertexArrayAttribBinding(array_, location, 0);
  };
  attribute(0, 3, 0);
  // u and v stand apart: v is one group behind u.
  attribute(1, 1, 3 * sizeof(float));
  attribute(2, 1, 7 * sizeof(float));
  core_.attach(array_);
  gl_.VertexArrayElementBuffer(array_, indices_);
  return check_errors(gl_, "upload");
}

Result<GLuint> ShaderPath::shading_program(bool shadows) {
  GLuint& program = shading_programs_[shadows ? 1 : 0];
  if (program != 0) return program;
  const std::string definitions = core_.definitions() + (shadows ? "#define SHADOWS\n" : "");
  Result<GLuint> made = make_program(
      gl_, shader_text("", {glsl::frame_vertex}),
      shader_text(definitions,
                  {glsl::lights, shadows ? glsl::shadow_offsets : "", shadows ? glsl::shadow_lookup : "",
                   glsl::word_layout, glsl::fabric_words, glsl::evaluate, glsl::slabs,
                   core_.needed() ? glsl::pbr_brdf : "", glsl::footprint, glsl::shade_pixel}));
  if (made) program = *made;
  return made;
}

void ShaderPath::release_targets() {
  for (Round& round : rounds_) {
    gl_.DeleteFramebuffers(1, &round.framebuffer);
    const std::array textures{round.triangles, round.colours, round.pbr, round.depth};
    gl_.DeleteTextures(static_cast<GLsizei>(textures.size()), textures.data());
    round = {};
  }
  gl_.DeleteFramebuffers(1, &result_.framebuffer);
  gl_.DeleteTextures(1, &result_.colour);
  result_ = {};
}

ShaderPath::~ShaderPath() {
  release_targets();
  const std::array arrays{array_, empty_array_};
  gl_.DeleteVertexArrays(static_cast<GLsizei>(arrays.size()), arrays.data());
  const std::array buffers{indices_, fabrics_, vertices_, triangles_, surfaces_, lights_};
  gl_.DeleteBuffers(static_cast<GLsizei>(buffers.size()), buffers.data());
  const std::array queries{any_, clocks_[0], clocks_[1]};
  gl_.DeleteQueries(static_cast<GLsizei>(queries.size()), queries.data());
  for (const GLuint program :
       {triangle_programs_[0], triangle_programs_[1], shading_programs_[0], shading_programs_[1]}) {
    gl_.DeleteProgram(program);
  }
}

Result<void> ShaderPath::resize(int width, int height) {
  if (width == width_ && height == height_) return {};
  release_targets();
  width_ = width;
  height_ = height;
  constexpr std::array<GLenum, 3> attachments{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1,
                                              GL_COLOR_ATTACHMENT2};
  const auto complete = [&](GLuint framebuffer) -> Result<void> {
    if (gl_.CheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return {};
    return fail(Code::graphics_unavailable, "", "frame buffer", "OpenGL refuses it");
  };
  for (Round& round : rounds_) {
    round.triangles = make_plain_texture(gl_, GL_R32UI, width, height);
    round.depth = make_plain_texture(gl_, GL_DEPTH_COMPONENT32F, width, height);
    gl_.CreateFramebuffers(1, &round.framebuffer);
    gl_.NamedFramebufferTexture(round.framebuffer, GL_COLOR_ATTACHMENT0, round.triangles, 0);
    gl_.NamedFramebufferTexture(round.framebuffer, GL_DEPTH_ATTACHMENT, round.depth, 0);
    if (core_.needed()) {
      round.colours = make_plain_texture(gl_, GL_RGBA32F, width, height);
      round.pbr = make_plain_texture(gl_, GL_RGBA32UI, width, height);
      gl_.NamedFramebufferTexture(round.framebuffer, GL_COLOR_ATTACHMENT1, round.colours, 0);
      gl_.NamedFramebufferTexture(round.framebuffer, GL_COLOR_ATTACHMENT2, round.pbr, 0);
    }
    gl_.NamedFramebufferDrawBuffers(round.framebuffer, core_.needed() ? 3 : 1, attachments.data());
    if (auto good = complete(round.framebuffer); !good) return good;
  }
  result_.colour = make_plain_texture(gl_, GL_RGBA32F, width, height);
  gl_.CreateFramebuffers(1, &result_.framebuffer);
  gl_.NamedFramebufferTexture(result_.framebuffer, GL_COLOR_ATTACHMENT0, result_.colour, 0);
  gl_.NamedFramebufferDrawBuffers(result_.framebuffer, 1, attachments.data());
  return complete(result_.framebuffer);
}

void ShaderPath::draw_triangles(const Round& to, const Round& before, int round,
                                const std::array<GLfloat, 16>& clip) {
  constexpr std::array<GLuint, 4> nothing{0, 0, 0, 0};
  constexpr GLfloat farthest = 1;
  gl_.ClearNamedFramebufferuiv(to.framebuffer, GL_COLOR, 0, nothing.data());
  gl_.ClearNamedFramebufferfv(to.framebuffer, GL_DEPTH, 0, &farthest);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, to.framebuffer);
  gl_.Disable(GL_BLEND);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_LESS);
  gl_.UseProgram(triangle_programs_[round == 0 ? 0 : 1]);
  gl_.UniformMatrix4fv(triangle::to_clip, 1, GL_FALSE, clip.data());
  if (round > 0) {
    gl_.BindTextureUnit(triangle::depth_unit, before.depth);
    gl_.BindTextureUnit(triangle::frame_unit, result_.colour);
  }
  gl_.BindVertexArray(array_);
  gl_.BeginQuery(GL_ANY_SAMPLES_PASSED, any_);
  for (const Span& span : spans_) {
    gl_.Uniform1i(triangle::first_triangle, static_cast<GLint>(span.first + 1));
    gl_.Uniform1i(triangle::culls_back, materials_.materials[span.surface].culls_back ? 1 : 0);
    core_.use(span.surface);
    gl_.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * (span.end - span.first)), GL_UNSIGNED_INT,
                     reinterpret_cast<const void*>(3 * span.first * sizeof(std::uint32_t)));
  }
  gl_.EndQuery(GL_ANY_SAMPLES_PASSED);
}

Result<void> ShaderPath::draw(const Camera& camera, const V3d& origin, std::span<const Light> lights,
                              const ShaderFrame& frame, ShaderTimes* times) {
  if (auto good = resize(frame.width, frame.height); !good) return good;
  std::array<GLfloat, 16> clip{};
  const M44d matrix = clip_matrix(camera, origin);
  // Imath's row vectors and row-major memory are OpenGL's column vectors and column-major memory.
  for (std::size_t i = 0; i < 16; ++i) clip[i] = static_cast<GLfloat>(matrix[static_cast<int>(i / 4)][i % 4]);
  std::vector<V4f> light_groups;
  for (const Light& light : lights) {
    const V3f d(light.direction);
    const V3f p(light.position - origin);
    const float kind = light.kind == LightKind::directional ? 0.0F
                       : light.kind == LightKind::point     ? 1.0F
                                                            : 2.0F;
    light_groups.emplace_back(d.x, d.y, d.z, kind);
    light_groups.emplace_back(light.irradiance.x, light.irradiance.y, light.irradiance.z,
                              static_cast<float>(light.range));
    light_groups.emplace_back(p.x, p.y, p.z, static_cast<float>(light.cos_inner));
    light_groups.emplace_back(static_cast<float>(light.cos_outer), 0.0F, 0.0F, 0.0F);
  }
  const bool has_shadows = frame.shadows != nullptr && !frame.shadows->views().empty();
  const Result<GLuint> program = shading_program(has_shadows);
  if (!program) return tl::unexpected(program.error());
  if (has_shadows) {
    for (std::size_t i = 0; i < frame.shadows->views().size(); ++i)
      light_groups[4 * frame.shadows->views()[i].light + 3].y = static_cast<float>(i + 1);
    gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, shading::shadows, frame.shadows->buffer());
  }
  if (light_room_ < light_groups.size() || lights_ == 0) {
    gl_.DeleteBuffers(1, &lights_);
    light_room_ = std::max<std::size_t>(light_groups.size(), 4);
    lights_ = make_buffer(gl_, light_room_ * sizeof(V4f), nullptr, GL_DYNAMIC_STORAGE_BIT);
  }
  if (!light_groups.empty()) {
    gl_.NamedBufferSubData(lights_, 0, static_cast<GLsizeiptr>(light_groups.size() * sizeof(V4f)),
                           light_groups.data());
  }
  const std::array buffers{fabrics_, vertices_, triangles_, surfaces_, lights_};
  for (GLuint binding = 0; binding < buffers.size(); ++binding) {
    gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffers[binding]);
  }

  constexpr std::array<GLfloat, 4> empty{0, 0, 0, 0};
  gl_.ClearNamedFramebufferfv(result_.framebuffer, GL_COLOR, 0, empty.data());
  // On by default, and it would change coded values.
  gl_.Disable(GL_DITHER);
  gl_.Disable(GL_CULL_FACE);
  gl_.Disable(GL_STENCIL_TEST);
  gl_.Viewport(0, 0, frame.width, frame.height);
  ShaderTimes sum;
  const auto stamp = [&](std::size_t clock) {
    if (times != nullptr) gl_.QueryCounter(clocks_[clock], GL_TIMESTAMP);
  };
  // Waits for the graphics processor; asked for by those who measure.
  const auto between = [&](std::uint64_t& to) {
    if (times == nullptr) return;
    std::array<GLuint64, 2> at{};
    for (std::size_t i = 0; i < 2; ++i) gl_.GetQueryObjectui64v(clocks_[i], GL_QUERY_RESULT, &at[i]);
    to += at[1] - at[0];
  };
  const ViewRays rays = view_rays(camera, frame.width, frame.height);
  for (int round = 0; round < frame.layers; ++round) {
    const auto which = static_cast<std::size_t>(round % 2);
    stamp(0);
    draw_triangles(rounds_[which], rounds_[1 - which], round, clip);
    stamp(1);
    between(sum.geometry);
    GLuint any = 0;
    gl_.GetQueryObjectuiv(any_, GL_QUERY_RESULT, &any);
    if (any == 0) break;
    ++sum.rounds;

    stamp(0);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, result_.framebuffer);
    gl_.Disable(GL_DEPTH_TEST);
    // What was there before lies in front.
    gl_.Enable(GL_BLEND);
    gl_.BlendFunc(GL_ONE_MINUS_DST_ALPHA, GL_ONE);
    gl_.UseProgram(*program);
    gl_.UniformMatrix4fv(shading::to_clip, 1, GL_FALSE, clip.data());
    gl_.Uniform2f(shading::frame_size, static_cast<GLfloat>(frame.width), static_cast<GLfloat>(frame.height));
    set_uniform(gl_, shading::ray_base, rays.base);
    set_uniform(gl_, shading::ray_right, rays.right);
    set_uniform(gl_, shading::ray_up, rays.up);
    gl_.Uniform1i(shading::lights_in_use, static_cast<GLint>(lights.size()));
    gl_.Uniform1i(shading::forced_level, frame.levels.forced);
    gl_.Uniform1i(shading::blend_levels, frame.levels.blend ? 1 : 0);
    gl_.Uniform1f(shading::max_taps, static_cast<GLfloat>(frame.levels.taps));
    gl_.Uniform1f(shading::level_bias, frame.levels.bias);
    gl_.Uniform1i(shading::linear, frame.levels.linear ? 1 : 0);
    gl_.BindTextureUnit(shading::triangles_unit, rounds_[which].triangles);
    if (core_.needed()) {
      gl_.Uniform1f(shading::ambient, frame.ambient);
      gl_.BindTextureUnit(shading::colours_unit, rounds_[which].colours);
      gl_.BindTextureUnit(shading::pbr_unit, rounds_[which].pbr);
    }
    if (has_shadows) gl_.BindTextureUnit(shading::shadows_unit, frame.shadows->texture());
    gl_.BindVertexArray(empty_array_);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
    stamp(1);
    between(sum.shading);
  }
  gl_.Disable(GL_BLEND);
  if (times != nullptr) *times = sum;
  return check_errors(gl_, "drawing");
}

void ShaderPath::read(std::vector<V4f>& pixels) const {
  pixels.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  gl_.BindFramebuffer(GL_FRAMEBUFFER, result_.framebuffer);
  gl_.NamedFramebufferReadBuffer(result_.framebuffer, GL_COLOR_ATTACHMENT0);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 4);
  gl_.ReadPixels(0, 0, width_, height_, GL_RGBA, GL_FLOAT, pixels.data());
}

}  // namespace selvedge
