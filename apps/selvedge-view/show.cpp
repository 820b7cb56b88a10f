// show: the window. From the events to a request, from the newest picture to the window.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "apps/common/report.h"
#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/garment_writer.h"
#include "apps/selvedge-view/panel.h"
#include "apps/selvedge-view/picture_options.h"
#include "apps/selvedge-view/screen_texture.h"
#include "format/base/option_text.h"
#include "format/fabric/file.h"
#include "format/picture/environment.h"
#include "viewer/load.h"
#include "viewer/scene/change_fabrics.h"
#include "viewer/show/background.h"

namespace selvedge {
namespace {

Json json_of(const PixelProbe& probe, const std::vector<std::string>& fabrics) {
  Json texels = Json::array();
  for (const ProbedTexel& t : probe.texels)
    texels.push_back({{"level", t.level}, {"texel", t.texel}, {"weight", t.weight}});
  Json fabric;
  if (probe.fabric >= 0) fabric = fabrics[probe.fabric];
  return {{"pixel", probe.pixel},      {"back", probe.is_back},
          {"fabric", fabric},          {"uv", probe.uv},
          {"texels", texels},          {"view", probe.to_viewer},
          {"lights", probe.to_lights}, {"radiance", probe.radiance},
          {"alpha", probe.alpha}};
}

std::string triple(const auto& v) { return fmt::format("{},{},{}", v.x, v.y, v.z); }

/// The command line of `render` that draws what the window shows. `input` is a garment, `own` are the lights
/// of its file. Lights that the panel or options changed become white ones, spots points. What the panel did
/// to fabrics, their size and tint is not part of it: `selvedge dress` does that.
std::string command_of(const std::string& input, const std::vector<Light>& own, const ShowState& state,
                       const V2i& size) {
  std::string line = "selvedge-view render " + shell_word(input);
  const auto add = [&](const char* option, const auto& value) {
    line += fmt::format(" {}={}", option, value);
  };
  const CameraOptions& camera = state.camera;
  add("--size", fmt::format("{}x{}", size.x, size.y));
  add("--azimuth", camera.azimuth);
  add("--elevation", camera.elevation);
  add("--fov", camera.field_of_view);
  add("--look-at", triple(camera.look_at.value_or(V3d(0, 0, 0))));
  add("--distance", camera.distance.value_or(0));
  if (state.clip >= 0) {
    add("--animation", state.clip);
    add("--time", state.clip_time);
  }
  add("--path", path_names[state.path]);
  if (state.levels.forced_level >= 0) add("--level", state.levels.forced_level);
  add("--layers", state.layers);
  if (state.image_memory_bytes != CellImageOptions{}.memory_bytes)
    add("--image-memory", state.image_memory_bytes >> 20);
  // The lights of `render` without options.
  const bool in_environment = state.environment >= 0;
  const bool lamps = own.empty() && !in_environment;
  const bool plain = state.lights == (lamps ? key_and_fill_lights() : own) &&
                     (state.lights.empty() || state.lights_in_camera_frame == lamps);
  if (!plain) {
    bool in_camera_frame = false;
    for (const Light& light : state.lights) {
      const float strength = std::max({light.irradiance.x, light.irradiance.y, light.irradiance.z});
      if (light.kind == LightKind::directional) {
        add("--light", fmt::format("{},{}", triple(light.direction), strength));
        in_camera_frame = state.lights_in_camera_frame;
      } else {
        add("--point-light", fmt::format("{},{}", triple(light.position), strength));
      }
    }
    if (in_camera_frame) add("--light-frame", "camera");
  }
  if (in_environment) {
    add("--environment", shell_word(state.environments[state.environment]->name));
    add("--environment-turn", state.environment_turn);
    add("--environment-strength", state.environment_strength);
    if (state.has_backdrop) line += " --backdrop";
    if (state.has_backdrop) add("--backdrop-blur", state.backdrop_roughness);
  } else {
    add("--environment", "none");
  }
  add("--ambient", state.ambient_irradiance);
  add("--shadows", state.shadow_map_size);
  if (camera.projection == Projection::parallel) line += " --orthographic";
  add("--exposure", state.display.exposure);
  add("--tone-map", tone_curve_names[static_cast<std::size_t>(state.display.tone_curve)]);
  add("--background", state.display.background ? triple(*state.display.background) : "transparent");
  add("--supersample", ShowPicture::rest_samples_per_side);
  return line + " -o picture.png";
}

/// Seconds that the window sleeps without events.
constexpr double idle = 0.5;
/// Frames that the panel needs to settle after an event.
constexpr int frames_to_settle = 3;

class ShowLoop {
 public:
  struct Options {
    std::string input;                ///< the garment or fabric that is shown first
    std::string screenshot;           ///< of the window as it was when it closed, .png; empty: none
    bool needs_last_picture = false;  ///< the report after the end shows the picture of the last events
  };
  ShowLoop(Options options, Window& window, PictureThread& background, const GlFunctions& gl,
           const ShowState& state)
      : options_(std::move(options)), window_(window), background_(background), gl_(gl), state_(state) {}

  /// Until the window is closed. Throws Failure.
  void run() {
    bool closing = false;
    while (!closing) {
      window_size_ = window_.size();
      if (window_size_.x == 0 || window_size_.y == 0) {
        window_.wait_for_events(idle);
        closing = closes_ || window_.wants_to_close();
        continue;
      }
      closing = step();
      if (closing && !options_.screenshot.empty())
        value_or_throw(write_window(gl_, window_size_, options_.screenshot));
      window_.swap();
      if (closing) break;
      if (settling_ > 0) --settling_;
      if (window_.wait_for_events(settling_ > 0 || closes_after_ ? 0 : idle)) settling_ = frames_to_settle;
    }
  }
  Json to_json() const {
    Json all = {
        {"input", input_},
        {"window", window_size_},
        {"width", picture_->width},
        {"height", picture_->height},
        {"frames", picture_->frame_count},
        {"camera",
         {{"azimuth", state_.camera.azimuth},
          {"elevation", state_.camera.elevation},
          {"fov", state_.camera.field_of_view},
          {"distance", state_.camera.distance.value_or(0)},
          {"lookAt", state_.camera.look_at.value_or(V3d(0, 0, 0))}}},
        {"clip", {{"time", state_.clip_time}, {"plays", state_.plays_clip}, {"speed", state_.clip_speed}}},
        {"fabrics", state_.worn_fabrics.fabrics},
        {"command", command()},
        {"message", message_}};
    all["probe"] = probe_ ? json_of(*probe_, picture_->fabric_names) : Json();
    all["accuracy"] = picture_->accuracy_db > 0 ? Json(picture_->accuracy_db) : Json();
    all["seconds"] = {{"frame", picture_->draw_seconds}};
    for (const auto& [name, seconds] : render_seconds) all["seconds"][name] = picture_->stats.*seconds;
    return all;
  }

 private:
  /// One frame of the window without its swap. Returns whether the user wants to close it.
  bool step() {
    receive();
    panel_.begin();
    const V2i size = panel_.picture_size(window_size_);
    ShowInput input = panel_.input(window_.poll_drags());
    const std::optional<V2d> cursor = panel_.cursor();
    // Steps of the wheel move towards the point under the cursor, which stays there.
    if (input.wheel > 0 && cursor && cursor == aimed_) input.cursor_point = aim_;
    const double aspect = static_cast<double>(size.x) / size.y;
    Redraw change = std::max(pending_, apply(input, aspect, picture_->scene_diagonal, state_));
    pending_ = Redraw::none;
    double seconds = 0;
    clip_watch_.add_lap(seconds);
    // A window that closes waits for its last picture.
    if (state_.clip >= 0 && state_.plays_clip && !closes_) {
      state_.clip_time += seconds * static_cast<double>(state_.clip_speed);
      if (picture_->clip_seconds > 0) state_.clip_time = std::fmod(state_.clip_time, picture_->clip_seconds);
      change = std::max(change, Redraw::frame);
    }
    const PanelInfo info{*picture_, state_.shows_probe ? probe_ : no_probe_, offers_, window_.poll_keys(),
                         message_};
    const PanelRequest request = panel_.edit(info, state_);
    change = std::max(change, request.redraw);
    if (request.resets_camera) {
      state_.camera = first_camera_;
      change = std::max(change, Redraw::frame);
    }
    const std::string stem = std::filesystem::path(input_).stem().string();
    if (request.saves_picture) background_.save_picture(stem);
    if (request.saves_garment) background_.save_garment(stem);
    if (!request.wear_path.empty()) background_.wear(request.wear_path);
    if (request.saves_picture || request.saves_garment || !request.wear_path.empty()) finished_ = false;
    if (request.copies_command) {
      panel_.copy(command());
      message_ = command().empty() ? "`render` draws flat swatches by other options"
                                   : "copied; \"save garment\" makes the file with these fabrics";
    }
    std::vector<std::string> files = window_.poll_drops();
    if (!request.add_file.empty()) files.push_back(request.add_file);
    for (const std::string& path : files) background_.add_file(path);
    if (!files.empty()) finished_ = false;
    // Steps of the wheel leave the point under the cursor where it is; nothing else does.
    if (change >= Redraw::frame && input.wheel == 0) aimed_.reset();
    // The last probe stays while the mouse is on the panel or turns the view.
    const std::optional<V2d> probed = cursor && !panel_.is_mouse_pressed() ? cursor : requested_probe_;
    if (change != Redraw::none || size != requested_size_ || probed != requested_probe_)
      send_request(change, size, probed);
    if (change != Redraw::none) settling_ = frames_to_settle;
    constexpr std::array<GLfloat, 4> black{0, 0, 0, 1};
    gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
    gl_.ClearNamedFramebufferfv(0, GL_COLOR, 0, black.data());
    panel_.end(shown_.name());
    gl_.Finish();
    // Events before the request to close are shown first.
    if (request.close || window_.wants_to_close()) closes_ = true;
    if (closes_ && !closes_after_ && (finished_ || !options_.needs_last_picture)) closes_after_ = 1;
    return closes_after_ && (*closes_after_)-- == 0;
  }
  /// The command line of the picture; empty for a fabric.
  std::string command() const {
    if (has_ending(input_, ".exr")) return {};
    return command_of(input_, picture_->own_lights, state_, requested_size_);
  }
  void send_request(Redraw change, const V2i& size, const std::optional<V2d>& probed) {
    request_number_ = background_.request({state_, change, size, probed, generation_});
    requested_size_ = size;
    requested_probe_ = probed;
    finished_ = false;
  }
  /// Updates by the thread of the picture.
  void receive() {
    RenderUpdate update = background_.poll();
    if (update.failure) throw Failure{*update.failure};
    if (!update.messages.empty()) message_ = fmt::format("{}", fmt::join(update.messages, "\n"));
    for (const auto& environment : update.environments) {
      state_.environments.push_back(environment);
      state_.environment = static_cast<int>(state_.environments.size()) - 1;
      pending_ = Redraw::frame;
    }
    for (OfferedFabric& offer : update.offers) {
      const auto& made = offers_.emplace_back(std::make_unique<OfferThumbnail>(std::move(offer.path), gl_));
      made->picture.load(thumbnail_side, thumbnail_side, offer.picture.data());
    }
    if (update.garment) {
      input_ = update.garment->path;
      if (update.garment->camera) first_camera_ = state_.camera = *update.garment->camera;
      state_.worn_fabrics = update.garment->worn_fabrics;
      state_.clip = update.garment->clip;
      state_.clip_time = 0;
      state_.compared_fabrics.reset();
      state_.hidden_fabrics.clear();
    }
    if (update.state) state_ = *update.state;
    if (update.worn_fabrics) {
      state_.worn_fabrics = *update.worn_fabrics;
      state_.hidden_fabrics.clear();
    }
    if (update.state || update.garment || update.worn_fabrics) {
      pending_ = Redraw::frame;
      aimed_.reset();
    }
    generation_ = update.generation;
    probe_ = update.probe;
    if (update.probe && update.probe_request == request_number_) {
      aimed_ = update.probed_point;
      aim_ = update.probe->position;
    }
    finished_ = update.is_finished && pending_ == Redraw::none;
    if (!update.picture) return;
    picture_ = update.picture;
    shown_.load(picture_->width, picture_->height, picture_->bytes.data());
  }

  const Options options_;
  Window& window_;
  PictureThread& background_;
  const GlFunctions& gl_;
  std::vector<std::unique_ptr<OfferThumbnail>> offers_;
  std::string input_ = options_.input;  ///< the garment or fabric that is shown
  ShowState state_;
  CameraOptions first_camera_ = state_.camera;
  Panel panel_{window_};
  ScreenTexture shown_{gl_};
  std::shared_ptr<const ShownPicture> picture_ = std::make_shared<const ShownPicture>();
  V2i window_size_{0, 0};
  Redraw pending_ = Redraw::scene;
  V2i requested_size_{0, 0};
  std::optional<V2d> requested_probe_;
  int generation_ = 0;
  bool finished_ = false;            ///< picture and probe answer the last request
  int settling_ = frames_to_settle;  ///< frames that the panel still needs
  bool closes_ = false;
  std::optional<int> closes_after_;  ///< so many frames
  std::optional<PixelProbe> probe_;
  std::uint64_t request_number_ = 0;
  std::optional<V2d> aimed_;  ///< where the mouse was ...
  V3d aim_{0, 0, 0};          ///< ... over this point, world, m
  const std::optional<PixelProbe> no_probe_;
  std::string message_;
  Stopwatch clip_watch_;  ///< since the last frame of a clip
};

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
