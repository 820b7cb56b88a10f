#include "viewer/index_pass.h"

#include <fmt/format.h>

#include <cstddef>

#include "viewer/gl_objects.h"

namespace selvedge {
namespace {

// Locations of the uniforms and units of the textures, as written in shaders.h.
enum Uniform : GLint {
  to_clip,
  surface_number,
  has_fabric,
  level_mode,
  last_level,
  layer_number,
  base_color,
  has_texture,
  opaque_from,
  keeps_opacity,
};
enum Unit : GLuint { index_unit, level_unit, base_color_unit, depth_unit, finished_unit };

constexpr std::array<GLenum, 4> colour_formats{GL_RGBA32F, GL_RGBA32F, GL_RGBA16UI, GL_RGBA16UI};

Result<void> check_errors(const GlFunctions& gl, const char* place) {
  const GLenum error = gl.GetError();
  if (error == GL_NO_ERROR) return {};
  while (gl.GetError() != GL_NO_ERROR) {
  }
  return fail(Code::graphics_unavailable, "", place, fmt::format("OpenGL reports error {:#06x}", error));
}

}  // namespace

Result<std::unique_ptr<IndexPass>> IndexPass::create(const GlFunctions& gl, std::span<const Surface> surfaces,
                                                     std::span<const SurfaceLook> looks,
                                                     std::span<const Fabric> fabrics,
                                                     std::span<const Image> images,
                                                     const IndexPassOptions& options) {
  std::unique_ptr<IndexPass> pass(new IndexPass(gl, options));
  const Result<GLuint> program = make_index_program(gl);
  if (!program) return tl::unexpected(program.error());
  pass->program_ = *program;
  gl.CreateQueries(GL_ANY_SAMPLES_PASSED, 1, &pass->query_);
  for (const Fabric& fabric : fabrics) {
    pass->fabrics_.push_back({make_index_texture(gl, fabric), make_level_texture(gl, fabric),
                              static_cast<int>(fabric.levels.size()) - 1});
  }
  for (const Image& image : images) pass->images_.push_back(make_colour_texture(gl, image));
  for (std::size_t i = 0; i < surfaces.size(); ++i) pass->upload(surfaces[i], looks[i]);
  if (const auto good = pass->make_targets(); !good) return tl::unexpected(good.error());
  if (const auto good = check_errors(gl, "upload"); !good) return tl::unexpected(good.error());
  return pass;
}

IndexPass::~IndexPass() {
  const auto delete_textures = [&](std::span<const GLuint> names) {
    gl_.DeleteTextures(static_cast<GLsizei>(names.size()), names.data());
  };
  for (const Mesh& mesh : meshes_) gl_.DeleteVertexArrays(1, &mesh.array);
  gl_.DeleteBuffers(static_cast<GLsizei>(buffers_.size()), buffers_.data());
  for (const FabricTextures& fabric : fabrics_) delete_textures(std::array{fabric.index, fabric.level});
  delete_textures(images_);
  delete_textures(colours_);
  delete_textures(depths_);
  delete_textures(std::array{finished_});
  gl_.DeleteFramebuffers(2, framebuffers_.data());
  gl_.DeleteQueries(1, &query_);
  gl_.DeleteProgram(program_);
}

void IndexPass::upload(const Surface& surface, const SurfaceLook& look) {
  std::array<GLuint, 2> buffer{};
  gl_.CreateBuffers(2, buffer.data());
  buffers_.insert(buffers_.end(), buffer.begin(), buffer.end());
  gl_.NamedBufferStorage(buffer[0], static_cast<GLsizeiptr>(surface.vertices.size() * sizeof(SurfaceVertex)),
                         surface.vertices.data(), 0);
  gl_.NamedBufferStorage(buffer[1], static_cast<GLsizeiptr>(surface.indices.size() * sizeof(std::uint32_t)),
                         surface.indices.data(), 0);
  Mesh mesh;
  mesh.count = static_cast<GLsizei>(surface.indices.size());
  mesh.look = look;
  gl_.CreateVertexArrays(1, &mesh.array);
  gl_.VertexArrayVertexBuffer(mesh.array, 0, buffer[0], 0, sizeof(SurfaceVertex));
  gl_.VertexArrayElementBuffer(mesh.array, buffer[1]);
  const auto attribute = [&](GLuint location, GLint components, std::size_t offset) {
    gl_.EnableVertexArrayAttrib(mesh.array, location);
    gl_.VertexArrayAttribFormat(mesh.array, location, components, GL_FLOAT, GL_FALSE,
                                static_cast<GLuint>(offset));
    gl_.VertexArrayAttribBinding(mesh.array, location, 0);
  };
  attribute(0, 3, offsetof(SurfaceVertex, position));
  attribute(1, 3, offsetof(SurfaceVertex, normal));
  attribute(2, 4, offsetof(SurfaceVertex, tangent));
  attribute(3, 2, offsetof(SurfaceVertex, uv));
  meshes_.push_back(mesh);
}

Result<void> IndexPass::make_targets() {
  for (std::size_t i = 0; i < colours_.size(); ++i)
    colours_[i] = make_plain_texture(gl_, colour_formats[i], options_.width, options_.band_rows);
  finished_ = make_plain_texture(gl_, GL_R8UI, options_.width, options_.band_rows);
  constexpr std::array<GLenum, 4> attachments{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1,
                                              GL_COLOR_ATTACHMENT2, GL_COLOR_ATTACHMENT3};
  for (std::size_t i = 0; i < 2; ++i) {
    depths_[i] = make_plain_texture(gl_, GL_DEPTH_COMPONENT32F, options_.width, options_.band_rows);
    gl_.CreateFramebuffers(1, &framebuffers_[i]);
    for (std::size_t k = 0; k < 4; ++k)
      gl_.NamedFramebufferTexture(framebuffers_[i], attachments[k], colours_[k], 0);
    gl_.NamedFramebufferTexture(framebuffers_[i], GL_DEPTH_ATTACHMENT, depths_[i], 0);
    gl_.NamedFramebufferDrawBuffers(framebuffers_[i], 4, attachments.data());
    if (gl_.CheckNamedFramebufferStatus(framebuffers_[i], GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      return fail(Code::graphics_unavailable, "", "frame buffer", "OpenGL refuses the index buffers");
  }
  return {};
}

void IndexPass::draw_mesh(std::size_t i) {
  const Mesh& mesh = meshes_[i];
  const SurfaceLook& look = mesh.look;
  gl_.Uniform1i(surface_number, static_cast<GLint>(i + 1));
  gl_.Uniform1i(has_fabric, look.fabric >= 0 ? 1 : 0);
  if (look.fabric >= 0) {
    const FabricTextures& textures = fabrics_[static_cast<std::size_t>(look.fabric)];
    gl_.Uniform1i(last_level, textures.last_level);
    gl_.BindTextureUnit(index_unit, textures.index);
    gl_.BindTextureUnit(level_unit, textures.level);
  }
  gl_.Uniform4f(base_color, look.base_color.x, look.base_color.y, look.base_color.z, look.base_color.w);
  gl_.Uniform1i(has_texture, look.image >= 0 ? 1 : 0);
  if (look.image >= 0) gl_.BindTextureUnit(base_color_unit, images_[static_cast<std::size_t>(look.image)]);
  gl_.Uniform1f(opaque_from, look.opaque_from);
  gl_.Uniform1i(keeps_opacity, look.keeps_opacity ? 1 : 0);
  if (look.culls_back)
    gl_.Enable(GL_CULL_FACE);
  else
    gl_.Disable(GL_CULL_FACE);
  gl_.BindVertexArray(mesh.array);
  gl_.DrawElements(GL_TRIANGLES, mesh.count, GL_UNSIGNED_INT, nullptr);
}

Result<bool> IndexPass::draw(const M44d& clip, int first_row, int layer,
                             std::span<const std::uint8_t> finished) {
  drawn_into_ = static_cast<std::size_t>(layer % 2);
  const GLuint target = framebuffers_[drawn_into_];
  constexpr std::array<GLuint, 4> nothing{0, 0, 0, 0};
  constexpr GLfloat farthest = 1;
  // The marks alone say whether a pixel is empty.
  gl_.ClearNamedFramebufferuiv(target, GL_COLOR, 3, nothing.data());
  gl_.ClearNamedFramebufferfv(target, GL_DEPTH, 0, &farthest);

  gl_.BindFramebuffer(GL_FRAMEBUFFER, target);
  // On by default, and it would change coded values.
  gl_.Disable(GL_DITHER);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_LESS);
  gl_.CullFace(GL_BACK);
  // The viewport is that of the whole frame, moved: a band covers the pixels that it would without bands.
  gl_.Viewport(0, -first_row, options_.width, options_.height);
  gl_.UseProgram(program_);
  std::array<GLfloat, 16> matrix{};
  for (std::size_t i = 0; i < 16; ++i) matrix[i] = static_cast<GLfloat>(clip[static_cast<int>(i / 4)][i % 4]);
  // Imath's row vectors and row-major memory are OpenGL's column vectors and column-major memory.
  gl_.UniformMatrix4fv(to_clip, 1, GL_FALSE, matrix.data());
  const int unforced = options_.blend_levels ? -2 : -1;
  gl_.Uniform1i(level_mode, options_.forced_level >= 0 ? options_.forced_level : unforced);
  gl_.Uniform1i(layer_number, layer);
  if (layer > 0) {
    gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl_.TextureSubImage2D(finished_, 0, 0, 0, options_.width, options_.band_rows, GL_RED_INTEGER,
                          GL_UNSIGNED_BYTE, finished.data());
  }
  gl_.BindTextureUnit(depth_unit, depths_[1 - drawn_into_]);
  gl_.BindTextureUnit(finished_unit, finished_);

  gl_.BeginQuery(GL_ANY_SAMPLES_PASSED, query_);
  for (std::size_t i = 0; i < meshes_.size(); ++i) draw_mesh(i);
  gl_.EndQuery(GL_ANY_SAMPLES_PASSED);
  gl_.Finish();
  GLuint any = 0;
  gl_.GetQueryObjectuiv(query_, GL_QUERY_RESULT, &any);
  if (const auto good = check_errors(gl_, "drawing"); !good) return tl::unexpected(good.error());
  return any != 0;
}

void IndexPass::read(PixelLayer& layer) const {
  const std::size_t count =
      static_cast<std::size_t>(options_.width) * static_cast<std::size_t>(options_.band_rows);
  layer.width = options_.width;
  layer.rows = options_.band_rows;
  layer.normal.resize(count);
  layer.surface.resize(count);
  layer.texels.resize(count);
  layer.marks.resize(count);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffers_[drawn_into_]);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 4);
  const auto read = [&](GLenum attachment, GLenum format, GLenum type, void* data) {
    gl_.NamedFramebufferReadBuffer(framebuffers_[drawn_into_], attachment);
    gl_.ReadPixels(0, 0, options_.width, options_.band_rows, format, type, data);
  };
  read(GL_COLOR_ATTACHMENT0, GL_RGBA, GL_FLOAT, layer.normal.data());
  read(GL_COLOR_ATTACHMENT1, GL_RGBA, GL_FLOAT, layer.surface.data());
  read(GL_COLOR_ATTACHMENT2, GL_RGBA_INTEGER, GL_UNSIGNED_SHORT, layer.texels.data());
  read(GL_COLOR_ATTACHMENT3, GL_RGBA_INTEGER, GL_UNSIGNED_SHORT, layer.marks.data());
}

}  // namespace selvedge
