// The options of `render` as plain data.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/common/run_key.h"
#include "apps/selvedge-view/picture_options.h"
#include "format/gltf/read_scene.h"
#include "format/scene/swatch.h"
#include "viewer/accuracy.h"

namespace selvedge {

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

}  // namespace selvedge
