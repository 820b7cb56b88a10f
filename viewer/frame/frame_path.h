// The interface of the render paths, and their inputs.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "format/base/progress.h"
#include "format/picture/frame.h"
#include "format/scene/camera.h"
#include "viewer/frame/options.h"
#include "viewer/light/reflections.h"
#include "viewer/light/shadow_pass.h"
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

struct FrameView {
  const Camera& camera;
  const DrawOptions& options;
  ShadowPass* shadows = nullptr;  ///< the lights' shadow maps; null: no shadows
  /// Share of DrawOptions::around that reaches the vertices; empty: all.
  std::span<const SmoothLight> around_vertices{};
  std::shared_ptr<const Reflections> reflections = nullptr;  ///< of DrawOptions::environment; null: none
};

class FramePath {
 public:
  FramePath() = default;
  FramePath(const FramePath&) = delete;
  FramePath& operator=(const FramePath&) = delete;
  /// The context must be current whenever a function of a path is called, the destructor included.
  virtual ~FramePath() = default;
  virtual Result<void> resize(const FrameSize& size) = 0;
  /// Fills all pixels of `frame`, which has the size of the last resize() already; adds to `stats`.
  virtual Result<void> draw(const FrameView& view, Frame& frame, RenderStats& stats) = 0;
};

}  // namespace selvedge
