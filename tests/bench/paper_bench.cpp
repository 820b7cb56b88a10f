// What the paper's 8 bits and its driver's levels cost: pictures of its path beside those of the hybrid one
// with nearest texels, one tap and two levels: selvedge-bench-paper SCENE.glb FABRIC.exr [--rows FILE]
#include <array>

#include "format/fabric/file.h"
#include "tests/bench/pictures.h"
#include "tests/bench/rows.h"
#include "viewer/load.h"
#include "viewer/renderer.h"
#include "viewer/swatch.h"

namespace {

using namespace selvedge;
using bench::need;

struct Shot {
  std::string name;
  Scene scene;
  std::vector<Fabric> fabrics;
  Camera camera;
  RenderOptions options;
};

Frame drawn(const Shot& shot, RenderPath path, const std::vector<Fabric>& fabrics,
            const LevelOptions& levels) {
  RenderOptions options = shot.options;
  options.path = path;
  options.levels = levels;
  return need(render(shot.scene, fabrics, shot.camera, options));
}

/// A fabric that shows the number of a level, 1 + its own.
Fabric numbered(const Fabric& like) {
  Fabric fabric;
  fabric.views = {1, 1};
  fabric.period_mm = like.period_mm;
  for (std::size_t k = 0; k < like.levels.size(); ++k) {
    FabricLevel level;
    level.width = like.levels[k].width;
    level.height = like.levels[k].height;
    level.add(LayerKind::table, 3, static_cast<float>(k + 1));
    fabric.levels.push_back(std::move(level));
  }
  return fabric;
}

/// How far the levels are apart that both paths take: the mean, and the share that is off by more than half a
/// level. Where both see something.
std::array<double, 2> level_differences(const Shot& shot) {
  std::vector<Fabric> fabrics;
  for (const Fabric& fabric : shot.fabrics) fabrics.push_back(numbered(fabric));
  Shot lit = shot;
  lit.options.layers = 1;
  lit.options.lights = {
      Light{shot.camera.projection == Projection::parallel ? shot.camera.to_viewer : shot.camera.back()}};
  const Frame a = drawn(lit, RenderPath::hybrid, fabrics, {});
  const Frame b = drawn(lit, RenderPath::paper, fabrics, {});
  double sum = 0;
  double far = 0;
  double pixels = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    // Below 1 the light is beneath the horizon.
    if (!(a.pixels[i].x > 0.5F && b.pixels[i].x > 0.5F)) continue;
    const double d = std::abs(static_cast<double>(a.pixels[i].x - b.pixels[i].x));
    sum += d;
    far += d > 0.5 ? 1 : 0;
    pixels += 1;
  }
  return {sum / pixels, far / pixels};
}

void compare(const Shot& shot, bench::Rows& rows) {
  LevelOptions finest;
  finest.forced = 0;
  LevelOptions nearest;
  nearest.blend = false;
  const auto apart = [&](const LevelOptions& levels) {
    return bench::difference(drawn(shot, RenderPath::hybrid, shot.fabrics, levels),
                             drawn(shot, RenderPath::paper, shot.fabrics, levels));
  };
  const bench::PictureDifference all = apart({});
  const bench::PictureDifference frames_alone = apart(finest);
  const bench::PictureDifference one_level = apart(nearest);
  const auto [mean, far] = level_differences(shot);
  fmt::print("| {} | {:.1f} | {:.0f} | {:.1f} % | {:.1f} | {:.0f} | {:.1f} | {:.3f} | {:.2f} % |\n",
             shot.name, all.psnr, all.largest, 100 * all.beyond_two, frames_alone.psnr, frames_alone.largest,
             one_level.psnr, mean, 100 * far);
  rows.add("paper_from_hybrid/" + shot.name, all.psnr, "dB");
  rows.add("paper_from_hybrid/" + shot.name + "/largest", all.largest, "1/255");
  rows.add("paper_from_hybrid/" + shot.name + "/level_0", frames_alone.psnr, "dB");
}

Shot of_scene(const std::string& name, const std::string& path, const CameraOptions& view,
              const std::vector<V3d>& lights_of_camera = {}) {
  OpenScene open = need(open_scene(path));
  Shot shot;
  shot.name = name;
  shot.fabrics = need(read_fabrics(open));
  shot.scene = std::move(open.scene);
  shot.options.width = 900;
  shot.options.height = 720;
  shot.camera = need(make_camera(need(world_points(shot.scene)), 1.25, view));
  shot.options.lights = default_lights(shot.camera);
  if (!lights_of_camera.empty()) shot.options.lights.clear();
  for (const V3d& direction : lights_of_camera)
    shot.options.lights.push_back(Light{from_camera_frame(shot.camera, direction.normalized())});
  return shot;
}

Shot of_swatch(const std::string& name, const std::string& path, const V3d& view, const V3d& light) {
  Shot shot;
  shot.name = name;
  shot.fabrics.push_back(need(read_fabric(path)));
  SwatchOptions options;
  options.repeats = V2i(4, 4);
  options.pixels_per_texel = 4;
  options.view = view;
  Swatch swatch = need(make_swatch(shot.fabrics.front(), options));
  shot.scene = std::move(swatch.scene);
  shot.camera = swatch.camera;
  shot.options.width = swatch.width;
  shot.options.height = swatch.height;
  shot.options.layers = 1;
  shot.options.lights = {Light{light.normalized()}};
  return shot;
}

}  // namespace

int main(int argc, char** argv) {
  bench::Rows rows(argc, argv);
  if (rows.arguments().size() != 2) {
    fmt::print(stderr, "usage: selvedge-bench-paper SCENE.glb FABRIC.exr [--rows FILE]\n");
    return 2;
  }
  const std::string& scene = rows.arguments()[0];
  const std::string& fabric = rows.arguments()[1];
  fmt::print(
      "| | PSNR (dB) | largest of 255 | beyond 2 | level 0: PSNR | largest | one level: PSNR | levels apart, "
      "mean "
      "| by more than half |\n|---|---|---|---|---|---|---|---|---|\n");
  CameraOptions view;
  view.azimuth = 25;
  view.elevation = 10;
  compare(of_scene("sweater", scene, view), rows);
  compare(of_scene("sweater, light grazing", scene, view, {V3d(1, 0.1, 0.05)}), rows);
  CameraOptions near = view;
  near.zoom = 9;
  near.focus = V2d(0.58, 0.24);
  compare(of_scene("sweater, near", scene, near), rows);
  CameraOptions half = view;
  half.distance_factor = 2;
  compare(of_scene("sweater, twice as far", scene, half), rows);
  CameraOptions far = view;
  far.distance_factor = 5;
  compare(of_scene("sweater, five times as far", scene, far), rows);
  compare(of_swatch("swatch", fabric, V3d(0, 0, 1), V3d(0.3, 0.4, 0.87)), rows);
  compare(of_swatch("swatch, light grazing", fabric, V3d(0, 0, 1), V3d(0.9, 0.4, 0.1)), rows);
  compare(of_swatch("swatch, view grazing", fabric, V3d(0.2, -0.9, 0.2), V3d(0.3, 0.4, 0.87)), rows);
  rows.write();
}
