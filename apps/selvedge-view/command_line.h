// The command line of selvedge-view as plain data.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/common/program.h"
#include "format/gltf/read_scene.h"
#include "format/picture/display.h"
#include "format/scene/camera.h"
#include "format/scene/swatch.h"
#include "viewer/render.h"
#include "viewer/swatch.h"

namespace selvedge {

struct RenderCommand {
  std::string input;
  std::vector<std::string> outputs;     ///< .png or .exr
  RenderOptions render;                 ///< without the lights
  CameraOptions camera;                 ///< scenes
  std::string camera_of_file;           ///< scenes: name or number; empty: `camera` finds a place by itself
  SceneChoice choice;                   ///< scenes
  SwatchOptions swatch;                 ///< fabric files
  std::optional<SwatchView> place;      ///< fabric files: instead of `swatch`
  std::vector<Light> lights;            ///< empty: those of the scene, else the default lights
  bool lights_in_camera_frame = false;  ///< of the lights above, those that are far away
  DisplayOptions display;               ///< PNG files
  int turntable = 0;                    ///< frames once around the scene; 0: one frame
  std::string compare;  ///< scenes: what is drawn beside it, a scene or a fabric; empty: nothing
  std::string stats;    ///< file for the report; "-": standard output; empty: none
  int threads = 0;      ///< 0: all cores
  bool json = false;
  bool quiet = false;
};

struct ShowCommand {
  std::string input;
  std::vector<std::string> fabrics;  ///< files, to choose from
  V2i size{1280, 800};
  CameraOptions camera;
  SwatchOptions swatch;                 ///< fabric files
  std::vector<Light> lights;            ///< empty: those of the scene, else the default lights
  bool lights_in_camera_frame = false;  ///< of the lights above, those that are far away
  DisplayOptions display;
  float ambient = RenderOptions{}.ambient;
  int shadows = 0;  ///< RenderOptions::shadows
  LevelOptions levels;
  int layers = 8;
  bool texel_edges = false;
  std::string screenshot;  ///< of the window as it was when it closed, .png; empty: none
  int threads = 0;
  bool json = false;
  bool quiet = false;
};

struct CompareCommand {
  std::string first;
  std::string second;
  std::optional<double> max;  ///< largest difference that is still good
  bool json = false;
};

struct TradeCommand {
  std::string folder;  ///< of a sweep by `selvedge trade`
  int repeats = 5;     ///< times are medians of so many
  V2i size{640, 480};  ///< of the frames that are timed
  int threads = 0;
  bool json = false;
  bool quiet = false;
};

using Command = std::variant<ExitNow, RenderCommand, ShowCommand, CompareCommand, TradeCommand>;

Command parse_command_line(int argc, const char* const* argv);

}  // namespace selvedge
