#include "viewer/hybrid/visibility_pass.h"

#include <fmt/format.h>

#include <algorithm>

#include "viewer/gl/glsl.h"

namespace selvedge {
namespace {

constexpr int pixels_per_band = 1 << 21;
constexpr int bands_per_frame = 3;
constexpr int rasteriser_tile = 64;

// Locations in triangle_fragment.glsl.
enum Uniform : GLint { first_triangle = 1 };
enum Unit : GLuint { depth_unit = 1 };

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

FrameBands bands_of(const FrameSize& size) {
  FrameBands bands{size.width * size.supersample, size.height * size.supersample, 1, size.supersample};
  if (size.band_rows > 0) {
    bands.rows = size.band_rows * size.supersample;
    return bands;
  }
  // Whole tiles of the rasteriser, small enough that a band is drawn while the previous one is shaded.
  const int fraction =
      (bands.height / bands_per_frame + rasteriser_tile - 1) / rasteriser_tile * rasteriser_tile;
  const int rows = std::clamp(fraction, 1, std::max(pixels_per_band / bands.width, 1));
  const int step = 2 * size.supersample;
  bands.rows = std::max(rows / step, 1) * step;
  return bands;
}

BandPixels pixels_of(const FrameBands& bands, int first_row, std::span<Frame> frames,
                     std::vector<std::vector<V4f>>& large) {
  const bool is_large = bands.supersample > 1;
  // The frame's first row is at the top.
  BandPixels pixels{first_row,
                    bands.width,
                    bands.band_row_count(first_row),
                    {},
                    is_large ? bands.width : -bands.width,
                    bands.supersample};
  large.resize(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (is_large) large[i].resize(static_cast<std::size_t>(pixels.width) * pixels.rows);
    pixels.bottoms.push_back(is_large ? large[i].data()
                                      : frames[i].pixels.data() +
                                            static_cast<std::ptrdiff_t>(bands.height - 1 - first_row) *
                                                bands.width);
  }
  return pixels;
}

void filter_band(const FrameBands& bands, int first_row, const std::vector<std::vector<V4f>>& large,
                 std::span<Frame> frames) {
  if (bands.supersample == 1) return;
  for (std::size_t i = 0; i < frames.size(); ++i)
    box_filter(large[i], first_row, bands.supersample, frames[i]);
}

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

VisibilityPass::VisibilityPass(const GlFunctions& gl, const MergedSurfaces& mesh, const Materials& materials,
                               const FrameBands& bands)
    : gl_(gl),
      mesh_(mesh),
      materials_(materials.surfaces),
      pbr_(gl, mesh, materials),
      objects_(gl),
      target_objects_(gl),
      programs_{pbr_.triangle_program(objects_, false), pbr_.triangle_program(objects_, true)},
      array_(objects_.vertex_array()) {
  clip_ = objects_.buffer(mesh_.positions.size() * sizeof(V4f), nullptr, GL_DYNAMIC_STORAGE_BIT);
  indices_ =
      objects_.buffer(mesh_.triangles.size() * 3 * sizeof(std::uint32_t), nullptr, GL_DYNAMIC_STORAGE_BIT);
  add_attribute(gl_, array_, 0, clip_, 4, 0, sizeof(V4f));
  if (pbr_.needs_pbr()) {
    std::vector<V2f> uv;
    for (const auto& groups : mesh_.attributes) uv.emplace_back(groups[0][3], groups[1][3]);
    add_attribute(gl_, array_, 1, objects_.buffer(uv), 2, 0, sizeof(V2f));
  }
  pbr_.add_attributes(array_);
  gl_.VertexArrayElementBuffer(array_, indices_);
  resize(bands);
}

void VisibilityPass::resize(const FrameBands& bands) {
  if (bands == bands_) return;
  target_objects_.clear();
  targets_ = {};
  bands_ = bands;
}

void VisibilityPass::set_vertices(const ProjectedVertices& projected) {
  gl_.NamedBufferSubData(clip_, 0, static_cast<GLsizeiptr>(projected.clip.size() * sizeof(V4f)),
                         projected.clip.data());
}

void VisibilityPass::draw(int side, int round, int first_row, std::span<const std::uint32_t> triangles) {
  const auto& targets = targets_[side];
  TriangleTarget& target = targets_[side][round % 2];
  // Most frames have no second round.
  if (target.framebuffer == 0) {
    target = pbr_.make_target(target_objects_, bands_.width, bands_.rows);
    check_errors(gl_, "frame buffer");
  }
  // Only the depth shows whether a pixel is empty, so colours are not cleared.
  gl_.ClearNamedFramebufferfi(target.framebuffer, GL_DEPTH_STENCIL, 0, 1, 0);
  if (triangles.empty()) return;

  corners_.resize(triangles.size() * 3);
  for (std::size_t i = 0; i < triangles.size(); ++i)
    std::copy_n(mesh_.triangles[triangles[i]].corners.begin(), 3, &corners_[3 * i]);
  gl_.NamedBufferSubData(indices_, 0, static_cast<GLsizeiptr>(corners_.size() * sizeof(std::uint32_t)),
                         corners_.data());

  gl_.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
  // Dithering is on by default and would change coded values.
  gl_.Disable(GL_DITHER);
  gl_.Disable(GL_CULL_FACE);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_LESS);
  // The first round counts all surfaces, visible or not, in the stencil buffer.
  if (round == 0)
    gl_.Enable(GL_STENCIL_TEST);
  else
    gl_.Disable(GL_STENCIL_TEST);
  gl_.StencilFunc(GL_ALWAYS, 0, 0xff);
  gl_.StencilOp(GL_KEEP, GL_INCR, GL_INCR);
  // The viewport is the whole frame, shifted, so that a band covers the same pixels as an undivided frame.
  gl_.Viewport(0, -first_row, bands_.width, bands_.height);
  gl_.UseProgram(programs_[round == 0 ? 0 : 1]);
  if (round > 0) gl_.BindTextureUnit(depth_unit, targets[(round + 1) % 2].depth);
  gl_.BindVertexArray(array_);
  // One call for the surfaces of a material, or for all where none has a PbrPixel.
  std::size_t first = 0;
  while (first < triangles.size()) {
    const std::uint32_t surface = mesh_.triangles[triangles[first]].surface;
    std::size_t end = triangles.size();
    if (pbr_.needs_pbr()) {
      const auto other = [&](std::uint32_t t) {
        return materials_[mesh_.triangles[t].surface].material != materials_[surface].material;
      };
      end = std::find_if(triangles.begin() + static_cast<std::ptrdiff_t>(first), triangles.end(), other) -
            triangles.begin();
    }
    gl_.Uniform1i(first_triangle, static_cast<GLint>(first));
    pbr_.bind_surface(surface);
    draw_triangles(gl_, first, end);
    first = end;
  }
  check_errors(gl_, "drawing");
}

void VisibilityPass::read(int side, int round, int rows, VisibleSide& to) const {
  const std::size_t count = bands_.width * bands_.rows;
  to.triangles.resize(count);
  to.depth.resize(count);
  to.counts.resize(count);
  const TriangleTarget& target = targets_[side][round % 2];
  gl_.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, 0);
  const auto read = [&](GLenum format, GLenum type, void* data) {
    gl_.ReadPixels(0, 0, bands_.width, rows, format, type, data);
  };
  gl_.NamedFramebufferReadBuffer(target.framebuffer, GL_COLOR_ATTACHMENT0);
  read(GL_RED_INTEGER, GL_UNSIGNED_INT, to.triangles.data());
  read(GL_DEPTH_COMPONENT, GL_FLOAT, to.depth.data());
  if (round == 0) read(GL_STENCIL_INDEX, GL_UNSIGNED_BYTE, to.counts.data());
  if (!pbr_.needs_pbr()) return;
  to.colours.resize(count);
  to.pbr.resize(count);
  gl_.NamedFramebufferReadBuffer(target.framebuffer, GL_COLOR_ATTACHMENT1);
  read(GL_RGBA, GL_FLOAT, to.colours.data());
  gl_.NamedFramebufferReadBuffer(target.framebuffer, GL_COLOR_ATTACHMENT2);
  read(GL_RGBA_INTEGER, GL_UNSIGNED_INT, to.pbr.data());
}

}  // namespace selvedge
