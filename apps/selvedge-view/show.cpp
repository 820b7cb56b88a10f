#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "apps/common/shared_options.h"
#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/panel.h"
#include "apps/selvedge-view/picture_options.h"
#include "apps/selvedge-view/screen_texture.h"
#include "apps/selvedge-view/show_report.h"
#include "apps/selvedge-view/shown_command.h"
#include "format/base/option_text.h"
#include "format/base/parallel.h"
#include "format/base/printable.h"
#include "format/fabric/file.h"
#include "format/picture/image.h"
#include "format/picture/studio.h"
#include "viewer/load.h"
#include "viewer/show/background.h"

namespace selvedge {
namespace {

using Clock = std::chrono::steady_clock;

/// Seconds that the window sleeps without events.
constexpr double idle = 0.5;
/// Frames that the panel needs to settle after an event.
constexpr int frames_to_settle = 3;

double seconds_since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

struct ShowCommand {
  CommonOptions common;
  PictureOptions picture;
  std::vector<std::string> fabrics;  ///< files to choose from
  V2i size{1280, 800};
  bool texel_edges = false;
  std::string screenshot;  ///< of the window as it was when it closed, .png; empty: none
};

void declare(Options& options, ShowCommand& command) {
  PictureOptions& picture = command.picture;
  options.common(command.common);
  add_input(options, picture);
  options.list("--fabric", command.fabrics, "FILE", "A fabric file to choose from; may be repeated");
  options.size("--size", command.size, "Size of the window", 1, 1'000'000);
  options.flag("--texel-edges", command.texel_edges, "Begin with lines where texels end");
  options.text("--screenshot", command.screenshot, "FILE", "Write the window as it was when it closed")
      .ends_in({".png"});
  options.group("Camera (scenes)");
  add_camera(options, picture.camera);
  options.number("--distance", picture.camera.distance, "METRES", "Metres from that point");
  options.group("Swatch (fabric files)");
  picture.swatch.repeats = V2i(4, 4);
  add_repeats(options, picture.swatch);
  add_light(options, picture);
  options.check([&options, &picture] { check_picture(options, picture); });
}

/// A swatch of a fabric as a scene.
struct LoadedSwatch {
  Scene scene;
  std::vector<Fabric> fabrics;  ///< those of Scene::fabrics
};
Result<LoadedSwatch> load_swatch(const ShowCommand& command) {
  Result<Fabric> fabric =
      read_fabric(command.picture.input, {.memory = command.picture.limits.document.memory});
  if (!fabric) return tl::unexpected(fabric.error());
  Result<Swatch> swatch = make_swatch(*fabric, command.picture.swatch);
  if (!swatch) return tl::unexpected(swatch.error());
  LoadedSwatch loaded{std::move(swatch->scene), {}};
  SceneFabric source;
  source.name = command.picture.input.substr(command.picture.input.find_last_of('/') + 1);
  loaded.scene.fabrics.push_back(source);
  loaded.fabrics.push_back(std::move(*fabric));
  return loaded;
}

/// Adds an environment to choose from.
void offer(const std::string& name, const Environment& environment, ShowState& state) {
  state.environments.push_back(
      std::make_shared<const Surroundings>(Surroundings{name, environment, divide(environment)}));
}

/// The loop of `show`: from the events to a wish, from the newest picture to the window.
class Show {
 public:
  Show(const ShowCommand& command, Window& window, BackgroundPicture& background, const GlFunctions& gl,
       const ShowState& state)
      : command_(command),
        window_(window),
        background_(background),
        gl_(gl),
        input_(command.picture.input),
        first_camera_(state.camera),
        state_(state),
        panel_(window),
        shown_(gl),
        overlay_(gl) {}

  Result<void> run() {
    bool closing = false;
    while (!closing) {
      window_size_ = window_.size();
      if (window_size_.x == 0 || window_size_.y == 0) {
        window_.wait_for_events(idle);
        closing = closes_ || window_.wants_to_close();
        continue;
      }
      const Result<bool> closes = step();
      if (!closes) return tl::unexpected(closes.error());
      closing = *closes;
      if (closing && !command_.screenshot.empty()) {
        if (auto good = write_window(gl_, window_size_, command_.screenshot); !good) return good;
      }
      window_.swap();
      if (closing) break;
      if (settling_ > 0) --settling_;
      if (window_.wait_for_events(settling_ > 0 || closes_after_ ? 0 : idle)) settling_ = frames_to_settle;
    }
    return {};
  }

  Json to_json() const {
    const V3d look_at = state_.camera.look_at.value_or(V3d(0, 0, 0));
    Json all = {{"input", input_},
                {"window", {window_size_.x, window_size_.y}},
                {"width", picture_->width},
                {"height", picture_->height},
                {"frames", picture_->frames},
                {"threads", thread_count()},
                {"camera",
                 {{"azimuth", state_.camera.azimuth},
                  {"elevation", state_.camera.elevation},
                  {"fov", state_.camera.field_of_view},
                  {"distance", state_.camera.distance.value_or(0)},
                  {"lookAt", {look_at.x, look_at.y, look_at.z}}}},
                {"path", path_names[state_.path]},
                {"levels", {{"forced", state_.levels.forced}, {"blend", state_.levels.blend}}},
                {"fabrics", state_.fabrics},
                {"fabricBytes", {{"read", picture_->bytes_read}, {"inFiles", picture_->file_bytes}}},
                {"command", command()},
                {"message", message_}};
    all["warnings"] = Json::array();
    for (const Error& warning : picture_->warnings) all["warnings"].push_back(to_line(warning));
    all["lights"] = Json::array();
    for (const Light& light : picture_->lights) all["lights"].push_back(json_of(light));
    all["probe"] = probe_ ? json_of(*probe_, picture_->fabric_names) : Json();
    const RenderStats& s = picture_->stats;
    all["seconds"] = {{"prepare", s.prepare},
                      {"project", s.project},
                      {"shadows", s.shadows},
                      {"geometry", s.geometry},
                      {"readBack", s.read_back},
                      {"evaluation", s.evaluation},
                      {"frame", picture_->draw_seconds},
                      {"display", picture_->display_seconds},
                      {"window", window_seconds_},
                      {"longestStep", longest_step_}};
    return all;
  }

 private:
  /// Whether what is written at the end needs the picture and the probe of the last events.
  bool tells_the_end() const { return command_.common.json || !command_.screenshot.empty(); }

  /// One frame of the window without its swap. Returns whether the user wants to close it.
  Result<bool> step() {
    const Clock::time_point start = Clock::now();
    if (const auto good = receive(); !good) return tl::unexpected(good.error());
    panel_.begin();
    const V2i size = panel_.picture_size(window_size_);
    ShowInput input = panel_.input(window_.poll_drags());
    const std::optional<V2d> cursor = panel_.cursor();
    // Steps of the wheel move towards the point under the cursor, which stays there.
    if (input.wheel > 0 && cursor && cursor == aimed_) input.seen = aim_;
    const double aspect = static_cast<double>(size.x) / size.y;
    Change change = std::max(pending_, apply(input, aspect, picture_->size, state_));
    pending_ = Change::none;
    const PanelInfo info{*picture_, state_.probes ? probe_ : no_probe_, window_seconds_, window_.poll_keys(),
                         message_};
    const PanelRequest request = panel_.edit(info, state_);
    change = std::max(change, request.change);
    if (request.resets_camera) {
      state_.camera = first_camera_;
      change = std::max(change, Change::frame);
    }
    if (request.saves) save();
    if (request.copies) {
      panel_.copy(command());
      message_ = command().empty() ? "`render` draws flat swatches by other options"
                                   : "copied; `selvedge dress` sets fabrics, sizes and tints";
    }
    std::vector<std::string> files = window_.poll_drops();
    if (!request.add_file.empty()) files.push_back(request.add_file);
    for (const std::string& path : files) background_.add_file(path);
    if (!files.empty()) finished_ = false;
    // Steps of the wheel leave the point under the cursor where it is; nothing else does.
    if (change >= Change::frame && input.wheel == 0) aimed_.reset();
    // The last probe stays while the mouse is on the panel or turns the view.
    const std::optional<V2d> probed = cursor && !panel_.holds() ? cursor : wished_probe_;
    if (change != Change::none || size != wished_size_ || probed != wished_probe_) wish(change, size, probed);
    if (change != Change::none) settling_ = frames_to_settle;
    constexpr std::array<GLfloat, 4> black{0, 0, 0, 1};
    gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
    gl_.ClearNamedFramebufferfv(0, GL_COLOR, 0, black.data());
    panel_.end(shown_.name(), picture_->overlay.empty() ? 0 : overlay_.name());
    gl_.Finish();
    window_seconds_ = seconds_since(start);
    longest_step_ = std::max(longest_step_, window_seconds_);
    // What came before the wish to close is shown first.
    if (request.close || window_.wants_to_close()) closes_ = true;
    if (closes_ && !closes_after_ && (finished_ || !tells_the_end())) closes_after_ = 1;
    return closes_after_ && (*closes_after_)-- == 0;
  }

  /// Empty for a fabric.
  std::string command() const {
    if (has_ending(input_, ".exr")) return {};
    return command_of(input_, picture_->own_lights, state_, wished_size_);
  }

  /// Writes the picture to the first of NAME-1.png, NAME-2.png ... in this folder that is not there yet.
  void save() {
    const std::string stem = std::filesystem::path(input_).stem().string();
    std::string path;
    std::error_code unknown;
    for (int i = 1; path.empty() || std::filesystem::exists(path, unknown); ++i)
      path = fmt::format("{}-{}.png", stem, i);
    background_.save(path);
    finished_ = false;
  }

  void wish(Change change, const V2i& size, const std::optional<V2d>& probed) {
    wish_number_ = background_.set_wish({state_, change, size, probed, era_});
    wished_size_ = size;
    wished_probe_ = probed;
    finished_ = false;
  }

  /// What the thread of the picture has to tell.
  Result<void> receive() {
    PictureNews news = background_.poll();
    if (news.failure) return tl::unexpected(*news.failure);
    if (!news.messages.empty()) message_ = fmt::format("{}", fmt::join(news.messages, "\n"));
    for (const auto& environment : news.environments) {
      state_.environments.push_back(environment);
      state_.environment = static_cast<int>(state_.environments.size()) - 1;
      pending_ = Change::frame;
    }
    if (news.state) state_ = *news.state;
    if (news.garment) {
      input_ = news.garment->path;
      first_camera_ = state_.camera = news.garment->camera;
      state_.fabrics = news.garment->fabrics;
      state_.fits = news.garment->fits;
      state_.hidden.clear();
    }
    if (news.state || news.garment) {
      pending_ = Change::frame;
      aimed_.reset();
    }
    era_ = news.era;
    probe_ = news.probe;
    if (news.probe && news.probe_wish == wish_number_) {
      aimed_ = news.probed;
      aim_ = news.probe->position;
    }
    finished_ = news.finished && pending_ == Change::none;
    if (!news.picture) return {};
    picture_ = news.picture;
    shown_.load(picture_->width, picture_->height, picture_->bytes.data());
    if (!picture_->overlay.empty())
      overlay_.load(picture_->width, picture_->height, picture_->overlay.data());
    return {};
  }

  const ShowCommand& command_;
  Window& window_;
  BackgroundPicture& background_;
  const GlFunctions& gl_;
  std::string input_;  ///< the garment or fabric that is shown
  CameraOptions first_camera_;
  ShowState state_;
  Panel panel_;
  ScreenTexture shown_;
  ScreenTexture overlay_;
  std::shared_ptr<const ShownPicture> picture_ = std::make_shared<const ShownPicture>();
  V2i window_size_{0, 0};
  Change pending_ = Change::scene;
  V2i wished_size_{0, 0};
  std::optional<V2d> wished_probe_;
  int era_ = 0;
  bool finished_ = false;  ///< the picture and the probe are those of the last wish
  double window_seconds_ = 0;
  double longest_step_ = 0;  ///< seconds from events to the window that shows them
  int settling_ = frames_to_settle;
  bool closes_ = false;
  std::optional<int> closes_after_;  ///< so many frames
  std::optional<PixelProbe> probe_;
  std::uint64_t wish_number_ = 0;
  std::optional<V2d> aimed_;  ///< where the mouse was ...
  V3d aim_{0, 0, 0};          ///< ... over this point, world, m
  const std::optional<PixelProbe> no_probe_;
  std::string message_;
};

Result<ShowState> first_state(const ShowCommand& command, const Window& window, const ShowPicture& picture) {
  // Beside the panel.
  const V2i size = picture_size(window);
  const double aspect = static_cast<double>(size.x) / size.y;
  Result<ShowState> state = picture.first_state(command.picture.camera, aspect);
  if (!state) return state;
  PictureOptions plain = command.picture;
  plain.around = {};
  Result<Look> look = look_of(plain, lights_of(picture.scene()), RenderPath::hybrid);
  if (!look) return tl::unexpected(look.error());
  state->display = look->display;
  state->lights = std::move(look->lights);
  state->lights_in_camera_frame = look->lights_in_camera_frame;
  state->ambient = static_cast<float>(command.picture.ambient);
  state->turn = static_cast<float>(command.picture.around.turn);
  state->strength = static_cast<float>(command.picture.around.strength);
  state->backdrop = command.picture.backdrop;
  state->backdrop_blur = command.picture.backdrop_blur;
  if (look->environment) {
    state->environment = 0;
    offer(look->name, *look->environment, *state);
  }
  if (look->name != "studio") offer("studio", studio(), *state);
  state->shadows = look->shadows;
  state->levels = command.picture.levels;
  state->layers = command.picture.layers;
  if (command.texel_edges) state->overlay = static_cast<int>(Overlay::texels);
  // The first directional light, which drags can turn.
  const auto found = std::ranges::find(state->lights, LightKind::directional, &Light::kind);
  if (found != state->lights.end()) state->held_light = found - state->lights.begin();
  return state;
}

Result<int> run(const ShowCommand& command) {
  limit_mesa_threads(command.common.threads);
  const bool is_fabric = has_ending(command.picture.input, ".exr");
  Result<LoadedSwatch> swatch = is_fabric ? load_swatch(command) : LoadedSwatch{};
  if (!swatch) return tl::unexpected(swatch.error());
  Result<OpenScene> scene =
      is_fabric ? OpenScene{} : open_scene(command.picture.input, {}, command.picture.limits);
  if (!scene) return tl::unexpected(scene.error());
  if (!command.common.quiet) {
    for (const std::string& remark : scene->scene.remarks)
      fmt::print(stderr, "selvedge-view: note: {}\n", printable(remark));
  }
  Result<std::unique_ptr<Window>> window = Window::open("Selvedge: " + command.picture.input, command.size);
  if (!window) return tl::unexpected(window.error());
  const Result<GlFunctions> gl = load_gl_functions(*(*window)->context());
  if (!gl) return tl::unexpected(gl.error());
  Result<std::unique_ptr<ShowPicture>> picture =
      is_fabric ? ShowPicture::create(std::move(swatch->scene), std::move(swatch->fabrics))
                : ShowPicture::create(std::move(*scene));
  if (!picture) return tl::unexpected(picture.error());
  for (const std::string& path : command.fabrics) {
    if (const auto good = (*picture)->add_fabric(path); !good) return tl::unexpected(good.error());
  }
  const Result<ShowState> state = first_state(command, **window, **picture);
  if (!state) return tl::unexpected(state.error());
  BackgroundPicture background(std::move(*picture), command.picture.limits, [] { Window::wake(); });
  Show show(command, **window, background, *gl, *state);
  if (const auto good = show.run(); !good) return tl::unexpected(good.error());
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
       "Ctrl + left) turns the light, the wheel comes nearer. Keys: E texel edges, W triangles, C without\n"
       "fabrics, P probe, F next fabric, S saves the picture, R first view, H panel, Escape closes.\n"
       "Without a display the exit status is 1.\n"},
      declare, run);
}

}  // namespace selvedge
