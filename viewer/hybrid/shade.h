// Shades the texels of pixels on the CPU (paper section 6).
#pragma once

#include <span>
#include <vector>

#include "format/scene/camera.h"
#include "format/scene/lights.h"
#include "viewer/frame/options.h"
#include "viewer/hybrid/index_pass.h"
#include "viewer/light/reflections.h"
#include "viewer/light/shadows.h"

namespace selvedge {

/// The garment's frame at a pixel. On both sides `tangent` points along growing u and `up` along falling v;
/// `normal` points out of the visible side. So the back of a cloth is the front mirrored in the cloth's
/// plane; the frame is left-handed where the texture appears mirrored.
struct LaneFrames {
  LaneDirections tangent;
  LaneDirections up;
  LaneDirections normal;
  LaneDirections view;  ///< towards the viewer, in the frame
};

class CellPass;

struct ShadingScene {
  const Camera& camera;
  int width = 1;  ///< of the whole frame
  int height = 1;
  std::span<const SurfaceMaterial> materials;  ///< of the surfaces
  std::span<const PackedFabric> fabrics;
  std::span<const Light> lights;
  /// For point and spot lights: the mesh of the block's triangles, and the origin of its coordinates.
  const MergedSurfaces* mesh = nullptr;
  V3d origin{0, 0, 0};
  std::span<const PbrMaterial> pbr{};    ///< of the surfaces; empty: all have a fabric without emission
  std::span<const ShadowMap> shadows{};  ///< ShadowView::light is an index into `lights`
  float ambient = 0;                     ///< DrawOptions::ambient
  const SmoothLight* around = nullptr;   ///< light from all around, world axes
  /// Share of it that reaches the vertices of `mesh`; empty: all.
  std::span<const SmoothLight> around_vertices{};
  const Reflections* reflections = nullptr;  ///< of the environment; null: none
  const CellPass* cells = nullptr;           ///< null: yarn shows as texels alone
  const DrawOptions* options = nullptr;      ///< may interrupt the work; null: nothing does
  bool ends() const { return options != nullptr && options->ends(); }
};

/// Frames of a block. An interpolated normal that faces away from the viewer is bent until the view just
/// clears the horizon. The paper's fixed axis replaces a missing tangent.
LaneFrames garment_frames(const Camera& camera, int width, int height, const PixelPlaces& block);

/// The visible point at a pixel of the block; m, world. `origin`: of the mesh's coordinates.
V3d seen_point(const MergedSurfaces& mesh, const V3d& origin, const PixelPlaces& block, std::size_t lane);

/// The visible side of a pixel's fabric; null without a fabric.
const PackedFabric* seen_fabric(const ShadingScene& scene, const PixelPlaces& block, std::size_t lane);

/// A block between the stages of its shading.
struct ShadedBlock {
  PixelPlaces places;
  LaneFrames frames;
  std::vector<LaneLight> lights;  ///< in the axes of `frames`
  LaneSmoothLight around;         ///< the same; undefined if the scene has none
  LaneShading light;              ///< radiance times opacity, and opacity; without the surfaces behind
};

/// Memory that calls reuse; one per thread.
struct ShadingScratch {
  LaneScratch lanes;
  std::vector<LaneTexels> texels;
  ShadedBlock block;
};

/// Sets `result` to the block in the light of its texels; cell images are still to be added.
void shade_texels(const ShadingScene& scene, const PixelBlock& block, ShadingScratch& scratch,
                  ShadedBlock& result);

/// Adds the cell images of the block's pixels to their light, by the weight of yarn.
void add_cells(const ShadingScene& scene, ShadedBlock& block);

/// The last stage: opaque materials, emission, and surfaces without fabric (shade_pbr()).
void finish_light(const ShadingScene& scene, ShadedBlock& block);

/// All stages. The result is part of `scratch`.
const LaneShading& shade(const ShadingScene& scene, const PixelBlock& block, ShadingScratch& scratch);

}  // namespace selvedge
