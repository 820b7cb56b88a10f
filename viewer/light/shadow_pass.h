// Draws shadow maps with OpenGL.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "viewer/gl/functions.h"
#include "viewer/light/shadows.h"
#include "viewer/scene/materials.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

class ShadowPass {
 public:
  /// All surfaces cast shadows but those of core materials that blend; holes of fabrics and of masks count as
  /// cloth. The context of `gl` must be current whenever a function of this class is called, the destructor
  /// included. GRAPHICS_UNAVAILABLE.
  static Result<std::unique_ptr<ShadowPass>> create(const GlFunctions& gl, const MergedSurfaces& mesh,
                                                    const Materials& materials);
  ~ShadowPass();
  ShadowPass(const ShadowPass&) = delete;
  ShadowPass& operator=(const ShadowPass&) = delete;

  /// Maps for these views, all of one size; nothing is drawn where they are those of the last call.
  Result<void> draw(std::span<const ShadowView> views);

  std::span<const ShadowView> views() const { return views_; }
  /// A texture array of depths, one layer for each view, and a buffer as shadow_lookup.glsl wants it; 0
  /// without views.
  GLuint texture() const { return texture_; }
  GLuint buffer() const { return buffer_; }
  /// The maps on the processor, read once after they were drawn.
  std::span<const ShadowMap> read();

 private:
  explicit ShadowPass(const GlFunctions& gl) : gl_(gl) {}
  void release_maps();

  const GlFunctions& gl_;
  GLuint program_ = 0;
  GLuint array_ = 0;
  GLuint positions_ = 0;
  GLuint indices_ = 0;
  GLsizei corners_ = 0;
  GLuint framebuffer_ = 0;
  GLuint texture_ = 0;
  GLuint buffer_ = 0;
  std::vector<ShadowView> views_;
  std::vector<ShadowMap> maps_;
};

}  // namespace selvedge
