// Loads what `render` draws: a scene with its fabrics, its frames and variants, and lights.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/selvedge-view/render_options.h"
#include "viewer/load.h"

namespace selvedge {

struct ShotFrame {
  std::string name;                   ///< four digits or "top"; empty: the only one
  int number = 0;                     ///< of a sequence as the options count, of a turntable from 1
  double time = 0;                    ///< of the clip, s
  Camera camera;                      ///< without a clip, or with one that does not move it
  std::optional<CameraOptions> view;  ///< of a turntable, for the report
};

/// Clothes of the scene.
struct ShotVariant {
  std::string name;  ///< empty: the only one
  int variant = -1;  ///< index into Scene::variants; -1: as it was loaded
  int fabric = -1;   ///< index into the fabrics, on all that wear one; -1: their own
};

struct Shot : LoadedScene {
  std::vector<ShotFrame> frames;
  std::vector<ShotVariant> variants;
  std::optional<Motion> motion;  ///< with --animation
  RenderOptions options;
  Look look;
};

/// Throws a Failure.
Shot read_shot(const RenderCommand& command);

/// The scene in a variant. Throws a Failure.
Scene worn_scene(const Shot& shot, const ShotVariant& variant);

/// Moves a scene, the camera and the lights to a frame of the clip. Throws a Failure.
void pose(const RenderCommand& command, Shot& shot, ShotFrame& frame, Scene& scene);

}  // namespace selvedge
