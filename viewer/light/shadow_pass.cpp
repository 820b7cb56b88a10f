#include "viewer/light/shadow_pass.h"

#include <algorithm>

#include "viewer/gl/glsl.h"

namespace selvedge {
namespace {

// Locations in shadow_vertex.glsl.
enum Uniform : GLint { row_x, row_y, row_z, row_w, map_size };

}  // namespace

Result<std::unique_ptr<ShadowPass>> ShadowPass::create(const GlFunctions& gl, const MergedSurfaces& mesh,
                                                       const Materials& materials) {
  std::unique_ptr<ShadowPass> pass(new ShadowPass(gl));
  const Result<GLuint> program = pass->objects_.program(shader_text("", {glsl::shadow_vertex}),
                                                        shader_text("", {glsl::shadow_fragment}));
  if (!program) return tl::unexpected(program.error());
  pass->program_ = *program;
  std::vector<std::uint32_t> indices;
  for (const MergedTriangle& triangle : mesh.triangles) {
    const SurfaceMaterial& material = materials.surfaces[triangle.surface];
    if (material.fabric < 0 && material.keeps_opacity) continue;
    indices.insert(indices.end(), triangle.corners.begin(), triangle.corners.end());
  }
  pass->triangles_ = indices.size() / 3;
  pass->array_ = pass->objects_.vertex_array();
  add_attribute(gl, pass->array_, {0, pass->objects_.buffer(mesh.positions), 3, 0, sizeof(V3f)});
  gl.VertexArrayElementBuffer(pass->array_, pass->objects_.buffer(indices));
  pass->framebuffer_ = pass->objects_.framebuffer();
  gl.NamedFramebufferDrawBuffers(pass->framebuffer_, 0, nullptr);
  gl.NamedFramebufferReadBuffer(pass->framebuffer_, GL_NONE);
  if (const auto good = check_errors(gl, "shadow maps"); !good) return tl::unexpected(good.error());
  return pass;
}

Result<void> ShadowPass::draw(std::span<const ShadowView> views) {
  if (std::equal(views.begin(), views.end(), views_.begin(), views_.end())) return {};
  maps_objects_.clear();
  texture_ = buffer_ = 0;
  views_.clear();
  maps_.clear();
  if (views.empty()) return {};
  const int size = views.front().size;
  gl_.CreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture_);
  maps_objects_.keep_texture(texture_);
  gl_.TextureStorage3D(texture_, 1, GL_DEPTH_COMPONENT32F, size, size, static_cast<GLsizei>(views.size()));
  gl_.TextureParameteri(texture_, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl_.TextureParameteri(texture_, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  gl_.Disable(GL_CULL_FACE);
  gl_.Disable(GL_BLEND);
  gl_.Disable(GL_STENCIL_TEST);
  gl_.Enable(GL_DEPTH_TEST);
  // Surfaces in front of a spot's near plane cast shadows, too.
  gl_.Enable(GL_DEPTH_CLAMP);
  gl_.DepthFunc(GL_LESS);
  gl_.Viewport(0, 0, size, size);
  gl_.UseProgram(program_);
  gl_.BindVertexArray(array_);
  std::vector<V4f> words;
  constexpr GLfloat farthest = 1;
  for (std::size_t i = 0; i < views.size(); ++i) {
    gl_.NamedFramebufferTextureLayer(framebuffer_, GL_DEPTH_ATTACHMENT, texture_, 0, static_cast<GLint>(i));
    if (gl_.CheckNamedFramebufferStatus(framebuffer_, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      return fail(Code::graphics_unavailable, "", "shadow map", "OpenGL refuses it");
    gl_.ClearNamedFramebufferfv(framebuffer_, GL_DEPTH, 0, &farthest);
    for (std::size_t k = 0; k < 4; ++k) {
      const V4f& row = views[i].rows[k];
      gl_.Uniform4f(static_cast<GLint>(k), row.x, row.y, row.z, row.w);
      words.push_back(row);
    }
    words.emplace_back(static_cast<float>(size), views[i].texel, 0.0F, 0.0F);
    gl_.Uniform1f(map_size, static_cast<GLfloat>(size));
    draw_triangles(gl_, 0, triangles_);
  }
  gl_.Disable(GL_DEPTH_CLAMP);
  buffer_ = maps_objects_.buffer(words);
  views_.assign(views.begin(), views.end());
  return check_errors(gl_, "shadow maps");
}

std::span<const ShadowMap> ShadowPass::read() {
  if (maps_.size() == views_.size()) return maps_;
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 4);
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, 0);
  maps_.reserve(views_.size());
  for (std::size_t i = 0; i < views_.size(); ++i) {
    gl_.NamedFramebufferTextureLayer(framebuffer_, GL_DEPTH_ATTACHMENT, texture_, 0, static_cast<GLint>(i));
    ShadowMap map{views_[i], {}};
    const std::size_t size = map.view.size;
    map.depths.resize(size * size);
    gl_.ReadPixels(0, 0, map.view.size, map.view.size, GL_DEPTH_COMPONENT, GL_FLOAT, map.depths.data());
    maps_.push_back(std::move(map));
  }
  return maps_;
}

}  // namespace selvedge
