// Frames and variants that `render` is asked for, and the scene, fabrics and lights that it draws.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/common/run_key.h"
#include "apps/selvedge-view/picture_options.h"
#include "format/scene/swatch.h"
#include "viewer/accuracy.h"
#include "viewer/load.h"

namespace selvedge {

/// The options of `render`.
struct RenderCommand {
  CommonOptions common;
  RunKey key;
  PictureOptions picture;
  std::vector<std::string> outputs;  ///< .png or .exr
  V2i size{800, 600};
  RenderOptions render;            ///< path, context and supersampling
  std::optional<int> supersample;  ///< default: by `goal`
  PictureGoal goal;
  std::string file_camera;            ///< scenes: name or number; empty: PictureOptions::camera
  bool has_view_angles = false;       ///< --azimuth or --elevation is given
  SceneChoice choice;                 ///< scenes
  std::vector<std::string> variants;  ///< scenes: names, or "all"
  std::vector<std::string> fabrics;   ///< scenes: files, in place of variants
  std::string animation;              ///< scenes: name or number of a clip; empty: at rest
  double time = 0;                    ///< of the clip, s
  std::optional<V2i> frames;          ///< of the clip: first and last; else one, at `time`
  double fps = 30;                    ///< of `frames`
  std::optional<SwatchView> place;    ///< fabric files: instead of PictureOptions::swatch
  int turntable = 0;                  ///< frames once around the scene; 0: none
  bool has_top = false;               ///< one more, from above
  /// Whether the pictures go to standard output, as PNG files one after the other.
  bool streams() const { return outputs.size() == 1 && outputs[0] == "-"; }
  bool has_variants() const { return !variants.empty() || !fabrics.empty(); }
};

void declare_render(Options& options, RenderCommand& command);

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
