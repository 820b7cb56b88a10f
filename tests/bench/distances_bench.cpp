// Swatches of fabrics at any distance: PSNR of 24 pictures from near to far, and flicker of slow zooms,
// against 64 samples a pixel: selvedge-bench-distances [--rows FILE] [--zooms] [--points N] FABRIC.exr ...
#include <filesystem>

#include "format/fabric/file.h"
#include "format/scene/swatch.h"
#include "tests/bench/pictures.h"
#include "tests/bench/rows.h"
#include "viewer/renderer.h"

namespace {

using namespace selvedge;
using bench::need;

constexpr V2i size(320, 240);
constexpr int distances = 24;
constexpr double nearest = 2;  ///< repeats in the height of the picture
constexpr double farthest = 480;
constexpr int samples = 8;  ///< along either side of a pixel
constexpr int zoom_frames = 64;
constexpr double zoom_step = 1.004;

/// The cloth of one fabric, seen as from `middle` of `selvedge swatch`, but from other distances.
class Swatches {
 public:
  Swatches(Fabric fabric, const LevelOptions& levels)
      : fabrics_{std::move(fabric)}, period_(fabrics_[0].period_mm) {
    shot_ = swatch_shot(SwatchView::middle, period_, size.x, size.y);
    options_.width = size.x;
    options_.height = size.y;
    options_.lights = shot_.lights;
    options_.levels = levels;
    options_.context = ContextKind::osmesa;
  }

  Frame draw(double repeats, int supersample) {
    // The many samples are the same for all settings.
    RenderOptions options = options_;
    if (supersample > 1) options.levels = best_levels;
    options.supersample = supersample;
    constexpr double of_middle = 6;
    SwatchShot shot = shot_;
    const double factor = repeats / of_middle;
    shot.camera.position = shot_.camera.position * factor;
    shot.camera.near = shot_.camera.near * factor;
    shot.camera.far = shot_.camera.far * factor;
    return need(render(swatch_scene(period_, shot), fabrics_, shot.camera, options));
  }

 private:
  std::vector<Fabric> fabrics_;
  V2d period_;
  SwatchShot shot_;
  RenderOptions options_;
};

/// RMS of the second difference of three frames in a row, of 255.
double flicker(const std::vector<Frame>& frames) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t t = 1; t + 1 < frames.size(); ++t) {
    for (std::size_t i = 0; i < frames[t].pixels.size(); ++i) {
      const auto at = [&](std::size_t k) { return bench::displayed(frames[k].pixels[i], 1); };
      const double d = at(t - 1) - 2 * at(t) + at(t + 1);
      sum += d * d;
      ++count;
    }
  }
  return std::sqrt(sum / static_cast<double>(count));
}

void print_distances(Swatches& of, const std::string& name, bench::Rows& rows) {
  double least = 1e9;
  double sum = 0;
  fmt::print("| {} |", name);
  for (int i = 0; i < distances; ++i) {
    const double repeats = nearest * std::pow(farthest / nearest, i / (distances - 1.0));
    const double dB = bench::difference(of.draw(repeats, 1), of.draw(repeats, samples)).psnr;
    least = std::min(least, dB);
    sum += dB;
    fmt::print(" {:.1f} |", dB);
    std::fflush(stdout);
    rows.add(fmt::format("distance/{}/{:.3g}", name, size.y / repeats), dB, "dB");
  }
  fmt::print(" {:.1f} | {:.1f} |\n", least, sum / distances);
}

void print_zooms(Swatches& of, const std::string& name, bench::Rows& rows) {
  for (const int supersample : {1, samples}) {
    fmt::print("| {}, {} |", name, supersample == 1 ? "default" : "64 samples");
    for (const double pixels : {0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0}) {
      std::vector<Frame> frames;
      for (int t = 0; t < zoom_frames; ++t)
        frames.push_back(of.draw(size.y / pixels * std::pow(zoom_step, -t), supersample));
      const double steps = flicker(frames);
      fmt::print(" {:.2f} |", steps);
      std::fflush(stdout);
      rows.add(fmt::format("zoom/{}/{}/{}_samples", name, pixels, supersample * supersample), steps, "1/255");
    }
    fmt::print("\n");
  }
}

}  // namespace

int main(int argc, char** argv) {
  bench::Rows rows(argc, argv);
  std::vector<std::string> files = rows.arguments();
  const bool zooms = !files.empty() && files[0] == "--zooms";
  if (zooms) files.erase(files.begin());
  LevelOptions levels = best_levels;
  if (files.size() > 1 && files[0] == "--points") {
    levels.points = std::clamp(std::atoi(files[1].c_str()), 1, 8);
    files.erase(files.begin(), files.begin() + 2);
  }
  if (files.empty()) {
    fmt::print(stderr,
               "usage: selvedge-bench-distances [--rows FILE] [--zooms] [--points N] FABRIC.exr ...\n");
    return 2;
  }
  if (zooms) {
    fmt::print(
        "Zooms by 0.4 % a frame, {} frames: rms second difference of 255, by pixels a repeat at first\n\n",
        zoom_frames);
    fmt::print("| | 0.5 | 1 | 2 | 4 | 8 | 16 | 30 |\n|---|---|---|---|---|---|---|---|\n");
  } else {
    fmt::print("PSNR in dB from 64 samples a pixel, by pixels a repeat\n\n| |");
    for (int i = 0; i < distances; ++i)
      fmt::print(" {:.3g} |", size.y / nearest * std::pow(nearest / farthest, i / (distances - 1.0)));
    fmt::print(" least | mean |\n|---|");
    for (int i = 0; i < distances + 2; ++i) fmt::print("---|");
    fmt::print("\n");
  }
  for (const std::string& file : files) {
    Swatches of(need(read_fabric(file)), levels);
    std::string name = std::filesystem::path(file).stem().stem().string();
    if (zooms)
      print_zooms(of, name, rows);
    else
      print_distances(of, name, rows);
  }
  rows.write();
}
