// Frames of dressed garments:
//   selvedge-bench-view --rates | --looks | --parts | --references FOLDER | --window FOLDER|- SCENE.glb ...
//   selvedge-bench-view --swatch FABRIC.exr PLACE WIDTH HEIGHT FINER PICTURE.png
// With --rates: frames of an orbit around a garment of yarn under two lamps fixed to it, and at rest, with 8,
// 15, 30 and 120 pixels a repeat and shadow maps: processor time, and, unless some surface wears no yarn, dB
// to the rays of tests/viewer/rays.h and fine power; --references writes pictures of these. With --looks:
// moving frames of every scene as the first one is seen whole, and with 30 pixels a repeat, under two lamps
// and in the studio; --parts: also dB to the first one's rays. With --window: as in `show`, which keeps 30
// frames a second; pictures into a folder, or "-". With --swatch: a picture by rays.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <numbers>

#include "format/base/parallel.h"
#include "format/picture/environment.h"
#include "format/picture/image.h"
#include "format/scene/swatch.h"
#include "tests/bench/need.h"
#include "tests/viewer/rays.h"
#include "viewer/light/shadows.h"
#include "viewer/load.h"
#include "viewer/renderer.h"
#include "viewer/show/picture.h"

namespace {

using namespace selvedge;
using bench::need;

constexpr V2i size(1920, 1080);
struct Subject {
  std::string name;
  LoadedScene loaded;
  std::vector<V3d> points;
  Camera camera(double zoom, double azimuth) const {
    CameraOptions view;
    view.zoom = zoom;
    view.azimuth = azimuth;
    return need(make_camera(points, static_cast<double>(size.x) / size.y, view));
  }
  /// Whether all surfaces do.
  bool wears_yarn() const {
    return std::ranges::all_of(loaded.scene.materials, [&](const SceneMaterial& m) {
      return m.fabric && loaded.fabrics[m.fabric->fabric].levels.front().yarns();
    });
  }
  std::unique_ptr<Renderer> renderer(const RenderOptions& options) const {
    return need(Renderer::create(loaded.scene, loaded.fabrics, options));
  }
};

Subject load(const std::string& path) {
  Subject subject{std::filesystem::path(path).stem().string(), need(load_scene(path)), {}};
  subject.points = need(world_points(subject.loaded.scene));
  return subject;
}

RenderOptions options_of(RenderPath path) {
  RenderOptions options;
  options.path = path;
  options.context = ContextKind::osmesa;
  options.width = size.x;
  options.height = size.y;
  return options;
}

/// Frames that a renderer draws, and what each takes, ms.
struct Drawing {
  std::unique_ptr<Renderer> renderer;
  Frame frame{};
  RenderStats stats{};
  std::vector<double> processor{};
  void draw(const Camera& camera, const RenderOptions& options) {
    const double start = bench::cpu_seconds();
    need(renderer->draw(camera, options, frame, stats));
    processor.push_back(1e3 * (bench::cpu_seconds() - start));
  }
};

/// Median of the last `count`.
double median(std::span<const double> values, std::size_t count) {
  std::vector<double> last(values.end() - static_cast<std::ptrdiff_t>(count), values.end());
  std::ranges::nth_element(last, last.begin() + static_cast<std::ptrdiff_t>(count / 2));
  return last[count / 2];
}

/// Linear light, white being 1, over grey.
Image over_grey(const Frame& frame) {
  Image image{frame.width, frame.height, 3, {}};
  for (const V4f& p : frame.pixels) {
    const V3f light = V3f(p.x, p.y, p.z) * std::numbers::pi_v<float> + V3f(0.18F * (1 - p.w));
    image.pixels.insert(image.pixels.end(), {light.x, light.y, light.z});
  }
  return image;
}

/// PSNR in dB, as displayed, of the middle of a frame to a smaller picture, where either shows something; NaN
/// without one.
double decibels(const Frame& frame, const Image& middle) {
  if (middle.pixels.empty()) return std::nan("");
  const Image shown = over_grey(frame);
  const auto displayed = [](float light) { return 255 * linear_to_srgb(std::clamp(light, 0.0F, 1.0F)); };
  double sum = 0;
  double count = 0;
  for (int y = 0; y < middle.height; ++y) {
    for (int x = 0; x < middle.width; ++x) {
      const int pixel =
          (y + (frame.height - middle.height) / 2) * frame.width + x + (frame.width - middle.width) / 2;
      V3f apart(0);
      for (int c = 0; c < 3; ++c)
        apart[c] = displayed(shown.pixels[3 * pixel + c]) -
                   displayed(middle.pixels[middle.channels * (y * middle.width + x) + c]);
      // Files are rounded to whole numbers.
      if (frame.pixels[pixel].w == 0 && apart.length() < 1) continue;
      sum += static_cast<double>(apart.length2());
      count += 3;
    }
  }
  return 10 * std::log10(255 * 255 * count / std::max(sum, 1e-9));
}

/// Power of displayed luminance above a quarter of a cycle a pixel, along rows and columns, in the middle of
/// a frame over a smaller picture's, where the frame shows something. The filter has the response 1/2 there,
/// 0.06 at an eighth and 0.94 at three eighths.
double fine_power(const Frame& frame, const Image& middle) {
  constexpr std::array filter{-1.0F, 0.0F, 9.0F, -16.0F, 9.0F, 0.0F, -1.0F};
  const auto luminance = [](const Image& image) {
    std::vector<float> luma;
    for (const float* p = image.pixels.data(); luma.size() < std::size_t{1} * image.width * image.height;
         p += image.channels)
      luma.push_back(
          linear_to_srgb(std::clamp(0.2126F * p[0] + 0.7152F * p[1] + 0.0722F * p[2], 0.0F, 1.0F)));
    return luma;
  };
  const std::array pictures{luminance(over_grey(frame)), luminance(middle)};
  const std::array widths{frame.width, middle.width};
  std::array power{0.0, 1e-9};
  for (int y = 3; y < middle.height - 3; ++y) {
    for (int x = 3; x < middle.width - 3; ++x) {
      const std::array at{
          (y + (frame.height - middle.height) / 2) * frame.width + x + (frame.width - middle.width) / 2,
          y * middle.width + x};
      if (frame.pixels[at[0]].w == 0) continue;
      for (std::size_t i = 0; i < 2; ++i) {
        for (const int step : {1, widths[i]}) {
          float sum = 0;
          for (int k = 0; k < 7; ++k) sum += filter[k] * pictures[i][at[i] + (k - 3) * step];
          power[i] += static_cast<double>(sum * sum);
        }
      }
    }
  }
  return power[0] / power[1];
}

/// References show the middle of a frame, one `part`th of either side.
struct View {
  const char* name;
  double pixels_of_a_repeat;
  double degrees;  ///< of a frame of the orbit
  double part;
};
constexpr std::array views{View{"whole", 8, 1, 2.5}, View{"patch of a line", 15, 1, 4},
                           View{"band", 30, 1, 4}, View{"close", 120, 0.5, 4}};

class Rates {
 public:
  explicit Rates(const Subject& subject) : subject_(subject) {
    options_.shadow_map_size = default_shadow_size;
    const Camera camera = subject.camera(1, 0);
    options_.lights = default_lights(camera);
    const auto probe = need(subject.renderer(options_)->probe_surface(camera, options_, size / 2));
    if (probe && probe->fabric >= 0)
      whole_ = subject.loaded.fabrics[probe->fabric].levels.front().width / probe->texels_per_pixel.x;
  }

  /// An image without pixels if some surface wears no yarn.
  Image reference(const View& view) const {
    if (!subject_.wears_yarn()) return {};
    return over_grey(test::march(subject_.loaded.scene, subject_.loaded.fabrics, camera(view, 0, view.part),
                                 V2i(V2d(size) / view.part), options_.lights, options_.shadow_map_size));
  }

  double pixels_of_whole() const { return whole_; }

  struct Moving {
    double milliseconds = 0;  ///< of the processor
    double decibels = 0;
    double power = 0;  ///< fine_power()
  };
  Moving moving(const View& view, bool in_studio, const Image& reference = {}) const {
    RenderOptions options = options_;
    if (in_studio) {
      const EnvironmentLight light = split_light(studio_environment());
      options.lights = light.lamps;
      options.smooth_light = light.smooth_light;
    }
    return move(view, options, 1, reference);
  }

  void measure(const View& view, const Image& reference) const {
    fmt::print("| {} | {:.0f} |", view.name, view.pixels_of_a_repeat);
    const auto add = [&](double value, int digits = 1) {
      if (std::isnan(value)) {
        fmt::print(" - |");
        return;
      }
      fmt::print(" {:.{}f} |", value, digits);
      std::fflush(stdout);
    };
    const Moving moving = move(view, options_, 4, reference);
    add(moving.milliseconds, 0);
    add(moving.decibels);
    add(moving.power, 2);
    RenderOptions options = options_;
    options.supersample = 2;
    Drawing rest{subject_.renderer(options)};
    rest.draw(camera(view, 0), options);
    add(rest.processor[0] / 1e3);
    add(decibels(rest.frame, reference));
    add(fine_power(rest.frame, reference), 2);
    fmt::print("\n");
  }

 private:
  /// Means over orbits that end in the reference's view. Each begins a frame earlier, so that other images
  /// are old at its end.
  Moving move(const View& view, RenderOptions options, int phases, const Image& reference) const {
    constexpr int frames = 16;
    options.cells = moving_cell_images;
    Moving mean;
    for (int phase = 0; phase < phases; ++phase) {
      Drawing drawing{subject_.renderer(options)};
      for (int i = -frames - phase; i <= 0; ++i) drawing.draw(camera(view, i), options);
      mean.milliseconds += median(drawing.processor, frames / 2) / phases;
      mean.decibels += decibels(drawing.frame, reference) / phases;
      mean.power += fine_power(drawing.frame, reference) / phases;
    }
    return mean;
  }
  /// A frame of the orbit, or its middle.
  Camera camera(const View& view, int frame, double part = 1) const {
    return subject_.camera(part * view.pixels_of_a_repeat / whole_, view.degrees * frame);
  }

  const Subject& subject_;
  RenderOptions options_ = options_of(RenderPath::raster);
  double whole_ = 1;  ///< pixels of a repeat at zoom 1
};

void write_references(const Subject& subject, const std::string& folder) {
  const Rates rates(subject);
  for (const View& view : views)
    need(write_png(fmt::format("{}/{:.0f}.png", folder, view.pixels_of_a_repeat), rates.reference(view)));
}

void frame_rates(const Subject& subject) {
  fmt::print(
      "{}: {} x {}, {} threads; ms of processor, dB to a march of rays, and power above a quarter of a cycle "
      "a pixel over the march's\n\n"
      "| view | pixels a repeat | moving | dB | power | at rest, CPU s | dB | power "
      "|\n|---|---|---|---|---|---|---|---|\n",
      subject.name, size.x, size.y, thread_count());
  const Rates rates(subject);
  for (const View& view : views) rates.measure(view, rates.reference(view));
}

/// In two lights; beside the time, its ratio to the first subject's under two lamps. `parts`: other subjects
/// are the first one without something, and dB are to the first one's rays.
void frame_looks(const std::vector<std::string>& files, bool parts) {
  fmt::print(
      "| scene | pixels a repeat, whole | two lamps, ms of processor | ratio{0} | studio | ratio | 30 pixels "
      "a repeat, two lamps | ratio{0} | studio | ratio |\n|---|---|---|---|---|---|---|---|---|---|{1}\n",
      parts ? " | dB" : "", parts ? "---|---|" : "");
  std::array<double, 2> first{};
  std::array<Image, 2> references;
  double zoom = 0;
  for (const std::string& file : files) {
    const Subject subject = load(file);
    const Rates rates(subject);
    if (zoom == 0) zoom = views[0].pixels_of_a_repeat / rates.pixels_of_whole();
    std::array seen{views[0], views[2]};
    seen[0].pixels_of_a_repeat = zoom * rates.pixels_of_whole();
    fmt::print("| {} | {:.1f} |", subject.name, seen[0].pixels_of_a_repeat);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (parts && first[i] == 0) references[i] = rates.reference(seen[i]);
      for (const bool in_studio : {false, true}) {
        const auto [ms, decibels, power] = rates.moving(seen[i], in_studio, references[i]);
        if (first[i] == 0) first[i] = ms;
        fmt::print(" {:.0f} | {:.2f} |", ms, ms / first[i]);
        if (parts && !in_studio) fmt::print(" {:.1f} |", decibels);
        std::fflush(stdout);
      }
    }
    fmt::print("\n");
  }
}

/// A swatch under the lights of `selvedge truth`, by 8 x 8 rays a pixel, or so many times more a side.
void write_swatch(const std::vector<std::string>& arguments) {
  const Fabric fabric = need(read_fabric(arguments.at(0)));
  const auto view = std::ranges::find(swatch_view_names, arguments.at(1)) - swatch_view_names.begin();
  const V2i picture(std::stoi(arguments.at(2)), std::stoi(arguments.at(3)));
  const int finer = std::stoi(arguments.at(4));
  const V2d period(fabric.period_mm);
  const SwatchShot shot =
      swatch_shot(all_swatch_views.at(view), period, picture.x * finer, picture.y * finer);
  const Frame fine =
      test::march(swatch_scene(period, shot), {&fabric, 1}, shot.camera, picture * finer, shot.lights);
  Frame frame{picture.x, picture.y, std::vector<V4f>(std::size_t{1} * picture.x * picture.y, V4f(0))};
  for (int i = 0; i < fine.width * fine.height; ++i)
    frame.pixels[i / fine.width / finer * picture.x + i % fine.width / finer] +=
        fine.pixels[i] / static_cast<float>(finer * finer);
  need(write_png(arguments.at(5), over_grey(frame)));
}

/// As the window shows a picture: values of 0 to 1 between the middles of its pixels, the first row on top.
Image magnified(const DrawnPicture& picture, const V2i& window) {
  Image shown{window.x, window.y, 3, {}};
  const V2i small(picture.width, picture.height);
  for (int y = window.y - 1; y >= 0; --y) {
    for (int x = 0; x < window.x; ++x) {
      const V2d middle = V2d(x + 0.5, y + 0.5) * V2d(small) / V2d(window) - V2d(0.5);
      const V2d place(std::clamp(middle.x, 0.0, small.x - 1.0), std::clamp(middle.y, 0.0, small.y - 1.0));
      const V2i low(place);
      const V2i high(std::min(low.x + 1, small.x - 1), std::min(low.y + 1, small.y - 1));
      const V2d part = place - V2d(low);
      for (int c = 0; c < 3; ++c) {
        const auto of_row = [&](int row) {
          const std::uint8_t* bytes = picture.bytes.data() + 4 * row * small.x + c;
          return bytes[4 * low.x] * (1 - part.x) + bytes[4 * high.x] * part.x;
        };
        shown.pixels.push_back(
            static_cast<float>((of_row(low.y) * (1 - part.y) + of_row(high.y) * part.y) / 255));
      }
    }
  }
  return shown;
}

/// Mean square of the differences to the middle of a picture, which goes into it.
double replace_middle(Image& picture, const Image& middle) {
  const int left = 3 * (picture.width - middle.width) / 2;
  double sum = 0;
  for (int y = 0; y < middle.height; ++y) {
    float* const row =
        picture.pixels.data() + 3 * (y + (picture.height - middle.height) / 2) * picture.width + left;
    for (int i = 0; i < 3 * middle.width; ++i)
      sum += std::pow(std::exchange(row[i], middle.pixels[3 * y * middle.width + i]) - row[i], 2);
  }
  return sum / static_cast<double>(middle.pixels.size());
}

/// Frames of `show` at 30 a second in a window of 1280 x 720, in the studio: in twelve seconds the garment
/// turns by 240 degrees while a repeat goes from 120 to 2 pixels. A frame takes the processor's time over the
/// threads, so that other programs do not matter; the garment goes on in that time. dB of a frame every two
/// seconds beside the picture at rest, in the middle; with a `folder` its picture, with the middle at rest.
void window_frames(const Subject& subject, const std::string& folder) {
  constexpr V2i window(1280, 720);
  constexpr int part = 4;
  constexpr double end = 12;
  const double whole = Rates(subject).pixels_of_whole() * window.y / size.y;
  const auto make = [&] { return need(ShowPicture::create(subject.loaded.scene, subject.loaded.fabrics)); };
  const auto moving = make(), rest = make();
  ShowState state = need(rest->first_state({}, static_cast<double>(window.x) / window.y));
  state.environments = {std::make_shared<const Surroundings>(
      Surroundings{"studio", studio_environment(), split_light(studio_environment())})};
  state.environment = 0;
  state.display = environment_display();
  state.shadow_map_size = default_shadow_size;
  FramePace pace;
  std::vector<double> taken;
  int steps = 0;
  double next = 0, least = HUGE_VAL;
  for (double now = -0.5; now < end;) {
    const double pixels = 120 * std::pow(60, -std::max(now, 0.0) / end);
    state.camera.azimuth = 240 * std::max(now, 0.0) / end;
    state.camera.zoom = pixels / whole;
    const double divisor = pace.size_divisor();
    const Redraw change = now == -0.5 ? Redraw::scene : Redraw::frame;
    const double start = bench::cpu_seconds();
    need(moving->update(state, change, window, divisor));
    const double seconds = (bench::cpu_seconds() - start) / thread_count();
    if (change == Redraw::frame) pace.add_frame(seconds, state.frame_seconds);
    now += change == Redraw::frame ? std::max(seconds, 1.0 / 60) : 0.001;
    if (now < 0) continue;
    taken.push_back(1e3 * seconds);
    steps += pace.size_divisor() != divisor ? 1 : 0;
    if (now < next) continue;
    ShowState middle = state;
    middle.camera.zoom *= part;
    need(rest->update(middle, next == 0 ? Redraw::scene : Redraw::frame, window / part, 1));
    while (need(rest->refine(middle))) {
    }
    next += 2;
    Image picture = magnified(moving->drawn(), window);
    const double decibels =
        -10 * std::log10(replace_middle(picture, magnified(rest->drawn(), window / part)));
    least = std::min(least, decibels);
    fmt::print("| {:.0f} px | {:.2f} | {:.1f} | {:.1f} |\n", 120 * std::pow(60, -(next - 2) / end), divisor,
               taken.back(), decibels);
    if (!folder.empty())
      need(write_png(fmt::format("{}/{:.0f}.png", folder, pixels), picture, Transfer::keep));
  }
  std::ranges::sort(taken);
  fmt::print("| 95 % | | {:.1f} | |\n| all | {} steps | {:.1f} | {:.1f} |\n", taken[taken.size() * 95 / 100],
             steps, taken.back(), least);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> files(argv + 1, argv + argc);
  const std::string mode = !files.empty() && files[0].starts_with("--") ? files[0] : "";
  const bool references = mode == "--references";
  const std::string folder = (references || mode == "--window") && files.size() > 1 ? files[1] : "";
  files.erase(files.begin(), files.begin() + (mode.empty() ? 0 : folder.empty() ? 1 : 2));
  if (files.empty() || !(mode == "--rates" || mode == "--looks" || mode == "--parts" || mode == "--swatch" ||
                         mode == "--window" || references)) {
    fmt::print(
        stderr,
        "usage: selvedge-bench-view --rates | --looks | --parts | --references FOLDER | --window FOLDER|- "
        "SCENE.glb ...\n");
    return 2;
  }
  if (mode == "--looks" || mode == "--parts") frame_looks(files, mode == "--parts");
  if (mode == "--swatch") write_swatch(files);
  if (mode == "--window") {
    window_frames(load(files.at(0)), files.size() > 1 ? files[1] : "");
    return 0;
  }
  if (mode == "--looks" || mode == "--parts" || mode == "--swatch") files.clear();
  for (const std::string& file : files) {
    const Subject subject = load(file);
    if (references && !subject.wears_yarn()) {
      fmt::print(stderr, "{}: references need yarn on all surfaces\n", file);
      return 1;
    }
    if (references) write_references(subject, folder);
    if (mode == "--rates") frame_rates(subject);
    if (mode == "--window") window_frames(subject, folder == "-" ? "" : folder);
  }
  return 0;
}
