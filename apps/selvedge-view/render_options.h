// The options of `render` as plain data.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/common/options.h"
#include "apps/selvedge-view/picture_options.h"
#include "format/gltf/read_scene.h"
#include "format/scene/swatch.h"
#include "viewer/accuracy.h"

namespace selvedge {

struct RenderCommand {
  CommonOptions common;
  PictureOptions picture;
  std::vector<std::string> outputs;  ///< .png or .exr
  V2i size{800, 600};
  RenderOptions render;            ///< path, context and supersampling
  std::optional<int> supersample;  ///< default: by `goal`
  PictureGoal goal;
  std::string file_camera;            ///< scenes: name or number; empty: PictureOptions::camera
  bool has_view_angles = false;       ///< --azimuth or --elevation is given
  SceneChoice choice{{}, {}, false};  ///< scenes
  std::optional<SwatchView> place;    ///< fabric files: instead of PictureOptions::swatch
  int turntable = 0;                  ///< frames once around the scene; 0: one frame
};

void declare_render(Options& options, RenderCommand& command);

}  // namespace selvedge
