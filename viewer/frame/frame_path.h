// The inputs of a frame.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "format/base/progress.h"
#include "format/scene/camera.h"
#include "viewer/frame/options.h"
#include "viewer/light/reflections.h"
#include "viewer/light/shadows.h"
#include "viewer/scene/fabric_sides.h"
#include "viewer/scene/materials.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

/// Data that all frames share.
struct PreparedScene {
  V3d origin{0, 0, 0};  ///< world, m, of the mesh's coordinates
  MergedSurfaces mesh;
  Materials materials;
  std::vector<FabricSides> fabrics;
};

/// Factors on the light of each surface's fabric.
using Tints = std::vector<V3f>;

struct FrameView {
  const Camera& camera;
  const DrawOptions& options;
  std::span<const ShadowMap> shadows{};  ///< of the lights; empty: no shadows
  /// Fraction of DrawOptions::smooth_light that reaches the vertices; empty: all.
  std::span<const SmoothLight> vertex_lights{};
  std::shared_ptr<const Reflections> reflections = nullptr;  ///< of DrawOptions::environment; null: none
  std::span<const Tints>
      tints{};  ///< of pictures that differ by them alone; empty: one picture, all factors 1
};

}  // namespace selvedge
