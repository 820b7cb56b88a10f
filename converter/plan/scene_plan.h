// Plans a scene without drawing it: which levels of its fabrics the pixels can ask for, how fine their texels
// need to be, and whether backs and holes can be seen (docs/plan.md). The plan is conservative: surfaces
// count as seen even where others hide them.
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

/// The frames that are planned for.
struct PlanOptions {
  SceneChoice choice;
  SceneLimits limits;
  std::vector<std::string> cameras;  ///< of the file, by name or number; the plan covers all
  /// Nearest and farthest distance (m) of cameras all around (level_bounds.h), instead of `camera`.
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
  int whole_levels = 1;   ///< number of its levels, as far as the file says
  LackingLevels lacking;  ///< the part of `levels` that the fabric's file lacks
  bool seen = false;
  LevelRange levels;  ///< of the whole fabric; the coarsest alone if it is not seen
  TexelDemand demand;
  bool fronts = false;
  bool backs = false;
  bool holes = false;  ///< some texel of these levels has holes, and the material's alpha mode shows them
  std::vector<int> behind;  ///< materials that may show through: all that are seen; the background always may
};

struct ScenePlan {
  std::string scene;
  PlanOptions options;
  std::vector<MaterialPlan> materials;  ///< those with a fabric
};

/// Reads a .gltf or .glb, and the headers and opacities of its fabrics. Errors: those of read_scene() and
/// FabricReader; GARMENT_EMPTY; MATERIAL_MISSING if no material has a fabric; OPTION_OUT_OF_RANGE for sizes
/// and cameras.
Result<ScenePlan> plan_scene(const std::string& path, const PlanOptions& options);

}  // namespace selvedge
