#include "viewer/light/pbr_inputs.h"

#include <fmt/format.h>

#include "viewer/gl/glsl.h"

namespace selvedge {
namespace {

// Locations in pbr_fragment.glsl.
enum PbrUniform : GLint {
  is_pbr = 20,
  base_color,
  min_opacity,
  keeps_opacity,
  textures,
  factors,
  emission,
};
enum Attribute : GLuint { more_uv = 3, vertex_colour = 15 };
constexpr GLuint first_unit = 3;
constexpr int no_mapping = 15;

std::size_t sampler_of(Wrap u, Wrap v, bool nearest) {
  return static_cast<std::size_t>(u) + 3 * static_cast<std::size_t>(v) + (nearest ? 9U : 0U);
}

}  // namespace

PbrInputs::PbrInputs(const GlFunctions& gl, const MergedSurfaces& mesh, const Materials& materials)
    : gl_(gl), materials_(materials), needed_(materials.needs_pbr()), objects_(gl) {
  if (!needed_) return;
  gl_.CreateSamplers(static_cast<GLsizei>(samplers), samplers_.data());
  for (const Wrap u : {Wrap::repeat, Wrap::mirror, Wrap::clamp}) {
    for (const Wrap v : {Wrap::repeat, Wrap::mirror, Wrap::clamp}) {
      for (const bool nearest : {false, true}) {
        const GLuint sampler = samplers_[sampler_of(u, v, nearest)];
        gl_.SamplerParameteri(sampler, GL_TEXTURE_WRAP_S, gl_wrap(u));
        gl_.SamplerParameteri(sampler, GL_TEXTURE_WRAP_T, gl_wrap(v));
        gl_.SamplerParameteri(sampler, GL_TEXTURE_MAG_FILTER, nearest ? GL_NEAREST : GL_LINEAR);
        gl_.SamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
      }
    }
  }
  more_uvs_ = mesh.extra_uvs.size();
  const std::size_t vertices = mesh.positions.size();
  if (more_uvs_ > 0) {
    std::vector<V2f> uvs(vertices * more_uvs_);
    for (std::size_t v = 0; v < vertices; ++v)
      for (std::size_t k = 0; k < more_uvs_; ++k) uvs[v * more_uvs_ + k] = mesh.extra_uvs[k][v];
    uvs_ = objects_.buffer(uvs);
  }
  if (!mesh.colors.empty()) vertex_colours_ = objects_.buffer(mesh.colors);
}

GLuint PbrInputs::triangle_program(GlObjects& objects, bool later) const {
  std::string all = later ? "#define LATER\n" : "";
  if (needed_)
    all += fmt::format("#define PBR\n#define MAPPINGS {}\n{}", more_uvs_ + 1,
                       vertex_colours_ != 0 ? "#define VERTEX_COLOURS\n" : "");
  return objects.program(shader_text(all, {needed_ ? glsl::pbr_vertex : "", glsl::triangle_vertex}),
                         shader_text(all, {needed_ ? glsl::pbr_fragment : "", glsl::triangle_fragment}));
}

TriangleTarget PbrInputs::make_target(GlObjects& objects, int width, int height) const {
  TriangleTarget target;
  target.triangles = objects.plain_texture(GL_R32UI, width, height);
  target.depth = objects.plain_texture(GL_DEPTH32F_STENCIL8, width, height);
  std::vector<GLuint> colours{target.triangles};
  if (needed_) {
    colours.push_back(target.colours = objects.plain_texture(GL_RGBA32F, width, height));
    colours.push_back(target.pbr = objects.plain_texture(GL_RGBA32UI, width, height));
  }
  target.framebuffer = objects.framebuffer(colours, GL_DEPTH_STENCIL_ATTACHMENT, target.depth);
  return target;
}

void PbrInputs::add_attributes(GLuint array) const {
  for (std::size_t k = 0; k < more_uvs_; ++k)
    add_attribute(gl_, array, more_uv + static_cast<GLuint>(k), uvs_, 2, k * sizeof(V2f),
                  more_uvs_ * sizeof(V2f));
  if (vertex_colours_ != 0) add_attribute(gl_, array, vertex_colour, vertex_colours_, 4, 0, sizeof(V4f));
}

void PbrInputs::bind_surface(std::size_t surface) const {
  if (!needed_) return;
  const SurfaceMaterial& material = materials_.surfaces[surface];
  const PbrMaterial& pbr = materials_.pbr[surface];
  int mappings = 0;
  const auto all = textures_of(pbr);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const MaterialTexture& one = *all[i];
    const GLuint texture = one.image < 0 ? 0 : materials_.pictures[one.image].texture;
    mappings |= (texture == 0 ? no_mapping : one.mapping) << (4 * i);
    if (texture == 0) continue;
    const GLuint unit = first_unit + static_cast<GLuint>(i);
    gl_.BindTextureUnit(unit, texture);
    gl_.BindSampler(unit, samplers_[sampler_of(one.wrap_u, one.wrap_v, one.has_nearest_filter)]);
  }
  mappings |= pbr.normal_frame << (4 * all.size());
  gl_.Uniform1i(is_pbr, material.fabric < 0 ? 1 : 0);
  gl_.Uniform4f(base_color, material.base_color_factor.x, material.base_color_factor.y,
                material.base_color_factor.z, material.base_color_factor.w);
  gl_.Uniform1f(min_opacity, material.min_opacity);
  gl_.Uniform1i(keeps_opacity, material.keeps_opacity ? 1 : 0);
  gl_.Uniform1i(textures, mappings);
  gl_.Uniform4f(factors, pbr.metallic, pbr.roughness, pbr.normal_scale, pbr.occlusion_strength);
  gl_.Uniform3f(emission, pbr.emissive.x, pbr.emissive.y, pbr.emissive.z);
}

}  // namespace selvedge
