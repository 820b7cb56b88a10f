#include "viewer/light/shadow_pass.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "format/base/guard.h"
#include "format/gltf/memory.h"
#include "viewer/gl/glsl.h"

namespace selvedge {
namespace {

// Locations in shadow_vertex.glsl and shadow_fragment.glsl.
enum ShadowUniform : GLint { row_x, row_y, row_z, row_w, map_size, cutoff };
constexpr GLuint mask_unit = 0;

/// Halvings of a mask.
int halvings_of(const MaterialPicture& picture) {
  constexpr int largest = 1024;
  int halvings = 0;
  while (std::max(picture.size.x, picture.size.y) >> halvings > largest) ++halvings;
  return halvings;
}

/// Masks of one kind share a texture: its picture and how it goes on.
using MaskKind = std::tuple<int, Wrap, Wrap>;
MaskKind kind_of(const MaterialTexture& mask) { return {mask.image, mask.wrap_u, mask.wrap_v}; }

}  // namespace

bool has_mask(const Materials& materials, std::size_t surface) {
  const int image = materials.pbr[surface].metallic_roughness.image;
  return materials.surfaces[surface].fabric >= 0 && image >= 0 && materials.pictures[image].bytes;
}

Result<Image> decode_mask(const MaterialPicture& picture) {
  return decode_image(*picture.bytes, picture.name, picture.transfer, {}, halvings_of(picture));
}

ShadowPass::ShadowPass(const GlFunctions& gl, const MergedSurfaces& mesh, const Materials& materials)
    : gl_(gl),
      objects_(gl),
      maps_objects_(gl),
      program_(shadow_program("")),
      array_(objects_.vertex_array()) {
  std::vector<std::uint32_t> indices;
  for (const MergedTriangle& triangle : mesh.triangles) {
    const SurfaceMaterial& material = materials.surfaces[triangle.surface];
    if (material.fabric < 0 && material.keeps_opacity) continue;
    if (has_mask(materials, triangle.surface)) continue;
    indices.insert(indices.end(), triangle.corners.begin(), triangle.corners.end());
  }
  triangles_ = indices.size() / 3;
  add_masks(mesh, materials, indices);
  add_attribute(gl, array_, 0, objects_.buffer(mesh.positions), 3, 0, sizeof(V3f));
  gl.VertexArrayElementBuffer(array_, objects_.buffer(indices));
  framebuffer_ = objects_.framebuffer();
  gl.NamedFramebufferDrawBuffers(framebuffer_, 0, nullptr);
  gl.NamedFramebufferReadBuffer(framebuffer_, GL_NONE);
  check_errors(gl, "shadow maps");
}

GLuint ShadowPass::shadow_program(const char* define) {
  return objects_.program(shader_text(define, {glsl::shadow_vertex}),
                          shader_text(define, {glsl::shadow_fragment}));
}

std::uint64_t ShadowPass::mask_bytes(const Materials& materials) {
  std::uint64_t pixels = 0;
  std::set<MaskKind> known;
  for (std::size_t i = 0; i < materials.surfaces.size(); ++i) {
    if (!has_mask(materials, i) || !known.insert(kind_of(materials.pbr[i].metallic_roughness)).second)
      continue;
    const MaterialPicture& picture = materials.pictures[materials.pbr[i].metallic_roughness.image];
    pixels += picture.pixels(halvings_of(picture));
  }
  return pixels * bytes_per::pixel;
}

/// The triangles of surfaces with a mask, and what their drawing needs.
void ShadowPass::add_masks(const MergedSurfaces& mesh, const Materials& materials,
                           std::vector<std::uint32_t>& indices) {
  std::vector<V2f> uvs;
  std::map<MaskKind, GLuint> textures;
  for (const TriangleSpan& span : spans_of(mesh)) {
    if (!has_mask(materials, span.surface)) continue;
    const MaterialTexture& mask = materials.pbr[span.surface].metallic_roughness;
    const MaterialPicture& picture = materials.pictures[mask.image];
    const auto [texture, fresh] = textures.try_emplace(kind_of(mask), 0);
    if (fresh) {
      const Result<Image> image = decode_mask(picture);
      // Without its picture, of which frames tell, a surface is whole.
      texture->second =
          objects_.keep_texture(make_colour_texture(gl_, image ? *image : Image{1, 1, 4, {1, 1, 1, 1}}));
      gl_.TextureParameteri(texture->second, GL_TEXTURE_WRAP_S, gl_wrap(mask.wrap_u));
      gl_.TextureParameteri(texture->second, GL_TEXTURE_WRAP_T, gl_wrap(mask.wrap_v));
    }
    uvs.resize(mesh.positions.size(), V2f(0, 0));
    const std::size_t first = indices.size() / 3;
    for (std::size_t t = span.first; t < span.end; ++t) {
      for (const std::uint32_t corner : mesh.triangles[t].corners) {
        uvs[corner] = mesh.uv(corner, mask.mapping);
        indices.push_back(corner);
      }
    }
    masked_.push_back(
        {first, indices.size() / 3, texture->second, materials.surfaces[span.surface].opaque_from});
  }
  if (masked_.empty()) return;
  masked_program_ = shadow_program("#define MASKED\n");
  add_attribute(gl_, array_, 1, objects_.buffer(uvs), 2, 0, sizeof(V2f));
}

void ShadowPass::project(GLuint program, const ShadowView& view) const {
  gl_.UseProgram(program);
  for (std::size_t k = 0; k < 4; ++k) {
    const V4f& row = view.rows[k];
    gl_.Uniform4f(static_cast<GLint>(k), row.x, row.y, row.z, row.w);
  }
  gl_.Uniform1f(map_size, static_cast<GLfloat>(view.size));
}

void ShadowPass::draw(std::span<const ShadowView> views) {
  if (std::equal(views.begin(), views.end(), views_.begin(), views_.end())) return;
  maps_objects_.clear();
  texture_ = 0;
  views_.clear();
  maps_.clear();
  if (views.empty()) return;
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
  gl_.BindVertexArray(array_);
  constexpr GLfloat farthest = 1;
  for (std::size_t i = 0; i < views.size(); ++i) {
    gl_.NamedFramebufferTextureLayer(framebuffer_, GL_DEPTH_ATTACHMENT, texture_, 0, static_cast<GLint>(i));
    if (gl_.CheckNamedFramebufferStatus(framebuffer_, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      throw Failure{{Code::graphics_unavailable, "", "shadow map", "OpenGL refuses it"}};
    gl_.ClearNamedFramebufferfv(framebuffer_, GL_DEPTH, 0, &farthest);
    project(program_, views[i]);
    draw_triangles(gl_, 0, triangles_);
    if (!masked_.empty()) project(masked_program_, views[i]);
    for (const Masked& masked : masked_) {
      gl_.BindTextureUnit(mask_unit, masked.texture);
      gl_.BindSampler(mask_unit, 0);
      gl_.Uniform1f(cutoff, masked.cutoff);
      draw_triangles(gl_, masked.first, masked.end);
    }
  }
  gl_.Disable(GL_DEPTH_CLAMP);
  views_.assign(views.begin(), views.end());
  check_errors(gl_, "shadow maps");
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
  maps_objects_.clear();
  texture_ = 0;
  return maps_;
}

}  // namespace selvedge
