#include "viewer/hybrid/visibility_pass.h"

#include <algorithm>

#include "viewer/gl/objects.h"

namespace selvedge {
namespace {

// Locations in triangle_fragment.glsl.
enum Uniform : GLint { first_triangle = 1 };
enum Unit : GLuint { depth_unit = 1 };

}  // namespace

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
