#include "viewer/hybrid/visibility_pass.h"

#include <fmt/format.h>

#include <algorithm>

#include "viewer/gl/objects.h"

namespace selvedge {
namespace {

// As written in triangle_fragment.glsl.
enum Uniform : GLint { first_triangle = 1 };
enum Unit : GLuint { depth_unit = 1 };

}  // namespace

Result<std::unique_ptr<VisibilityPass>> VisibilityPass::create(const GlFunctions& gl,
                                                               const MergedSurfaces& mesh,
                                                               const Materials& materials,
                                                               const VisibilityOptions& options) {
  std::unique_ptr<VisibilityPass> pass(new VisibilityPass(gl, mesh, materials, options));
  for (std::size_t later = 0; later < 2; ++later) {
    const Result<GLuint> program = pass->core_.triangle_program("#define LISTED\n", later != 0);
    if (!program) return tl::unexpected(program.error());
    pass->programs_[later] = *program;
  }
  pass->upload(mesh);
  if (const auto good = pass->make_targets(); !good) return tl::unexpected(good.error());
  if (const auto good = check_errors(gl, "upload"); !good) return tl::unexpected(good.error());
  return pass;
}

Result<void> VisibilityPass::make_targets() {
  for (auto& side : targets_) {
    for (Target& target : side) {
      if (auto good = make_target(target); !good) return good;
    }
  }
  return {};
}

void VisibilityPass::release_targets() {
  for (auto& side : targets_) {
    for (Target& target : side) {
      gl_.DeleteFramebuffers(1, &target.framebuffer);
      const std::array textures{target.triangles, target.colours, target.pbr, target.depth};
      gl_.DeleteTextures(static_cast<GLsizei>(textures.size()), textures.data());
      target = {};
    }
  }
}

Result<void> VisibilityPass::resize(const VisibilityOptions& options) {
  release_targets();
  options_ = options;
  if (auto good = make_targets(); !good) return good;
  return check_errors(gl_, "frame buffer");
}

VisibilityPass::~VisibilityPass() {
  release_targets();
  gl_.DeleteVertexArrays(1, &array_);
  const std::array buffers{clip_, uv_, indices_};
  gl_.DeleteBuffers(static_cast<GLsizei>(buffers.size()), buffers.data());
  for (const GLuint program : programs_) gl_.DeleteProgram(program);
}

void VisibilityPass::upload(const MergedSurfaces& mesh) {
  std::vector<V2f> uv;
  uv.reserve(mesh.attributes.size());
  for (const auto& groups : mesh.attributes) uv.emplace_back(groups[0][3], groups[1][3]);
  const auto make = [&](GLuint& buffer, std::size_t bytes, const void* data) {
    gl_.CreateBuffers(1, &buffer);
    gl_.NamedBufferStorage(buffer, static_cast<GLsizeiptr>(std::max<std::size_t>(bytes, 4)), data,
                           GL_DYNAMIC_STORAGE_BIT);
  };
  make(clip_, mesh.positions.size() * sizeof(V4f), nullptr);
  make(uv_, uv.size() * sizeof(V2f), uv.data());
  make(indices_, mesh.triangles.size() * 3 * sizeof(std::uint32_t), nullptr);
  gl_.CreateVertexArrays(1, &array_);
  const auto attribute = [&](GLuint location, GLuint buffer, GLint components) {
    gl_.VertexArrayVertexBuffer(array_, location, buffer, 0,
                                static_cast<GLsizei>(static_cast<std::size_t>(components) * sizeof(float)));
    gl_.EnableVertexArrayAttrib(array_, location);
    gl_.VertexArrayAttribFormat(array_, location, components, GL_FLOAT, GL_FALSE, 0);
    gl_.VertexArrayAttribBinding(array_, location, location);
  };
  attribute(0, clip_, 4);
  if (core_.needed()) attribute(1, uv_, 2);
  core_.attach(array_);
  gl_.VertexArrayElementBuffer(array_, indices_);
}

Result<void> VisibilityPass::make_target(Target& target) {
  const int width = options_.width;
  const int rows = options_.band_rows;
  target.triangles = make_plain_texture(gl_, GL_R32UI, width, rows);
  target.depth = make_plain_texture(gl_, GL_DEPTH32F_STENCIL8, width, rows);
  gl_.CreateFramebuffers(1, &target.framebuffer);
  gl_.NamedFramebufferTexture(target.framebuffer, GL_COLOR_ATTACHMENT0, target.triangles, 0);
  gl_.NamedFramebufferTexture(target.framebuffer, GL_DEPTH_STENCIL_ATTACHMENT, target.depth, 0);
  if (core_.needed()) {
    target.colours = make_plain_texture(gl_, GL_RGBA32F, width, rows);
    target.pbr = make_plain_texture(gl_, GL_RGBA32UI, width, rows);
    gl_.NamedFramebufferTexture(target.framebuffer, GL_COLOR_ATTACHMENT1, target.colours, 0);
    gl_.NamedFramebufferTexture(target.framebuffer, GL_COLOR_ATTACHMENT2, target.pbr, 0);
  }
  constexpr std::array<GLenum, 3> attachments{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1,
                                              GL_COLOR_ATTACHMENT2};
  gl_.NamedFramebufferDrawBuffers(target.framebuffer, core_.needed() ? 3 : 1, attachments.data());
  if (gl_.CheckNamedFramebufferStatus(target.framebuffer, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return fail(Code::graphics_unavailable, "", "frame buffer", "OpenGL refuses the index buffers");
  return {};
}

void VisibilityPass::place(const ProjectedVertices& projected) {
  gl_.NamedBufferSubData(clip_, 0, static_cast<GLsizeiptr>(projected.clip.size() * sizeof(V4f)),
                         projected.clip.data());
}

void VisibilityPass::draw_surface(std::uint32_t surface, std::size_t first, std::size_t end) {
  gl_.Uniform1i(first_triangle, static_cast<GLint>(first));
  core_.use(surface);
  gl_.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * (end - first)), GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(3 * first * sizeof(std::uint32_t)));
}

Result<void> VisibilityPass::draw(int side, int round, int first_row,
                                  std::span<const std::uint32_t> triangles) {
  const auto& targets = targets_[side];
  const Target& target = targets[round % 2];
  // The depth alone says whether a pixel is empty.
  gl_.ClearNamedFramebufferfi(target.framebuffer, GL_DEPTH_STENCIL, 0, 1, 0);
  if (triangles.empty()) return {};

  corners_.resize(triangles.size() * 3);
  for (std::size_t i = 0; i < triangles.size(); ++i)
    std::copy_n(mesh_.triangles[triangles[i]].corners.begin(), 3, &corners_[3 * i]);
  gl_.NamedBufferSubData(indices_, 0, static_cast<GLsizeiptr>(corners_.size() * sizeof(std::uint32_t)),
                         corners_.data());

  gl_.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
  // On by default, and it would change coded values.
  gl_.Disable(GL_DITHER);
  gl_.Disable(GL_CULL_FACE);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_LESS);
  // The first round counts what lies behind each other, seen or not.
  if (round == 0)
    gl_.Enable(GL_STENCIL_TEST);
  else
    gl_.Disable(GL_STENCIL_TEST);
  gl_.StencilFunc(GL_ALWAYS, 0, 0xff);
  gl_.StencilOp(GL_KEEP, GL_INCR, GL_INCR);
  // The viewport is that of the whole frame, moved: a band covers the pixels that it would without bands.
  gl_.Viewport(0, -first_row, options_.width, options_.height);
  gl_.UseProgram(programs_[round == 0 ? 0 : 1]);
  if (round > 0) gl_.BindTextureUnit(depth_unit, targets[(round + 1) % 2].depth);
  gl_.BindVertexArray(array_);
  // Without core materials the surfaces differ in nothing that OpenGL has to know.
  std::size_t first = 0;
  while (first < triangles.size()) {
    const std::uint32_t surface = mesh_.triangles[triangles[first]].surface;
    std::size_t end = triangles.size();
    if (core_.needed()) {
      const auto other = [&](std::uint32_t t) { return mesh_.triangles[t].surface != surface; };
      end = static_cast<std::size_t>(
          std::find_if(triangles.begin() + static_cast<std::ptrdiff_t>(first), triangles.end(), other) -
          triangles.begin());
    }
    draw_surface(surface, first, end);
    first = end;
  }
  return check_errors(gl_, "drawing");
}

void VisibilityPass::read_pixels(int side, int round, const Rectangle& rectangle, VisibleSide& to) const {
  const Target& target = targets_[side][round % 2];
  const std::size_t start = static_cast<std::size_t>(rectangle.y) * static_cast<std::size_t>(options_.width) +
                            static_cast<std::size_t>(rectangle.x);
  const auto read = [&](GLenum format, GLenum type, void* data) {
    gl_.ReadPixels(rectangle.x, rectangle.y, rectangle.width, rectangle.rows, format, type, data);
  };
  gl_.NamedFramebufferReadBuffer(target.framebuffer, GL_COLOR_ATTACHMENT0);
  read(GL_RED_INTEGER, GL_UNSIGNED_INT, &to.triangles[start]);
  read(GL_DEPTH_COMPONENT, GL_FLOAT, &to.depth[start]);
  if (round == 0) read(GL_STENCIL_INDEX, GL_UNSIGNED_BYTE, &to.counts[start]);
  if (core_.needed()) {
    gl_.NamedFramebufferReadBuffer(target.framebuffer, GL_COLOR_ATTACHMENT1);
    read(GL_RGBA, GL_FLOAT, &to.colours[start]);
    gl_.NamedFramebufferReadBuffer(target.framebuffer, GL_COLOR_ATTACHMENT2);
    read(GL_RGBA_INTEGER, GL_UNSIGNED_INT, &to.pbr[start]);
  }
}

void VisibilityPass::read(int side, int round, const FrameTiles& where, VisibleSide& to) const {
  const std::size_t count =
      static_cast<std::size_t>(options_.width) * static_cast<std::size_t>(options_.band_rows);
  to.triangles.resize(count);
  to.depth.resize(count);
  to.counts.resize(count);
  if (core_.needed()) {
    to.colours.resize(count);
    to.pbr.resize(count);
  }
  gl_.BindFramebuffer(GL_FRAMEBUFFER, targets_[side][round % 2].framebuffer);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, options_.width);
  // Each call has its price; many small ones cost more than all pixels.
  constexpr std::ptrdiff_t max_calls = 16;
  if (where.tiles.empty() ||
      std::count(where.tiles.begin(), where.tiles.end(), std::uint8_t{1}) > max_calls) {
    read_pixels(side, round, {0, 0, options_.width, where.rows}, to);
    return;
  }
  const int columns = (options_.width + tile_side - 1) / tile_side;
  for (int i = 0; i < static_cast<int>(where.tiles.size()); ++i) {
    if (where.tiles[i] == 0) continue;
    const int x = i % columns * tile_side;
    const int y = i / columns * tile_side;
    read_pixels(side, round,
                {x, y, std::min(tile_side, options_.width - x), std::min(tile_side, where.rows - y)}, to);
  }
}

}  // namespace selvedge
