// Plan: what a scene requires of its fabrics, worked out without drawing it: which levels any pixel can ask
// for, how fine their texels need to be, whether backs and holes can be seen (docs/plan.md). Never too
// little: surfaces that hide each other are taken to be seen.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/fabric/level_options.h"
#include "format/gltf/read_scene.h"
#include "format/scene/camera.h"
#include "format/scene/level_bounds.h"

namespace selvedge {

/// The frames that will be drawn.
struct PlanOptions {
  SceneChoice choice;
  std::vector<std::string> cameras;  ///< of the file, by name or number; all of them count
  /// From nearest to farthest (m) all around (level_bounds.h), instead of one camera that `camera` makes.
  std::optional<V2d> distances;
  CameraOptions camera;
  V2i size{800, 600};  ///< of the frame, pixels
  int supersample = 1;
  LevelOptions levels = best_levels;
};

struct MaterialPlan {
  int index = 0;     ///< of the material in the file
  std::string name;  ///< may be empty
  std::string fabric;
  V2d mm_per_repeat{1, 1};
  V2i texels{1, 1};       ///< of level 0 of the whole fabric
  int whole_levels = 1;   ///< of it, as far as the file says
  LackingLevels lacking;  ///< what of `levels` the fabric's file does not have
  bool seen = false;
  LevelRange levels;  ///< of the whole fabric; where it is not seen, the coarsest alone
  TexelDemand demand;
  bool fronts = false;
  bool backs = false;
  bool holes = false;  ///< some texel of these levels lets something through, and the material lets it count
  std::vector<int> behind;  ///< materials that may show through: all that are seen; the background always may
};

struct ScenePlan {
  std::string scene;
  PlanOptions options;
  std::vector<MaterialPlan> materials;  ///< those with a fabric
};

/// Reads a .gltf or .glb and of its fabrics the headers and opacities. Errors are those of read_scene() and
/// of FabricReader; GARMENT_EMPTY; MATERIAL_MISSING where no material has a fabric; OPTION_OUT_OF_RANGE for
/// sizes and cameras.
Result<ScenePlan> plan_scene(const std::string& path, const PlanOptions& options);

}  // namespace selvedge
