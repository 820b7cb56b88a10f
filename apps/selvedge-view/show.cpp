#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "apps/common/shared_options.h"
#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/panel.h"
#include "apps/selvedge-view/picture_options.h"
#include "apps/selvedge-view/screen_texture.h"
#include "apps/selvedge-view/show_report.h"
#include "format/base/option_text.h"
#include "format/base/parallel.h"
#include "format/base/printable.h"
#include "format/fabric/file.h"
#include "format/picture/studio.h"
#include "viewer/load.h"

namespace selvedge {
namespace {

using Clock = std::chrono::steady_clock;

/// Seconds above which a frame is drawn smaller while the view moves.
constexpr double moving_budget = 0.05;
/// Seconds without movement after which the picture is drawn in full again.
constexpr double still_after = 0.15;
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
Result<LoadedScene> load_swatch(const ShowCommand& command) {
  Result<Fabric> fabric =
      read_fabric(command.picture.input, {.memory = command.picture.limits.document.memory});
  if (!fabric) return tl::unexpected(fabric.error());
  Result<Swatch> swatch = make_swatch(*fabric, command.picture.swatch);
  if (!swatch) return tl::unexpected(swatch.error());
  LoadedScene loaded{std::move(swatch->scene), {}};
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

/// The loop of `show`: state, picture and window, from event to event.
class Show {
 public:
  Show(const ShowCommand& command, Window& window, ShowPicture& picture, const GlFunctions& gl,
       const ShowState& state)
      : command_(command),
        window_(window),
        picture_(picture),
        gl_(gl),
        first_(state),
        state_(state),
        good_(state),
        panel_(window),
        shown_(gl),
        overlay_(gl) {}

  Result<void> run() {
    bool closing = false;
    while (!closing) {
      window_size_ = window_.size();
      if (window_size_.x == 0 || window_size_.y == 0) {
        window_.wait_for_events(idle);
        closing = window_.wants_to_close();
        continue;
      }
      const Result<bool> closes = step();
      if (!closes) return tl::unexpected(closes.error());
      closing = *closes || window_.wants_to_close();
      if (closing && !command_.screenshot.empty()) {
        if (auto good = write_window(gl_, window_size_, command_.screenshot); !good) return good;
      }
      window_.swap();
      if (closing) break;
      const double wait = divisor_ > 1 ? still_after / 3 : idle;
      if (settling_ > 0) --settling_;
      if (window_.wait_for_events(settling_ > 0 || refining_ || closes_after_ ? 0 : wait))
        settling_ = frames_to_settle;
    }
    return {};
  }

  Json to_json() const {
    const V3d look_at = state_.camera.look_at.value_or(V3d(0, 0, 0));
    Json all = {{"input", command_.picture.input},
                {"window", {window_size_.x, window_size_.y}},
                {"width", picture_.frame().width},
                {"height", picture_.frame().height},
                {"frames", frames_},
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
                {"fabricBytes", {{"read", picture_.bytes_read()}, {"inFiles", picture_.file_bytes()}}},
                {"message", message_}};
    all["warnings"] = Json::array();
    for (const Error& warning : picture_.warnings()) all["warnings"].push_back(to_line(warning));
    all["lights"] = Json::array();
    for (const Light& light : picture_.lights()) all["lights"].push_back(json_of(light));
    all["probe"] = probe_ ? json_of(*probe_, picture_) : Json();
    const RenderStats& s = picture_.stats();
    all["seconds"] = {{"prepare", s.prepare},
                      {"project", s.project},
                      {"shadows", s.shadows},
                      {"geometry", s.geometry},
                      {"readBack", s.read_back},
                      {"evaluation", s.evaluation},
                      {"frame", picture_.draw_seconds()},
                      {"display", picture_.display_seconds()},
                      {"window", window_seconds_}};
    return all;
  }

 private:
  /// One frame of the window without its swap. Returns whether the user wants to close it.
  Result<bool> step() {
    panel_.begin();
    size_ = panel_.picture_size(window_size_);
    ShowInput input = panel_.input(window_.poll_drags());
    if (const auto good = aim(input); !good) return tl::unexpected(good.error());
    const double aspect = static_cast<double>(size_.x) / size_.y;
    Change change = std::max(pending_, apply(input, aspect, picture_.size(), state_));
    pending_ = Change::none;
    if (input.moves()) moved_ = Clock::now();
    if (seconds_since(moved_) > still_after) {
      divisor_ = 1;
    } else if (input.moves()) {
      divisor_ = size_divisor(full_seconds_, moving_budget);
    }
    if (divisor_ != drawn_divisor_ || size_ != drawn_size_) change = std::max(change, Change::frame);
    if (const auto good = draw(change); !good) return tl::unexpected(good.error());
    if (const auto good = look(change); !good) return tl::unexpected(good.error());
    if (const auto good = refine(change); !good) return tl::unexpected(good.error());
    const Clock::time_point start = Clock::now();
    const PanelInfo info{picture_, probe_, window_seconds_, divisor_, window_.poll_keys(), message_};
    const PanelRequest request = panel_.edit(info, state_);
    handle(request);
    constexpr std::array<GLfloat, 4> black{0, 0, 0, 1};
    gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
    gl_.ClearNamedFramebufferfv(0, GL_COLOR, 0, black.data());
    panel_.end(shown_.name(), picture_.overlay().empty() ? 0 : overlay_.name());
    gl_.Finish();
    window_seconds_ = seconds_since(start);
    // What came before the wish to close is shown first.
    if (request.close && !closes_after_) closes_after_ = 2;
    return closes_after_ && (*closes_after_)-- == 0;
  }

  /// Steps of the wheel move towards the point under the cursor.
  Result<void> aim(ShowInput& input) {
    const std::optional<V2d> cursor = input.wheel > 0 ? panel_.cursor() : std::nullopt;
    if (!cursor) return {};
    const auto probe = picture_.probe(*cursor);
    if (!probe) return tl::unexpected(probe.error());
    if (*probe) input.seen = (*probe)->position;
    return {};
  }

  /// Updates the picture after a change and uploads it.
  Result<void> draw(Change change) {
    if (change == Change::none) return {};
    if (auto good = picture_.update(state_, change, size_, divisor_); !good) {
      // Back to the last good state, as not every path draws everything.
      if (frames_ == 0) return good;
      message_ = to_line(good.error());
      state_ = good_;
      if (auto again = picture_.update(state_, Change::scene, size_, divisor_); !again) return again;
    }
    good_ = state_;
    drawn_divisor_ = divisor_;
    drawn_size_ = size_;
    ++frames_;
    if (change >= Change::frame)
      full_seconds_ = (picture_.draw_seconds() + picture_.overlay_seconds()) * divisor_ * divisor_;
    const Frame& frame = picture_.frame();
    shown_.load(frame.width, frame.height, picture_.bytes().data());
    if (!picture_.overlay().empty()) overlay_.load(frame.width, frame.height, picture_.overlay().data());
    return {};
  }

  /// Adds samples to a picture that rests.
  Result<void> refine(Change change) {
    refining_ = false;
    if (change != Change::none || divisor_ > 1 || seconds_since(moved_) <= still_after) return {};
    const Result<bool> more = picture_.refine(state_);
    if (!more) return tl::unexpected(more.error());
    refining_ = *more;
    if (refining_) shown_.load(drawn_size_.x, drawn_size_.y, picture_.bytes().data());
    return {};
  }

  /// Updates the probe if it may have changed.
  Result<void> look(Change change) {
    const std::optional<V2d> cursor = state_.probes ? panel_.cursor() : std::nullopt;
    // The last probe stays while the mouse is on the panel.
    if (!cursor || panel_.holds() || (cursor == probed_ && change < Change::frame)) return {};
    probed_ = cursor;
    const auto probe = picture_.probe(*cursor);
    if (!probe) return tl::unexpected(probe.error());
    probe_ = *probe;
    return {};
  }

  void handle(const PanelRequest& request) {
    pending_ = request.change;
    if (request.resets_camera) {
      state_.camera = first_.camera;
      pending_ = std::max(pending_, Change::frame);
    }
    if (!request.add_fabric.empty()) {
      const auto added = picture_.add_fabric(request.add_fabric);
      message_ = added ? "" : to_line(added.error());
      if (added) pending_ = Change::scene;
    }
    for (const std::string& path : window_.poll_drops()) add_dropped(path);
    if (pending_ != Change::none) settling_ = frames_to_settle;
  }

  /// A fabric to choose from, or an environment, which is shown.
  void add_dropped(const std::string& path) {
    const auto fabric = picture_.add_fabric(path);
    message_ = "";
    if (fabric) {
      pending_ = Change::scene;
      return;
    }
    const auto environment = read_environment(path);
    if (!environment) {
      message_ = to_line((has_ending(path, ".exr") ? fabric.error() : environment.error()));
      return;
    }
    offer(path.substr(path.find_last_of('/') + 1), *environment, state_);
    state_.environment = static_cast<int>(state_.environments.size()) - 1;
    pending_ = std::max(pending_, Change::frame);
  }

  const ShowCommand& command_;
  Window& window_;
  ShowPicture& picture_;
  const GlFunctions& gl_;
  ShowState first_;
  ShowState state_;
  ShowState good_;  ///< the last state that could be drawn
  Panel panel_;
  ScreenTexture shown_;
  ScreenTexture overlay_;
  V2i window_size_{0, 0};
  V2i size_{0, 0};  ///< of the picture
  V2i drawn_size_{0, 0};
  int divisor_ = 1;
  int drawn_divisor_ = 0;
  Change pending_ = Change::scene;
  Clock::time_point moved_{};
  double full_seconds_ = 0;
  double window_seconds_ = 0;
  int settling_ = frames_to_settle;
  bool refining_ = false;            ///< samples of the picture are still to come
  std::optional<int> closes_after_;  ///< so many frames
  std::optional<V2d> probed_;
  std::optional<PixelProbe> probe_;
  std::string message_;
  std::int64_t frames_ = 0;
};

Result<ShowState> first_state(const ShowCommand& command, const ShowPicture& picture) {
  const double aspect = static_cast<double>(command.size.x) / command.size.y;
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
  state->texel_edges = command.texel_edges;
  // The first directional light, which drags can turn.
  const auto found = std::ranges::find(state->lights, LightKind::directional, &Light::kind);
  if (found != state->lights.end()) state->held_light = found - state->lights.begin();
  return state;
}

Result<int> run(const ShowCommand& command) {
  limit_mesa_threads(command.common.threads);
  const bool is_fabric = has_ending(command.picture.input, ".exr");
  Result<LoadedScene> swatch = is_fabric ? load_swatch(command) : LoadedScene{};
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
  const auto context = [&] { return (*window)->context(); };
  Result<std::unique_ptr<ShowPicture>> picture =
      is_fabric ? ShowPicture::create(std::move(swatch->scene), std::move(swatch->fabrics), context)
                : ShowPicture::create(std::move(*scene), context);
  if (!picture) return tl::unexpected(picture.error());
  for (const std::string& path : command.fabrics) {
    if (const auto good = (*picture)->add_fabric(path); !good) return tl::unexpected(good.error());
  }
  const Result<ShowState> state = first_state(command, **picture);
  if (!state) return tl::unexpected(state.error());
  Show show(command, **window, **picture, *gl, *state);
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
       "Ctrl + left) turns the light, the wheel comes nearer. Keys: E texel edges, P probe, F next\n"
       "fabric, R first view, H panel, Escape closes. Without a display the exit status is 1.\n"},
      declare, run);
}

}  // namespace selvedge
