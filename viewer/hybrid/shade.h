// The evaluation on the processor (paper section 6): the texels that pixels see are turned into light.
#pragma once

#include <span>
#include <vector>

#include "format/scene/camera.h"
#include "format/scene/lights.h"
#include "viewer/hybrid/index_pass.h"
#include "viewer/light/shadows.h"

namespace selvedge {

/// The garment's frame at a pixel. The picture of the fabric is stuck to the cloth: `tangent` runs along
/// growing u and `up` along falling v on both sides, `normal` points out of the side that is seen. So the
/// back of a cloth looks like the front's mirror image in the cloth's plane; the frame is left-handed
/// wherever the picture is seen mirrored.
struct LaneFrames {
  LaneDirections tangent;
  LaneDirections up;
  LaneDirections normal;
  LaneDirections view;  ///< towards the viewer, in the frame
};

struct ShadingScene {
  const Camera& camera;
  int width = 1;  ///< of the whole frame
  int height = 1;
  std::span<const SurfaceMaterial> materials;  ///< of the surfaces
  std::span<const PackedFabric> fabrics;
  std::span<const Light> lights;
  /// For lights that stand somewhere: the block's triangles, and where their coordinates begin.
  const MergedSurfaces* mesh = nullptr;
  V3d origin{0, 0, 0};
  std::span<const PbrMaterial> pbr{};    ///< of the surfaces; empty: all have a fabric that does not shine
  std::span<const ShadowMap> shadows{};  ///< ShadowView::light is an index into `lights`
  float ambient = 0;                     ///< light from all sides on core materials: white shows ambient / pi
  PowerKind power = PowerKind::exact;    ///< of the fabrics' lobes
};

/// A normal that an interpolation turned away from the viewer is bent until the view just clears the horizon.
/// Where there is no tangent the paper's fixed axis takes its place.
LaneFrames garment_frames(const Camera& camera, int width, int height, const PixelBlock& block);

/// What a pixel of the block shows; m, world. `origin`: where the mesh's coordinates begin.
V3d seen_point(const MergedSurfaces& mesh, const V3d& origin, const PixelBlock& block, std::size_t lane);

/// Kept between calls; one per thread.
struct ShadingScratch {
  LaneScratch lanes;
  std::vector<LaneLight> lights;
  std::vector<LaneTexels> texels;
  LaneFrames frames;
  LaneShading light;
};

/// Radiance times opacity, and opacity, of every pixel of the block; what lies behind does not count.
/// Surfaces without fabric are shaded by shade_pbr(). The result lies in `scratch`.
const LaneShading& shade(const ShadingScene& scene, const PixelBlock& block, ShadingScratch& scratch);

}  // namespace selvedge
