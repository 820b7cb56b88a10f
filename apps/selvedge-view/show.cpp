#include <algorithm>
#include <filesystem>

#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/garment_writer.h"
#include "apps/selvedge-view/picture_options.h"
#include "apps/selvedge-view/show_loop.h"
#include "format/base/option_text.h"
#include "format/fabric/file.h"
#include "format/picture/environment.h"
#include "viewer/load.h"
#include "viewer/scene/change_fabrics.h"

namespace selvedge {
namespace {

struct ShowCommand {
  CommonOptions common;
  PictureOptions picture;
  std::vector<std::string> fabrics;  ///< files to choose from
  V2i size{1280, 800};
  double fps = 30;
  std::string screenshot;  ///< of the window as it was when it closed, .png; empty: none
};

void declare(Options& options, ShowCommand& command) {
  PictureOptions& picture = command.picture;
  add_input(options, picture);
  options
      .list("--fabric", command.fabrics, "FILE",
            "A fabric file to choose from, or a folder of them; may be repeated")
      .reads();
  options.size("--size", command.size, "Size of the window", 1, 1'000'000);
  add_fps(options, command.fps);
  options.text("--screenshot", command.screenshot, "FILE", "Write the window as it was when it closed")
      .ends_in({".png"})
      .writes();
  options.begin_group("Camera (scenes)");
  add_camera(options, picture.camera);
  options.begin_group("Swatch (fabric files)");
  picture.swatch.repeats = V2i(4, 4);
  add_repeats(options, picture.swatch);
  add_light(options, picture);
  options.add_check([&options, &picture] { check_picture(options, picture); });
}

/// A swatch of a fabric as a scene. Throws Failure.
LoadedScene load_swatch(const ShowCommand& command) {
  const std::string& path = command.picture.input;
  LoadedScene loaded;
  const Fabric& fabric = loaded.fabrics.emplace_back(
      value_or_throw(read_fabric(path, {.memory = command.picture.limits.document.memory})));
  loaded.scene = value_or_throw(make_swatch(fabric, command.picture.swatch)).scene;
  loaded.scene.fabrics.emplace_back().name = path.substr(path.find_last_of('/') + 1);
  return loaded;
}

/// Adds an environment to choose from.
void offer(const std::string& name, const Environment& environment, ShowState& state) {
  state.environments.push_back(
      std::make_shared<const Surroundings>(Surroundings{name, environment, split_light(environment)}));
}

/// Throws Failure.
ShowState first_state(const ShowCommand& command, const Window& window, const ShowPicture& picture) {
  // Beside the panel.
  const V2i size = picture_size(window);
  const double aspect = static_cast<double>(size.x) / size.y;
  ShowState state = value_or_throw(picture.first_state(command.picture.camera, aspect));
  Look look = value_or_throw(
      look_of(command.picture, scene_lights(picture.scene()), command.picture.limits.document.memory));
  state.display = look.display;
  state.lights = std::move(look.lights);
  state.lights_in_camera_frame = look.lights_in_camera_frame;
  state.ambient_irradiance = static_cast<float>(command.picture.ambient_irradiance);
  state.has_backdrop = command.picture.has_backdrop;
  state.backdrop_roughness = command.picture.backdrop_roughness;
  if (look.environment) {
    Environment plain = *look.environment;
    const EnvironmentOptions around = std::exchange(plain.options, {});
    state.environment_turn = static_cast<float>(around.turn_degrees);
    state.environment_strength = static_cast<float>(around.strength);
    state.environment = 0;
    offer(look.environment_name, plain, state);
    report_remarks(command.common, look.environment_name, plain.remarks);
  }
  if (look.environment_name != "studio") offer("studio", studio_environment(), state);
  state.shadow_map_size = look.shadow_map_size;
  state.levels = command.picture.levels;
  state.layers = command.picture.layers;
  state.image_memory_bytes = std::size_t{1} * command.picture.image_memory_mib << 20;
  // The first directional light, which drags can turn.
  const auto found = std::ranges::find(state.lights, LightKind::directional, &Light::kind);
  if (found != state.lights.end()) state.dragged_light = found - state.lights.begin();
  return state;
}

Result<int> run(const ShowCommand& command) {
  limit_mesa_threads(command.common.threads);
  const bool is_fabric = has_ending(command.picture.input, ".exr");
  std::vector<std::string> files;
  std::vector<std::string> folders;
  for (const std::string& path : command.fabrics) {
    std::error_code unknown;
    (std::filesystem::is_directory(path, unknown) ? folders : files).push_back(path);
  }
  GarmentWriter writer = make_garment_writer(command.picture.limits);
  std::string garment = command.picture.input;
  std::optional<Motion> motion;
  const auto load = [&] { return value_or_throw(load_first_clip(garment, command.picture.limits, motion)); };
  LoadedScene scene = is_fabric ? load_swatch(command) : load();
  if (!is_fabric && !files.empty() && has_no_fabric(scene.scene)) {
    garment = writer.dress(garment, files.front());
    scene = load();
    files.erase(files.begin());
  }
  report_remarks(command.common, "note", scene.scene.remarks);
  const auto window = value_or_throw(Window::open("Selvedge: " + command.picture.input, command.size));
  const GlFunctions gl = value_or_throw(load_gl_functions(*window->context()));
  auto picture = value_or_throw(
      ShowPicture::create(std::move(scene.scene), std::move(scene.fabrics), std::move(motion)));
  for (const std::string& path : files) value_or_throw(picture->add_fabric(path));
  ShowState state = first_state(command, *window, *picture);
  state.frame_seconds = 1 / command.fps;
  PictureThread background(std::move(picture), garment, command.picture.input, command.picture.limits,
                           std::move(writer), [] { Window::wake(); });
  for (const std::string& folder : folders) background.add_file(folder);
  ShowLoop show(
      {command.picture.input, command.screenshot, command.common.json || !command.screenshot.empty()},
      *window, background, gl, state);
  show.run();
  report(command.common, "show", show.to_json(), "");
  return 0;
}

}  // namespace

void add_show_verb(Program& program) {
  program.add<ShowCommand>(
      {"show", "Open a window in which a scene can be handled",
       "selvedge-view show sweater.glb\n"
       "selvedge-view show sweater.glb --fabric rib.fabric.exr --azimuth 30",
       "Mouse: left drag turns around the garment, middle drag (or Shift + left) moves it, right drag (or\n"
       "Ctrl + left) turns the light, the wheel comes nearer. Keys: C without fabrics,\n"
       "Space and left and right: the clip. P probe, F next fabric, B compares by a bar, S saves the "
       "picture, D the garment, R first view, H "
       "panel, Escape\n"
       "closes. Files and folders can be dropped on the window; a garment without fabrics is dressed in the "
       "first.\n"
       "Without a display the exit status is 1.\n"},
      declare, run);
}

}  // namespace selvedge
