#include "viewer/paper/pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "viewer/gl/objects.h"
#include "viewer/glsl.h"

namespace selvedge {
namespace {

// As written in paper_vertex.glsl and paper_fragment.glsl.
enum Uniform : GLint { to_clip, culls_back, kind, level_bias };
enum Unit : GLuint { index_unit, depth_unit };

struct Vertex {
  V3f position;
  V3f normal;
  V4f tangent;  ///< w: handedness
  V2f uv;
};

}  // namespace

Result<std::unique_ptr<PaperPass>> PaperPass::create(const GlFunctions& gl, const MergedSurfaces& mesh,
                                                     std::span<const SurfaceMaterial> materials,
                                                     const PaperKinds& kinds, std::span<const Fabric> fabrics,
                                                     const PaperPassOptions& options) {
  std::unique_ptr<PaperPass> pass(new PaperPass(gl, mesh, options));
  pass->kinds_ = kinds;
  if (auto good = pass->make_programs(); !good) return tl::unexpected(good.error());
  gl.CreateQueries(GL_ANY_SAMPLES_PASSED, 1, &pass->any_);
  pass->index_textures_.resize(fabrics.size());
  pass->level_counts_.resize(fabrics.size(), 1);
  pass->first_levels_.resize(fabrics.size(), 0);
  for (const PaperKind& of : kinds.kinds) {
    const auto i = static_cast<std::size_t>(of.fabric);
    if (pass->index_textures_[i] != 0) continue;
    pass->level_counts_[i] = static_cast<int>(fabrics[i].levels.size());
    pass->first_levels_[i] = first_level(fabrics[i]);
    pass->index_textures_[i] = make_index_texture(gl, fabrics[i]);
  }
  pass->upload(materials, kinds);
  if (const auto good = pass->make_targets(); !good) return tl::unexpected(good.error());
  if (const auto good = check_errors(gl, "upload"); !good) return tl::unexpected(good.error());
  return pass;
}

PaperPass::~PaperPass() {
  release_targets();
  gl_.DeleteTextures(static_cast<GLsizei>(index_textures_.size()), index_textures_.data());
  gl_.DeleteVertexArrays(1, &array_);
  const std::array buffers{vertices_, indices_};
  gl_.DeleteBuffers(static_cast<GLsizei>(buffers.size()), buffers.data());
  gl_.DeleteQueries(1, &any_);
  for (const auto& pair : programs_) {
    for (const GLuint program : pair) gl_.DeleteProgram(program);
  }
}

Result<void> PaperPass::make_programs() {
  constexpr std::array<const char*, 3> names{"NORMALS", "TANGENTS", "TEXELS"};
  for (std::size_t target = 0; target < names.size(); ++target) {
    for (std::size_t later = 0; later < 2; ++later) {
      const std::string definitions =
          fmt::format("#define {}\n{}", names[target], later != 0 ? "#define LATER\n" : "");
      const Result<GLuint> program = make_program(gl_, shader_text(definitions, {glsl::paper_vertex}),
                                                  shader_text(definitions, {glsl::paper_fragment}));
      if (!program) return tl::unexpected(program.error());
      programs_[target][later] = *program;
    }
  }
  return {};
}

GLuint PaperPass::make_index_texture(const GlFunctions& gl, const Fabric& fabric) {
  const FabricLevel& finest = fabric.levels.front();
  GLuint texture = 0;
  gl.CreateTextures(GL_TEXTURE_2D, 1, &texture);
  gl.TextureStorage2D(texture, static_cast<GLsizei>(fabric.levels.size()), GL_RGBA8, finest.width,
                      finest.height);
  gl.TextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_REPEAT);
  gl.TextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_REPEAT);
  gl.TextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
  for (std::size_t k = 0; k < fabric.levels.size(); ++k) {
    const FabricLevel& level = fabric.levels[k];
    std::vector<Coded> places;
    places.reserve(level.texels());
    const auto number = static_cast<int>(k);
    for (int y = 0; y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x) {
        places.push_back({static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), code_level(number),
                          static_cast<std::uint8_t>(number)});
      }
    }
    gl.TextureSubImage2D(texture, static_cast<GLint>(k), 0, 0, level.width, level.height, GL_RGBA,
                         GL_UNSIGNED_BYTE, places.data());
  }
  return texture;
}

void PaperPass::upload(std::span<const SurfaceMaterial> materials, const PaperKinds& kinds) {
  std::vector<Vertex> vertices(mesh_.positions.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const auto& [normal_u, tangent_v] = mesh_.attributes[i];
    vertices[i] = {mesh_.positions[i], V3f(normal_u[0], normal_u[1], normal_u[2]),
                   V4f(tangent_v[0], tangent_v[1], tangent_v[2], 1), V2f(normal_u[3], tangent_v[3])};
  }
  std::vector<std::uint32_t> indices;
  indices.reserve(mesh_.triangles.size() * 3);
  for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
    const MergedTriangle& t = mesh_.triangles[i];
    if (i == 0 || mesh_.triangles[i - 1].surface != t.surface)
      spans_.push_back({kinds.of_surfaces[t.surface], materials[t.surface].culls_back, i, i});
    ++spans_.back().end;
    // A vertex belongs to mirrored triangles or to upright ones, never to both (geometry.h).
    for (const std::uint32_t corner : t.corners) vertices[corner].tangent.w = t.handedness;
    indices.insert(indices.end(), t.corners.begin(), t.corners.end());
  }
  const auto make = [&](GLuint& buffer, std::size_t bytes, const void* data) {
    gl_.CreateBuffers(1, &buffer);
    gl_.NamedBufferStorage(buffer, static_cast<GLsizeiptr>(bytes), data, 0);
  };
  make(vertices_, vertices.size() * sizeof(Vertex), vertices.data());
  make(indices_, indices.size() * sizeof(std::uint32_t), indices.data());
  gl_.CreateVertexArrays(1, &array_);
  gl_.VertexArrayVertexBuffer(array_, 0, vertices_, 0, sizeof(Vertex));
  gl_.VertexArrayElementBuffer(array_, indices_);
  const auto attribute = [&](GLuint location, GLint components, std::size_t offset) {
    gl_.EnableVertexArrayAttrib(array_, location);
    gl_.VertexArrayAttribFormat(array_, location, components, GL_FLOAT, GL_FALSE,
                                static_cast<GLuint>(offset));
    gl_.VertexArrayAttribBinding(array_, location, 0);
  };
  attribute(0, 3, offsetof(Vertex, position));
  attribute(1, 3, offsetof(Vertex, normal));
  attribute(2, 4, offsetof(Vertex, tangent));
  attribute(3, 2, offsetof(Vertex, uv));
}

Result<void> PaperPass::make_targets() {
  for (GLuint& colour : colours_)
    colour = make_plain_texture(gl_, GL_RGBA8, options_.width, options_.band_rows);
  for (std::size_t i = 0; i < framebuffers_.size(); ++i) {
    depths_[i] = make_plain_texture(gl_, GL_DEPTH_COMPONENT32F, options_.width, options_.band_rows);
    gl_.CreateFramebuffers(1, &framebuffers_[i]);
    for (std::size_t k = 0; k < colours_.size(); ++k)
      gl_.NamedFramebufferTexture(framebuffers_[i], GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(k),
                                  colours_[k], 0);
    gl_.NamedFramebufferTexture(framebuffers_[i], GL_DEPTH_ATTACHMENT, depths_[i], 0);
    if (gl_.CheckNamedFramebufferStatus(framebuffers_[i], GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      return fail(Code::graphics_unavailable, "", "frame buffer", "OpenGL refuses the paper's frames");
  }
  return {};
}

void PaperPass::release_targets() {
  gl_.DeleteFramebuffers(static_cast<GLsizei>(framebuffers_.size()), framebuffers_.data());
  gl_.DeleteTextures(static_cast<GLsizei>(colours_.size()), colours_.data());
  gl_.DeleteTextures(static_cast<GLsizei>(depths_.size()), depths_.data());
  framebuffers_ = {};
  colours_ = {};
  depths_ = {};
}

Result<void> PaperPass::resize(const PaperPassOptions& options) {
  release_targets();
  options_ = options;
  if (auto good = make_targets(); !good) return good;
  return check_errors(gl_, "frame buffer");
}

void PaperPass::draw_cloth(Target target, int round, float bias) {
  const GLenum attachment = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(target);
  gl_.NamedFramebufferDrawBuffers(framebuffers_[drawn_into_], 1, &attachment);
  gl_.UseProgram(programs_[target][round == 0 ? 0 : 1]);
  gl_.UniformMatrix4fv(to_clip, 1, GL_FALSE, clip_.data());
  if (target == texels) gl_.Uniform1f(level_bias, bias);
  for (const Span& span : spans_) {
    const int fabric = kinds_.kinds[span.kind].fabric;
    gl_.Uniform1i(culls_back, span.culls_back ? 1 : 0);
    if (target == normals) gl_.Uniform1i(kind, code_kind(span.kind, false));
    if (target == texels) gl_.BindTextureUnit(index_unit, index_textures_[fabric]);
    gl_.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * (span.end - span.first)), GL_UNSIGNED_INT,
                     reinterpret_cast<const void*>(3 * span.first * sizeof(std::uint32_t)));
  }
}

Result<bool> PaperPass::draw(const M44d& clip, int first_row, int round, const LevelOptions& levels) {
  drawn_into_ = static_cast<std::size_t>(round % 2);
  const GLuint target = framebuffers_[drawn_into_];
  // Imath's row vectors and row-major memory are OpenGL's column vectors and column-major memory.
  for (std::size_t i = 0; i < 16; ++i) clip_[i] = static_cast<GLfloat>(clip[static_cast<int>(i / 4)][i % 4]);
  const auto filter_levels = [&](GLint filter) {
    for (std::size_t i = 0; i < index_textures_.size(); ++i) {
      if (index_textures_[i] == 0) continue;
      const int last = level_counts_[i] - 1;
      // Counted in the whole fabric, of which this may be a part.
      const int forced = levels.forced < 0 ? -1 : std::clamp(levels.forced - first_levels_[i], 0, last);
      gl_.TextureParameteri(index_textures_[i], GL_TEXTURE_BASE_LEVEL, std::max(forced, 0));
      gl_.TextureParameteri(index_textures_[i], GL_TEXTURE_MAX_LEVEL, forced >= 0 ? forced : last);
      gl_.TextureParameteri(index_textures_[i], GL_TEXTURE_MIN_FILTER, filter);
    }
  };
  gl_.BindFramebuffer(GL_FRAMEBUFFER, target);
  // On by default, and it would change coded values.
  gl_.Disable(GL_DITHER);
  gl_.Disable(GL_BLEND);
  gl_.Disable(GL_CULL_FACE);
  gl_.Disable(GL_STENCIL_TEST);
  gl_.Enable(GL_DEPTH_TEST);
  // The viewport is that of the whole frame, moved: a band covers the pixels that it would without bands.
  gl_.Viewport(0, -first_row, options_.width, options_.height);
  gl_.BindVertexArray(array_);
  gl_.BindTextureUnit(depth_unit, depths_[1 - drawn_into_]);

  constexpr GLenum first_attachment = GL_COLOR_ATTACHMENT0;
  constexpr std::array<GLfloat, 4> nothing{0, 0, 0, 0};
  constexpr GLfloat farthest = 1;
  // The alpha of the normals alone says whether a pixel is empty.
  gl_.NamedFramebufferDrawBuffers(target, 1, &first_attachment);
  gl_.ClearNamedFramebufferfv(target, GL_COLOR, 0, nothing.data());
  gl_.ClearNamedFramebufferfv(target, GL_DEPTH, 0, &farthest);
  // Of surfaces at one depth the last counts in all passes.
  gl_.DepthFunc(GL_LEQUAL);
  gl_.BeginQuery(GL_ANY_SAMPLES_PASSED, any_);
  draw_cloth(normals, round, 0);
  gl_.EndQuery(GL_ANY_SAMPLES_PASSED);
  gl_.DepthFunc(GL_EQUAL);
  draw_cloth(tangents, round, 0);
  filter_levels(GL_NEAREST_MIPMAP_NEAREST);
  // Half a level finer, red and green are places in the finer of the two levels that blue is to lie between.
  draw_cloth(texels, round, levels.blend ? -0.5F : 0.0F);
  if (levels.blend) {
    filter_levels(GL_NEAREST_MIPMAP_LINEAR);
    gl_.ColorMask(GL_FALSE, GL_FALSE, GL_TRUE, GL_FALSE);
    draw_cloth(texels, round, 0);
    gl_.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  }
  gl_.Finish();
  GLuint any = 0;
  gl_.GetQueryObjectuiv(any_, GL_QUERY_RESULT, &any);
  if (const auto good = check_errors(gl_, "drawing"); !good) return tl::unexpected(good.error());
  return any != 0;
}

void PaperPass::read(PaperFrames& frames) const {
  const std::size_t count =
      static_cast<std::size_t>(options_.width) * static_cast<std::size_t>(options_.band_rows);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffers_[drawn_into_]);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 4);
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, 0);
  const auto read = [&](Target target, std::vector<Coded>& to) {
    to.resize(count);
    gl_.NamedFramebufferReadBuffer(framebuffers_[drawn_into_],
                                   GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(target));
    gl_.ReadPixels(0, 0, options_.width, options_.band_rows, GL_RGBA, GL_UNSIGNED_BYTE, to.data());
  };
  read(normals, frames.normals);
  read(tangents, frames.tangents);
  read(texels, frames.texels);
}

}  // namespace selvedge
