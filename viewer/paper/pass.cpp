#include "viewer/paper/pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "viewer/gl/glsl.h"
#include "viewer/gl/objects.h"

namespace selvedge {
namespace {

// Locations in paper_vertex.glsl and paper_fragment.glsl.
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
                                                     const FrameBands& bands) {
  std::unique_ptr<PaperPass> pass(new PaperPass(gl, mesh, materials));
  pass->kinds_ = kinds;
  if (auto good = pass->make_programs(); !good) return tl::unexpected(good.error());
  pass->any_ = pass->objects_.query(GL_ANY_SAMPLES_PASSED);
  pass->index_textures_.resize(fabrics.size());
  pass->level_counts_.resize(fabrics.size(), 1);
  pass->first_levels_.resize(fabrics.size(), 0);
  for (const SurfaceMaterial& kind : kinds.kinds) {
    const std::size_t i = kind.fabric;
    if (pass->index_textures_[i] != 0) continue;
    pass->level_counts_[i] = static_cast<int>(fabrics[i].levels.size());
    pass->first_levels_[i] = fabrics[i].first_level();
    pass->index_textures_[i] = pass->make_index_texture(fabrics[i]);
  }
  pass->upload();
  if (const auto good = pass->resize(bands); !good) return tl::unexpected(good.error());
  return pass;
}

Result<void> PaperPass::make_programs() {
  constexpr std::array<const char*, 3> names{"NORMALS", "TANGENTS", "TEXELS"};
  for (std::size_t target = 0; target < names.size(); ++target) {
    for (std::size_t later = 0; later < 2; ++later) {
      const std::string definitions =
          fmt::format("#define {}\n{}", names[target], later != 0 ? "#define LATER\n" : "");
      const Result<GLuint> program = objects_.program(shader_text(definitions, {glsl::paper_vertex}),
                                                      shader_text(definitions, {glsl::paper_fragment}));
      if (!program) return tl::unexpected(program.error());
      programs_[target][later] = *program;
    }
  }
  return {};
}

GLuint PaperPass::make_index_texture(const Fabric& fabric) {
  const FabricLevel& finest = fabric.levels.front();
  GLuint texture = 0;
  gl_.CreateTextures(GL_TEXTURE_2D, 1, &texture);
  gl_.TextureStorage2D(texture, static_cast<GLsizei>(fabric.levels.size()), GL_RGBA8, finest.width,
                       finest.height);
  gl_.TextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_REPEAT);
  gl_.TextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_REPEAT);
  gl_.TextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
  for (std::size_t k = 0; k < fabric.levels.size(); ++k) {
    const FabricLevel& level = fabric.levels[k];
    std::vector<Coded> places;
    places.reserve(level.texels());
    const auto byte = [](auto number) { return static_cast<std::uint8_t>(number); };
    for (int y = 0; y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x)
        places.push_back({byte(x), byte(y), code_level(static_cast<int>(k)), byte(k)});
    }
    gl_.TextureSubImage2D(texture, static_cast<GLint>(k), 0, 0, level.width, level.height, GL_RGBA,
                          GL_UNSIGNED_BYTE, places.data());
  }
  return objects_.keep_texture(texture);
}

void PaperPass::upload() {
  spans_ = spans_of(mesh_);
  std::vector<Vertex> vertices(mesh_.positions.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const auto& [normal_u, tangent_v] = mesh_.attributes[i];
    vertices[i] = {mesh_.positions[i], V3f(normal_u[0], normal_u[1], normal_u[2]),
                   V4f(tangent_v[0], tangent_v[1], tangent_v[2], 1), V2f(normal_u[3], tangent_v[3])};
  }
  // A vertex belongs to mirrored triangles or to upright ones, never to both (surfaces.h).
  for (const MergedTriangle& t : mesh_.triangles) {
    for (const std::uint32_t corner : t.corners) vertices[corner].tangent.w = t.handedness;
  }
  const GLuint buffer = objects_.buffer(vertices);
  array_ = objects_.vertex_array();
  gl_.VertexArrayElementBuffer(array_, objects_.buffer(corners_of(mesh_)));
  add_attribute(gl_, array_, {0, buffer, 3, offsetof(Vertex, position), sizeof(Vertex)});
  add_attribute(gl_, array_, {1, buffer, 3, offsetof(Vertex, normal), sizeof(Vertex)});
  add_attribute(gl_, array_, {2, buffer, 4, offsetof(Vertex, tangent), sizeof(Vertex)});
  add_attribute(gl_, array_, {3, buffer, 2, offsetof(Vertex, uv), sizeof(Vertex)});
}

Result<void> PaperPass::resize(const FrameBands& bands) {
  if (bands == bands_) return {};
  targets_.clear();
  bands_ = {0, 0, 0};
  for (GLuint& colour : colours_) colour = targets_.plain_texture(GL_RGBA8, bands.width, bands.rows);
  for (std::size_t i = 0; i < framebuffers_.size(); ++i) {
    depths_[i] = targets_.plain_texture(GL_DEPTH_COMPONENT32F, bands.width, bands.rows);
    const Result<GLuint> made = targets_.framebuffer(colours_, GL_DEPTH_ATTACHMENT, depths_[i]);
    if (!made) return tl::unexpected(made.error());
    framebuffers_[i] = *made;
  }
  bands_ = bands;
  return check_errors(gl_, "frame buffer");
}

void PaperPass::draw_cloth(Target target, int round, float bias) {
  const GLenum attachment = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(target);
  gl_.NamedFramebufferDrawBuffers(framebuffers_[drawn_into_], 1, &attachment);
  gl_.UseProgram(programs_[target][round == 0 ? 0 : 1]);
  gl_.UniformMatrix4fv(to_clip, 1, GL_FALSE, clip_.data());
  if (target == texels) gl_.Uniform1f(level_bias, bias);
  for (const TriangleSpan& span : spans_) {
    const SurfaceMaterial& material = materials_[span.surface];
    gl_.Uniform1i(culls_back, material.culls_back ? 1 : 0);
    if (target == normals) gl_.Uniform1i(kind, code_kind(kinds_.of_surfaces[span.surface], false));
    if (target == texels) gl_.BindTextureUnit(index_unit, index_textures_[material.fabric]);
    draw_triangles(gl_, span.first, span.end);
  }
}

Result<bool> PaperPass::draw(const M44d& clip, int first_row, int round, const LevelOptions& levels) {
  drawn_into_ = round % 2;
  const GLuint target = framebuffers_[drawn_into_];
  clip_ = gl_matrix(clip);
  const auto filter_levels = [&](GLint filter) {
    for (std::size_t i = 0; i < index_textures_.size(); ++i) {
      if (index_textures_[i] == 0) continue;
      const int last = level_counts_[i] - 1;
      // Levels count in the whole fabric; this one may be partial.
      const int forced = levels.forced < 0 ? -1 : std::clamp(levels.forced - first_levels_[i], 0, last);
      gl_.TextureParameteri(index_textures_[i], GL_TEXTURE_BASE_LEVEL, std::max(forced, 0));
      gl_.TextureParameteri(index_textures_[i], GL_TEXTURE_MAX_LEVEL, forced >= 0 ? forced : last);
      gl_.TextureParameteri(index_textures_[i], GL_TEXTURE_MIN_FILTER, filter);
    }
  };
  gl_.BindFramebuffer(GL_FRAMEBUFFER, target);
  // Dithering is on by default and would change coded values.
  gl_.Disable(GL_DITHER);
  gl_.Disable(GL_BLEND);
  gl_.Disable(GL_CULL_FACE);
  gl_.Disable(GL_STENCIL_TEST);
  gl_.Enable(GL_DEPTH_TEST);
  // The viewport is the whole frame, shifted, so that a band covers the same pixels as an undivided frame.
  gl_.Viewport(0, -first_row, bands_.width, bands_.height);
  gl_.BindVertexArray(array_);
  gl_.BindTextureUnit(depth_unit, depths_[1 - drawn_into_]);

  constexpr GLenum first_attachment = GL_COLOR_ATTACHMENT0;
  constexpr std::array<GLfloat, 4> nothing{0, 0, 0, 0};
  constexpr GLfloat farthest = 1;
  // Only the alpha of normals tells whether a pixel is empty.
  gl_.NamedFramebufferDrawBuffers(target, 1, &first_attachment);
  gl_.ClearNamedFramebufferfv(target, GL_COLOR, 0, nothing.data());
  gl_.ClearNamedFramebufferfv(target, GL_DEPTH, 0, &farthest);
  // Of surfaces at equal depth, the last one wins in all passes.
  gl_.DepthFunc(GL_LEQUAL);
  gl_.BeginQuery(GL_ANY_SAMPLES_PASSED, any_);
  draw_cloth(normals, round, 0);
  gl_.EndQuery(GL_ANY_SAMPLES_PASSED);
  gl_.DepthFunc(GL_EQUAL);
  draw_cloth(tangents, round, 0);
  filter_levels(GL_NEAREST_MIPMAP_NEAREST);
  // With a bias of half a level, red and green belong to the finer of the two levels between which blue lies.
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
  const std::size_t count = bands_.width * bands_.rows;
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffers_[drawn_into_]);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 4);
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, 0);
  const auto read = [&](Target target, std::vector<Coded>& to) {
    to.resize(count);
    gl_.NamedFramebufferReadBuffer(framebuffers_[drawn_into_],
                                   GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(target));
    gl_.ReadPixels(0, 0, bands_.width, bands_.rows, GL_RGBA, GL_UNSIGNED_BYTE, to.data());
  };
  read(normals, frames.normals);
  read(tangents, frames.tangents);
  read(texels, frames.texels);
}

}  // namespace selvedge
