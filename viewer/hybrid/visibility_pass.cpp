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
enum Attribute : GLuint { first_uv = 1, vertex_colour = 15 };
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

void VisibilityPass::bind_surface(std::size_t surface) const {
  if (!has_pbr_) return;
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
    : gl_(gl), mesh_(mesh), materials_(materials) {
  const std::size_t vertices = mesh.positions.size();
  clip_ = objects_.buffer(vertices * sizeof(V4f), nullptr, GL_DYNAMIC_STORAGE_BIT);
  indices_ =
      objects_.buffer(mesh_.triangles.size() * 3 * sizeof(std::uint32_t), nullptr, GL_DYNAMIC_STORAGE_BIT);
  add_attribute(gl_, array_, 0, clip_, 4, 0, sizeof(V4f));
  gl_.VertexArrayElementBuffer(array_, indices_);
  std::string definitions;
  if (has_pbr_) {
    const int mappings = 1 + static_cast<int>(mesh.extra_uvs.size());
    std::vector<V2f> uvs;
    for (std::uint32_t v = 0; v < vertices; ++v)
      for (int k = 0; k < mappings; ++k) uvs.push_back(mesh.uv(v, k));
    const GLuint buffer = objects_.buffer(uvs);
    for (int k = 0; k < mappings; ++k)
      add_attribute(gl_, array_, first_uv + k, buffer, 2, k * sizeof(V2f), mappings * sizeof(V2f));
    definitions = fmt::format("#define PBR\n#define MAPPINGS {}\n", mappings);
    if (!mesh.colors.empty()) {
      add_attribute(gl_, array_, vertex_colour, objects_.buffer(mesh.colors), 4, 0, sizeof(V4f));
      definitions += "#define VERTEX_COLOURS\n";
    }
    for (const Wrap u : {Wrap::repeat, Wrap::mirror, Wrap::clamp})
      for (const Wrap v : {Wrap::repeat, Wrap::mirror, Wrap::clamp})
        for (const bool nearest : {false, true})
          samplers_[sampler_of(u, v, nearest)] = objects_.sampler(u, v, nearest);
  }
  for (std::size_t later = 0; later < 2; ++later) {
    const std::string all = (later == 1 ? "#define LATER\n" : "") + definitions;
    programs_[later] =
        objects_.program(shader_text(all, {has_pbr_ ? glsl::pbr_vertex : "", glsl::triangle_vertex}),
                         shader_text(all, {has_pbr_ ? glsl::pbr_fragment : "", glsl::triangle_fragment}));
  }
  resize(bands);
}

void VisibilityPass::resize(const FrameBands& bands) {
  if (bands == bands_) return;
  target_objects_.clear();
  targets_ = {};
  bands_ = bands;
}

void VisibilityPass::draw(int side, int round, int first_row, std::span<const std::uint32_t> triangles) {
  const auto& targets = targets_[side];
  Target& target = targets_[side][round % 2];
  // Most frames have no second round.
  if (target.framebuffer == 0) {
    std::vector<GLuint> colours;
    for (const GLenum format : {GL_R32UI, GL_RGBA32F, GL_RGBA32UI})
      if (colours.empty() || has_pbr_)
        colours.push_back(target_objects_.plain_texture(format, bands_.width, bands_.rows));
    const GLuint depth = target_objects_.plain_texture(GL_DEPTH32F_STENCIL8, bands_.width, bands_.rows);
    target = {target_objects_.framebuffer(colours, GL_DEPTH_STENCIL_ATTACHMENT, depth), depth};
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
  const std::vector<SurfaceMaterial>& materials = materials_.surfaces;
  std::size_t first = 0;
  while (first < triangles.size()) {
    const std::uint32_t surface = mesh_.triangles[triangles[first]].surface;
    std::size_t end = triangles.size();
    if (has_pbr_) {
      const auto other = [&](std::uint32_t t) {
        return materials[mesh_.triangles[t].surface].material != materials[surface].material;
      };
      end = std::find_if(triangles.begin() + static_cast<std::ptrdiff_t>(first), triangles.end(), other) -
            triangles.begin();
    }
    gl_.Uniform1i(first_triangle, static_cast<GLint>(first));
    bind_surface(surface);
    gl_.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * (end - first)), GL_UNSIGNED_INT,
                     reinterpret_cast<const void*>(3 * first * sizeof(GLuint)));
    first = end;
  }
  check_errors(gl_, "drawing");
}

void VisibilityPass::read(int side, int round, int rows, DrawnSide& to) const {
  const std::size_t count = bands_.width * bands_.rows;
  to.triangles.resize(count);
  to.depth.resize(count);
  to.counts.resize(count);
  const Target& target = targets_[side][round % 2];
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
  if (!has_pbr_) return;
  to.colours.resize(count);
  to.pbr.resize(count);
  gl_.NamedFramebufferReadBuffer(target.framebuffer, GL_COLOR_ATTACHMENT1);
  read(GL_RGBA, GL_FLOAT, to.colours.data());
  gl_.NamedFramebufferReadBuffer(target.framebuffer, GL_COLOR_ATTACHMENT2);
  read(GL_RGBA_INTEGER, GL_UNSIGNED_INT, to.pbr.data());
}

}  // namespace selvedge
