// What mip levels, blending and filters are worth: a flat piece of fabric, turned by 17 degrees, drawn
// smaller and smaller, against a picture of at least two samples per texel of level 0: selvedge-bench-levels
// FABRIC.exr [--rows FILE]
#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/fabric/file.h"
#include "tests/bench/rows.h"
#include "viewer/renderer.h"

namespace {

using namespace selvedge;
using bench::need;

constexpr int side = 64;
constexpr int samples = 16;  ///< per pixel and side of the renderer's own supersampling

/// A square larger than the frame; a pixel is one unit of length wide, `texels` of level 0 long.
Scene cloth(double texels, int width) {
  Scene scene;
  ScenePrimitive p;
  const double turn = 17 * std::numbers::pi / 180;
  for (const V2d& c : {V2d(-1, 1), V2d(-1, -1), V2d(1, -1), V2d(1, 1)}) {
    const V2d at = c * 4.0 * side;
    p.positions.emplace_back(static_cast<float>(at.x), static_cast<float>(at.y), 0.0F);
    p.normals.emplace_back(0.0F, 0.0F, 1.0F);
    const V2d uv(at.x * std::cos(turn) + at.y * std::sin(turn),
                 at.x * std::sin(turn) - at.y * std::cos(turn));
    p.tex_coords[0].push_back(uv * (texels / width));
  }
  p.indices = {0, 1, 2, 0, 2, 3};
  p.material = 0;
  scene.primitives.push_back(p);
  scene.instances.emplace_back();
  SceneMaterial material;
  material.fabric = FabricReference{};
  material.alpha_mode = AlphaMode::blend;
  material.double_sided = true;
  scene.materials.push_back(material);
  return scene;
}

/// Seen from `degrees` above the cloth; 90: straight on.
Camera camera_at(double degrees, double zoom) {
  const double a = degrees * std::numbers::pi / 180;
  Camera camera;
  camera.projection = Projection::parallel;
  camera.up = V3d(0, std::sin(a), std::cos(a));
  camera.to_viewer = V3d(0, -std::cos(a), std::sin(a));
  camera.position = V3d(0, 0, 0);
  camera.window_half = V2d(side / 2.0, side / 2.0) / zoom;
  camera.near = -10.0 * side;
  camera.far = 10.0 * side;
  return camera;
}

Frame draw(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera, int size,
           int supersample, const LevelOptions& levels) {
  RenderOptions options;
  options.width = options.height = size;
  options.supersample = supersample;
  options.levels = levels;
  options.lights = {{V3d(-0.4, 0.5, 0.8).normalized(), V3f(2)}, {V3d(0.6, 0.1, 0.6).normalized(), V3f(0.6F)}};
  return need(render(scene, fabrics, camera, options));
}

/// Means of n x n boxes.
Frame shrink(const Frame& large, int n) {
  Frame small{large.width / n, large.height / n, {}};
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      V4f sum(0, 0, 0, 0);
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) sum += large.pixels[(y * n + j) * large.width + x * n + i];
      }
      small.pixels.push_back(sum / static_cast<float>(n * n));
    }
  }
  return small;
}

Frame reference(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera, double texels) {
  // Along the shorter axis of a grazing view a pixel holds more texels: four times as many samples.
  const int more = std::max(1, static_cast<int>(std::ceil(2 * texels * 4 / samples)));
  LevelOptions finest;
  finest.forced = 0;
  return shrink(draw(scene, fabrics, camera, side * more, samples, finest), more);
}

double shown(float linear) {
  const double c = std::clamp(static_cast<double>(linear), 0.0, 1.0);
  return c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
}

double psnr(const Frame& a, const Frame& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    for (unsigned c = 0; c < 3; ++c) {
      const double d = shown(a.pixels[i][c]) - shown(b.pixels[i][c]);
      sum += d * d;
    }
  }
  return -10 * std::log10(sum / (3 * static_cast<double>(a.pixels.size())));
}

/// RMS of the second difference of three frames in a row, in steps of an 8-bit picture.
double flicker(const std::vector<Frame>& frames) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t t = 1; t + 1 < frames.size(); ++t) {
    for (std::size_t i = 0; i < frames[t].pixels.size(); ++i) {
      const auto at = [&](std::size_t k) { return shown(frames[k].pixels[i].y); };
      const double d = at(t - 1) - 2 * at(t) + at(t + 1);
      sum += d * d;
      ++count;
    }
  }
  return 255 * std::sqrt(sum / static_cast<double>(count));
}

struct Mode {
  const char* name;
  LevelOptions levels;
};

const std::vector<Mode>& modes() {
  static const std::vector<Mode> all{{"level 0 alone", {.blend = false, .forced = 0}},
                                     {"nearest level", {.blend = false}},
                                     {"two levels", {}},
                                     {"by area", {.area = true}},
                                     {"by area, -1/2", {.bias = -0.5F, .area = true}},
                                     {"by area, -1", best_levels}};
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  bench::Rows rows(argc, argv);
  if (rows.arguments().size() != 1) {
    fmt::print(stderr, "usage: selvedge-bench-levels FABRIC.exr [--rows FILE]\n");
    return 2;
  }
  const std::vector<Fabric> fabrics{need(read_fabric(rows.arguments()[0]))};
  const int width = fabrics[0].levels[0].width;
  for (const double degrees : {90.0, 30.0, 15.0}) {
    fmt::print(
        "\nseen from {:.0f} degrees above the cloth: PSNR in dB by texels per pixel (across the view)\n",
        degrees);
    fmt::print("{:16}", "");
    const std::vector<double> zooms{0.25, 0.5, 1, 1.4, 2, 4, 8, 16};
    for (const double texels : zooms) fmt::print("{:8.2f}", texels);
    fmt::print("\n");
    std::vector<Frame> references;
    for (const double texels : zooms)
      references.push_back(reference(cloth(texels, width), fabrics, camera_at(degrees, 1), texels));
    for (const Mode& mode : modes()) {
      fmt::print("{:16}", mode.name);
      for (std::size_t i = 0; i < zooms.size(); ++i) {
        const double dB =
            psnr(draw(cloth(zooms[i], width), fabrics, camera_at(degrees, 1), side, 1, mode.levels),
                 references[i]);
        fmt::print("{:8.1f}", dB);
        rows.add(fmt::format("minified/{}_degrees/{}_texels/{}", degrees, zooms[i], mode.name), dB, "dB");
      }
      fmt::print("\n");
    }
  }
  fmt::print(
      "\nslow zoom, 1 % a frame, 24 frames, straight on: RMS second difference in 1/255, by texels per "
      "pixel\n");
  fmt::print("{:16}", "");
  const std::vector<double> starts{0.5, 1, 2, 4, 8};
  for (const double texels : starts) fmt::print("{:8.2f}", texels);
  fmt::print("\n");
  const auto zoom_row = [&](const char* name, const auto& frame_at) {
    fmt::print("{:16}", name);
    for (const double texels : starts) {
      std::vector<Frame> frames;
      for (int t = 0; t < 24; ++t) frames.push_back(frame_at(texels, std::pow(1.01, -t)));
      const double steps = flicker(frames);
      fmt::print("{:8.2f}", steps);
      rows.add(fmt::format("flicker/{}_texels/{}", texels, name), steps, "1/255");
    }
    fmt::print("\n");
  };
  for (const Mode& mode : modes()) {
    zoom_row(mode.name, [&](double texels, double zoom) {
      return draw(cloth(texels, width), fabrics, camera_at(90, zoom), side, 1, mode.levels);
    });
  }
  zoom_row("reference", [&](double texels, double zoom) {
    return reference(cloth(texels, width), fabrics, camera_at(90, zoom), texels);
  });
  rows.write();
}
