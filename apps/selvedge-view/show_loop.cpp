#include "apps/selvedge-view/show_loop.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "apps/common/report.h"
#include "apps/selvedge-view/show_report.h"
#include "apps/selvedge-view/shown_command.h"
#include "format/base/option_text.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

/// Seconds that the window sleeps without events.
constexpr double idle = 0.5;
/// Frames that the panel needs to settle after an event.
constexpr int frames_to_settle = 3;

double seconds_from(std::chrono::steady_clock::time_point t) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - t).count();
}

}  // namespace

ShowLoop::ShowLoop(Options options, Window& window, BackgroundPicture& background, const GlFunctions& gl,
                   const ShowState& state)
    : options_(std::move(options)),
      window_(window),
      background_(background),
      gl_(gl),
      input_(options_.input),
      first_camera_(state.camera),
      state_(state),
      panel_(window),
      shown_(gl),
      settling_(frames_to_settle) {}

Result<void> ShowLoop::run() {
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
    if (closing && !options_.screenshot.empty()) {
      if (auto good = write_window(gl_, window_size_, options_.screenshot); !good) return good;
    }
    window_.swap();
    if (closing) break;
    if (settling_ > 0) --settling_;
    if (window_.wait_for_events(settling_ > 0 || closes_after_ ? 0 : idle)) settling_ = frames_to_settle;
  }
  return {};
}

Json ShowLoop::to_json() const {
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
              {"levels", {{"forced", state_.levels.forced}}},
              {"fabrics", state_.worn.fabrics},
              {"command", command()},
              {"message", message_}};
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

/// One frame of the window without its swap. Returns whether the user wants to close it.
Result<bool> ShowLoop::step() {
  const auto start = std::chrono::steady_clock::now();
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
  const PanelInfo info{
      *picture_, state_.probes ? probe_ : no_probe_, offers_, window_seconds_, window_.poll_keys(), message_};
  const PanelRequest request = panel_.edit(info, state_);
  change = std::max(change, request.change);
  if (request.resets_camera) {
    state_.camera = first_camera_;
    change = std::max(change, Change::frame);
  }
  const std::string stem = std::filesystem::path(input_).stem().string();
  if (request.saves_picture) background_.save_picture(stem);
  if (request.saves_garment) background_.save_garment(stem);
  if (!request.wears.empty()) background_.wear(request.wears);
  if (request.saves_picture || request.saves_garment || !request.wears.empty()) finished_ = false;
  if (request.copies) {
    panel_.copy(command());
    message_ = command().empty() ? "`render` draws flat swatches by other options"
                                 : "copied; \"save garment\" makes the file with these fabrics";
  }
  std::vector<std::string> files = window_.poll_drops();
  if (!request.add_file.empty()) files.push_back(request.add_file);
  for (const std::string& path : files) background_.add_file(path);
  if (!files.empty()) finished_ = false;
  // Steps of the wheel leave the point under the cursor where it is; nothing else does.
  if (change >= Change::frame && input.wheel == 0) aimed_.reset();
  // The last probe stays while the mouse is on the panel or turns the view.
  const std::optional<V2d> probed = cursor && !panel_.holds() ? cursor : requested_probe_;
  if (change != Change::none || size != requested_size_ || probed != requested_probe_)
    send_request(change, size, probed);
  if (change != Change::none) settling_ = frames_to_settle;
  constexpr std::array<GLfloat, 4> black{0, 0, 0, 1};
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
  gl_.ClearNamedFramebufferfv(0, GL_COLOR, 0, black.data());
  panel_.end(shown_.name());
  gl_.Finish();
  window_seconds_ = seconds_from(start);
  longest_step_ = std::max(longest_step_, window_seconds_);
  // Events before the request to close are shown first.
  if (request.close || window_.wants_to_close()) closes_ = true;
  if (closes_ && !closes_after_ && (finished_ || !options_.tells_the_end)) closes_after_ = 1;
  return closes_after_ && (*closes_after_)-- == 0;
}

/// Empty for a fabric.
std::string ShowLoop::command() const {
  if (has_ending(input_, ".exr")) return {};
  return command_of(input_, picture_->own_lights, state_, requested_size_);
}

void ShowLoop::send_request(Change change, const V2i& size, const std::optional<V2d>& probed) {
  request_number_ = background_.request({state_, change, size, probed, generation_});
  requested_size_ = size;
  requested_probe_ = probed;
  finished_ = false;
}

/// Takes the updates of the picture's thread.
Result<void> ShowLoop::receive() {
  RenderUpdate update = background_.poll();
  if (update.failure) return tl::unexpected(*update.failure);
  if (!update.messages.empty()) message_ = fmt::format("{}", fmt::join(update.messages, "\n"));
  for (const auto& environment : update.environments) {
    state_.environments.push_back(environment);
    state_.environment = static_cast<int>(state_.environments.size()) - 1;
    pending_ = Change::frame;
  }
  for (OfferedFabric& offer : update.offers) {
    const auto& made = offers_.emplace_back(std::make_unique<ShownOffer>(std::move(offer.path), gl_));
    made->picture.load(thumbnail_side, thumbnail_side, offer.picture.data());
  }
  if (update.garment) {
    input_ = update.garment->path;
    if (update.garment->camera) first_camera_ = state_.camera = *update.garment->camera;
    state_.worn = update.garment->worn;
    state_.beside.reset();
    state_.hidden.clear();
  }
  if (update.state) state_ = *update.state;
  if (update.worn) {
    state_.worn = *update.worn;
    state_.hidden.clear();
  }
  if (update.state || update.garment || update.worn) {
    pending_ = Change::frame;
    aimed_.reset();
  }
  generation_ = update.generation;
  probe_ = update.probe;
  if (update.probe && update.probe_request == request_number_) {
    aimed_ = update.probed;
    aim_ = update.probe->position;
  }
  finished_ = update.finished && pending_ == Change::none;
  if (!update.picture) return {};
  picture_ = update.picture;
  shown_.load(picture_->width, picture_->height, picture_->bytes.data());
  return {};
}

}  // namespace selvedge
