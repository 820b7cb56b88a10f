// Flicker of pictures that move: selvedge-bench-flicker FOLDER SCENE.glb [CLIP] [PIXELS ...]
//
// 24 frames of an orbit by a degree each, or of a clip at 30 a second, at 320 x 256 in the studio, with 8 and
// 30 (PIXELS) pixels a repeat in the picture's middle. I: by `render`'s default accuracy, and as `show`
// moves; R: with 8 x 8 rays a pixel, kept as files in FOLDER. dB and the 99.9th percentile of the absolute
// values of (I_t - I_t-1) - (R_t - R_t-1), as displayed, 1 being white; of I - R; and CPU seconds of a frame.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "format/base/srgb.h"
#include "format/picture/display.h"
#include "format/picture/environment.h"
#include "format/picture/image.h"
#include "tests/bench/need.h"
#include "viewer/accuracy.h"
#include "viewer/light/shadows.h"
#include "viewer/load.h"
#include "viewer/show/picture.h"

namespace {

using namespace selvedge;
using bench::need;

constexpr V2i size(320, 256);
constexpr double aspect = static_cast<double>(size.x) / size.y;
constexpr int frame_count = 24;

/// Red, green and blue of its pixels, as displayed.
using Pixels = std::vector<float>;

Pixels shown(const Image& image, bool is_linear) {
  Pixels pixels;
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    if (image.channels == 3 || i % 4 != 3)
      pixels.push_back(is_linear ? linear_to_srgb(image.pixels[i]) : image.pixels[i]);
  return pixels;
}

/// Errors, their count and their distribution.
struct Errors {
  double sum = 0;
  std::vector<float> values;
  void add(float error) {
    sum += static_cast<double>(error * error);
    values.push_back(std::abs(error));
  }
  double decibels() const { return -10 * std::log10(sum / static_cast<double>(values.size())); }
  float high() {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(values.size()));
    std::ranges::nth_element(values, at);
    return *at;
  }
};

struct Film {
  std::vector<Pixels> frames;
  double seconds = 0;  ///< of the processor
};

void print(const std::string& name, const Film& film, const Film& truth) {
  Errors still, moving;
  for (std::size_t t = 0; t < film.frames.size(); ++t) {
    for (std::size_t i = 0; i < film.frames[t].size(); ++i) {
      const float error = film.frames[t][i] - truth.frames[t][i];
      still.add(error);
      if (t > 0) moving.add(error - film.frames[t - 1][i] + truth.frames[t - 1][i]);
    }
  }
  fmt::print("{:32} flicker {:5.2f} dB, 99.9 % {:.4f}; still {:5.2f} dB; {:.3f} CPU s\n", name,
             moving.decibels(), moving.high(), still.decibels(), film.seconds / frame_count);
  std::fflush(stdout);
}

/// A garment, and what moves it.
class Scenes {
 public:
  Scenes(const std::string& path, bool has_clip) : path_(path) {
    loaded_ = has_clip ? need(load_first_clip(path, {}, motion_)) : need(load_scene(path));
  }
  void choose(const std::string& clip) { need(motion_->choose(clip)); }
  Film render(double pixels, bool as_truth) {
    LoadedScene loaded = loaded_;
    RenderOptions options;
    options.width = size.x;
    options.height = size.y;
    options.supersample = as_truth ? 8 : 1;
    options.cells.memory_bytes = std::size_t{as_truth ? 4000U : 160U} << 20;
    const auto studio = studio_environment();
    const EnvironmentLight light = split_light(studio);
    options.lights = light.lamps;
    options.smooth_light = light.smooth_light;
    options.environment = std::make_shared<const Environment>(studio);
    options.shadow_map_size = default_shadow_size;
    const auto renderer = need(Renderer::create(loaded.scene, loaded.fabrics, options));
    Film film;
    for (int t = 0; t < frame_count; ++t) {
      if (motion_) need(motion_->pose(t / 30.0, loaded.scene));
      const double begin = bench::cpu_seconds();
      if (motion_) need(renderer->replace(loaded.scene));
      const Camera camera = need(make_camera(box(), aspect, view(pixels, t)));
      PictureGoal goal;
      if (!as_truth) goal.accuracy_db = default_accuracy_db;
      goal.display = environment_display();
      Frame frame;
      RenderStats stats;
      need(draw_for_goal(*renderer, goal, options, camera, options, frame, stats));
      film.seconds += bench::cpu_seconds() - begin;
      film.frames.push_back(shown(to_display_image(frame, environment_display()), true));
    }
    return film;
  }
  Film window(double pixels) {
    const auto picture = need(ShowPicture::create(loaded_.scene, loaded_.fabrics, motion_));
    ShowState state = need(picture->first_state({}, aspect));
    state.environments = {std::make_shared<const Surroundings>(
        Surroundings{"studio", studio_environment(), split_light(studio_environment())})};
    state.environment = 0;
    state.display = environment_display();
    state.shadow_map_size = default_shadow_size;
    Film film;
    for (int t = -8; t < frame_count; ++t) {
      state.camera = view(pixels, t);
      state.clip_time = std::max(t, 0) / 30.0;
      const double begin = bench::cpu_seconds();
      need(picture->update(state, t == -8 ? Redraw::scene : Redraw::frame, size, 1));
      if (t < 0) continue;
      film.seconds += bench::cpu_seconds() - begin;
      film.frames.push_back(shown(to_display_image(picture->frame(), environment_display()), true));
    }
    return film;
  }
  Film truth(double pixels, const std::string& prefix) {
    Film film;
    const auto file = [&](int t) { return fmt::format("{}-{}-{:02}.exr", prefix, pixels, t); };
    if (!std::filesystem::exists(file(frame_count - 1))) {
      film = render(pixels, true);
      for (int t = 0; t < frame_count; ++t) {
        Image image{size.x, size.y, 3, {}};
        image.pixels = film.frames[t];
        need(write_exr(file(t), image));
      }
    }
    film.frames.clear();
    for (int t = 0; t < frame_count; ++t)
      film.frames.push_back(shown(need(read_image(file(t), Transfer::keep)), false));
    return film;
  }

 private:
  std::vector<V3d> box() const { return need(world_points(loaded_.scene)); }
  CameraOptions view(double pixels, int t) const {
    CameraOptions view;
    view.azimuth = motion_ ? 80 : t;
    view.elevation = 5;
    const auto points = box();
    Imath::Box3d bounds;
    for (const V3d& point : points) bounds.extendBy(point);
    view.look_at = bounds.center();
    view.distance = 2 * bounds.size().length();
    const Camera camera = need(make_camera(points, aspect, view));
    // Pixels of a repeat at the orbit's centre.
    const double metre = size.x / (2 * camera.window_half_size.x * *view.distance);
    view.zoom = pixels / (loaded_.fabrics[0].period_mm.x * 1e-3 * metre);
    return view;
  }
  std::string path_;
  std::optional<Motion> motion_;
  LoadedScene loaded_;
};

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() < 2) {
    fmt::print(stderr, "usage: selvedge-bench-flicker FOLDER SCENE.glb [CLIP|- [PIXELS ...]]\n");
    return 2;
  }
  const std::string clip = words.size() > 2 && words[2] != "-" ? words[2] : "";
  Scenes scenes(words[1], !clip.empty());
  if (!clip.empty()) scenes.choose(clip);
  const std::string stem = std::filesystem::path(words[1]).stem().string() + clip;
  std::vector<double> all{8, 30};
  if (words.size() > 3) all.clear();
  for (std::size_t i = 3; i < words.size(); ++i) all.push_back(std::stod(words[i]));
  for (const double pixels : all) {
    const Film truth = scenes.truth(pixels, words[0] + "/" + stem);
    print(fmt::format("{} {} px, render", stem, pixels), scenes.render(pixels, false), truth);
    print(fmt::format("{} {} px, window", stem, pixels), scenes.window(pixels), truth);
  }
  return 0;
}
