// Draws shadow maps on the CPU, and with them the fraction of light from all around that reaches each vertex:
// folds, sleeves and the inside of a collar keep light from each other.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "format/fabric/smooth_light.h"
#include "format/picture/image.h"
#include "viewer/light/shadows.h"
#include "viewer/scene/materials.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

/// The surfaces that cast shadows: all except glTF materials with alpha mode BLEND. Holes of fabrics, and
/// masks of materials without one, are ignored. Masks of fabrics are decoded at most 1024 pixels wide and
/// high, so that shadows are the same from wherever they are seen.
class Occluders {
 public:
  /// `mesh` must outlive the object.
  Occluders(const MergedSurfaces& mesh, const Materials& materials);
  /// Bytes that the masks take (--max-memory).
  static std::uint64_t mask_bytes(const Materials& materials);

  /// Draws the map of a view, and with `opposite` the one from the other side of the scene, whose depths grow
  /// towards the light. Where triangles cover more than `max_overdraw` times its texels, the map is halved
  /// until they do not.
  ShadowMap draw(const ShadowView& view, ShadowMap* opposite = nullptr) const;
  static constexpr int max_overdraw = 256;

 private:
  /// A picture whose alpha cuts a surface.
  struct Mask {
    std::shared_ptr<const Image> image;
    MaterialTexture texture;
    float cutoff = 0;
    bool cuts(const V2f& uv) const;
  };

  bool draw_into(ShadowMap& map, ShadowMap* opposite, double max_work, double& done) const;

  const MergedSurfaces& mesh_;
  std::vector<std::uint32_t> triangles_;
  std::vector<std::optional<Mask>> masks_;  ///< of surfaces
};

/// Fractions of the light from directions over the sphere that reach the vertices, on the side of the cloth
/// that faces the direction.
struct SkyVisibility {
  std::vector<V3f> directions;
  std::vector<std::uint8_t> fractions;  ///< [vertex][direction], of 255
};

/// Draws shadow maps towards the directions. `occluders`: of `mesh`.
SkyVisibility sky_visibility(const MergedSurfaces& mesh, const Occluders& occluders);

/// Smooth light as each vertex sees it; exact where nothing hides it.
std::vector<SmoothLight> light_at_vertices(const SkyVisibility& visibility, const SmoothLight& light);

}  // namespace selvedge
