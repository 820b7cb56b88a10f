#include "viewer/light/pbr_inputs.h"

#include <fmt/format.h>

#include <algorithm>

#include "viewer/gl/objects.h"
#include "viewer/glsl.h"

namespace selvedge {
namespace {

// As written in pbr_fragment.glsl.
enum Uniform : GLint {
  is_pbr = 20,
  base_color,
  opaque_from,
  keeps_opacity,
  textures,
  factors,
  emission,
};
enum Attribute : GLuint { more_uv = 3, vertex_colour = 7 };
constexpr GLuint first_unit = 3;
constexpr std::size_t texture_count = 5;
constexpr int no_mapping = 15;

std::array<const MaterialTexture*, texture_count> textures_of(const PbrMaterial& pbr) {
  return {&pbr.base_color, &pbr.metallic_roughness, &pbr.normal, &pbr.occlusion, &pbr.emissive_texture};
}

GLint gl_wrap(Wrap wrap) {
  return wrap == Wrap::repeat ? GL_REPEAT : wrap == Wrap::mirror ? GL_MIRRORED_REPEAT : GL_CLAMP_TO_EDGE;
}

std::size_t sampler_of(Wrap u, Wrap v, bool nearest) {
  return static_cast<std::size_t>(u) + 3 * static_cast<std::size_t>(v) + (nearest ? 9U : 0U);
}

GLuint make_buffer(const GlFunctions& gl, std::size_t bytes, const void* data) {
  GLuint buffer = 0;
  gl.CreateBuffers(1, &buffer);
  gl.NamedBufferStorage(buffer, static_cast<GLsizeiptr>(bytes), data, 0);
  return buffer;
}

}  // namespace

PbrInputs::PbrInputs(const GlFunctions& gl, const MergedSurfaces& mesh, const Materials& materials)
    : gl_(gl), materials_(materials) {
  for (std::size_t i = 0; i < materials.materials.size(); ++i)
    needed_ |= materials.materials[i].fabric < 0 || materials.pbr[i].emissive != V3f(0, 0, 0);
  if (!needed_) return;
  for (const Image& image : materials.images) images_.push_back(make_colour_texture(gl, image));
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
  more_uvs_ = mesh.more_uvs.size();
  const std::size_t vertices = mesh.positions.size();
  if (more_uvs_ > 0) {
    std::vector<V2f> uvs(vertices * more_uvs_);
    for (std::size_t v = 0; v < vertices; ++v) {
      for (std::size_t k = 0; k < more_uvs_; ++k) uvs[v * more_uvs_ + k] = mesh.more_uvs[k][v];
    }
    uvs_ = make_buffer(gl_, uvs.size() * sizeof(V2f), uvs.data());
  }
  colours_ = !mesh.colors.empty();
  if (colours_) vertex_colours_ = make_buffer(gl_, vertices * sizeof(V4f), mesh.colors.data());
}

PbrInputs::~PbrInputs() {
  gl_.DeleteTextures(static_cast<GLsizei>(images_.size()), images_.data());
  gl_.DeleteSamplers(static_cast<GLsizei>(samplers), samplers_.data());
  const std::array buffers{uvs_, vertex_colours_};
  gl_.DeleteBuffers(static_cast<GLsizei>(buffers.size()), buffers.data());
}

std::string PbrInputs::definitions() const {
  if (!needed_) return "";
  return fmt::format("#define PBR\n#define MAPPINGS {}\n{}", more_uvs_ + 1,
                     colours_ ? "#define VERTEX_COLOURS\n" : "");
}

Result<GLuint> PbrInputs::triangle_program(const std::string& more, bool later) const {
  const std::string all = definitions() + more + (later ? "#define LATER\n" : "");
  return make_program(gl_, shader_text(all, {needed_ ? glsl::pbr_vertex : "", glsl::triangle_vertex}),
                      shader_text(all, {needed_ ? glsl::pbr_fragment : "", glsl::triangle_fragment}));
}

void PbrInputs::attach(GLuint array) const {
  const auto attribute = [&](GLuint location, GLuint buffer, GLint components, std::size_t offset,
                             std::size_t stride) {
    gl_.VertexArrayVertexBuffer(array, location, buffer, static_cast<GLintptr>(offset * sizeof(float)),
                                static_cast<GLsizei>(stride * sizeof(float)));
    gl_.EnableVertexArrayAttrib(array, location);
    gl_.VertexArrayAttribFormat(array, location, components, GL_FLOAT, GL_FALSE, 0);
    gl_.VertexArrayAttribBinding(array, location, location);
  };
  for (std::size_t k = 0; k < more_uvs_; ++k)
    attribute(more_uv + static_cast<GLuint>(k), uvs_, 2, 2 * k, 2 * more_uvs_);
  if (colours_) attribute(vertex_colour, vertex_colours_, 4, 0, 4);
}

void PbrInputs::bind(GLuint unit, const MaterialTexture& texture) const {
  gl_.BindTextureUnit(unit, images_[texture.image]);
  gl_.BindSampler(unit, samplers_[sampler_of(texture.wrap_u, texture.wrap_v, texture.nearest)]);
}

void PbrInputs::use(std::size_t surface) const {
  if (!needed_) return;
  const SurfaceMaterial& look = materials_.materials[surface];
  const PbrMaterial& pbr = materials_.pbr[surface];
  int mappings = 0;
  const auto all = textures_of(pbr);
  for (std::size_t i = 0; i < texture_count; ++i) {
    const bool there = all[i]->image >= 0;
    mappings |= (there ? all[i]->mapping : no_mapping) << (4 * i);
    if (there) bind(first_unit + static_cast<GLuint>(i), *all[i]);
  }
  gl_.Uniform1i(is_pbr, look.fabric < 0 ? 1 : 0);
  gl_.Uniform4f(base_color, look.base_color.x, look.base_color.y, look.base_color.z, look.base_color.w);
  gl_.Uniform1f(opaque_from, look.opaque_from);
  gl_.Uniform1i(keeps_opacity, look.keeps_opacity ? 1 : 0);
  gl_.Uniform1i(textures, mappings);
  gl_.Uniform4f(factors, pbr.metallic, pbr.roughness, pbr.normal_scale, pbr.occlusion_strength);
  gl_.Uniform3f(emission, pbr.emissive.x, pbr.emissive.y, pbr.emissive.z);
}

}  // namespace selvedge
