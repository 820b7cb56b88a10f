// Draws shadow maps with OpenGL.
#pragma once

#include <span>
#include <vector>

#include "format/picture/image.h"
#include "viewer/gl/objects.h"
#include "viewer/light/shadows.h"
#include "viewer/scene/materials.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

/// Whether the fabric of a surface has a mask, which is decoded at most 1024 pixels wide and high, so that
/// shadows are the same from wherever they are seen.
bool has_mask(const Materials& materials, std::size_t surface);
Result<Image> decode_mask(const MaterialPicture& picture);

/// Throws GRAPHICS_UNAVAILABLE where OpenGL fails.
class ShadowPass {
 public:
  /// All surfaces cast shadows except glTF materials with alpha mode BLEND; holes of fabrics, and masks of
  /// materials without one, are ignored. The context of `gl` must be current whenever a function of this
  /// class is called, the destructor included.
  ShadowPass(const GlFunctions& gl, const MergedSurfaces& mesh, const Materials& materials);
  /// Fraction of --max-memory that the masks of garments take.
  static std::uint64_t mask_bytes(const Materials& materials);

  /// Draws maps for these views, all of one size; does nothing if they equal the last call's.
  void draw(std::span<const ShadowView> views);

  std::span<const ShadowView> views() const { return views_; }
  /// The maps on the CPU, read back once after they are drawn.
  std::span<const ShadowMap> read();

 private:
  /// Triangles with a mask, after those without.
  struct Masked {
    std::size_t first = 0;
    std::size_t end = 0;
    GLuint texture = 0;
    float cutoff = 0;
  };

  GLuint shadow_program(const char* define);
  void add_masks(const MergedSurfaces& mesh, const Materials& materials, std::vector<std::uint32_t>& indices);
  void project(GLuint program, const ShadowView& view) const;

  const GlFunctions& gl_;
  GlObjects objects_;
  GlObjects maps_objects_;  ///< sized for the current views
  GLuint program_ = 0;
  GLuint array_ = 0;
  std::size_t triangles_ = 0;  ///< without a mask
  GLuint masked_program_ = 0;
  std::vector<Masked> masked_;
  GLuint framebuffer_ = 0;
  GLuint texture_ = 0;
  std::vector<ShadowView> views_;
  std::vector<ShadowMap> maps_;
};

}  // namespace selvedge
