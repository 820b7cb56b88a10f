// The memory of cell images: bounded, and what that costs is told.
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "format/base/parallel.h"
#include "format/fabric/file.h"
#include "tests/require.h"
#include "tests/viewer/paths.h"
#include "viewer/renderer.h"

namespace selvedge {

TEST_CASE("cell images without room are coarser, alike for any number of threads, and the frame says so") {
  const Fabric yarn = test::need(read_fabric(SELVEDGE_SOURCE_DIR "/tests/data/kept/4.0/yarn.fabric.exr"));
  struct Case {
    std::string name;
    Fabric fabric;
    V2d repeats;  ///< around a ball
    CellImageOptions cells;
    std::size_t memory;
    double db;  ///< to a frame with room
    int band_rows = 0;
  };
  for (const Case& example : {Case{"yarn", yarn, {24, 12}, {}, 100'000, 28},
                              Case{"yarn that moves", yarn, {24, 12}, moving_cell_images, 100'000, 25},
                              Case{"bands that share patches", yarn, {8, 4}, {}, 200'000, 28, 8},
                              Case{"patches share images", yarn, {120, 60}, {}, 200'000, 40},
                              Case{"texels", test::random_fabric(64, 64, 3), {24, 12}, {}, 200'000, 22}}) {
    INFO(example.name);
    test::Setting setting;
    test::add(setting.scene, test::sphere(64, 32, example.repeats), test::material(0));
    setting.fabrics = {example.fabric};
    setting.options.width = 160;
    setting.options.height = 120;
    setting.options.band_rows = example.band_rows;
    setting.options.path = RenderPath::raster;
    setting.options.context = ContextKind::osmesa;
    setting.options.lights = default_lights(test::camera_of(setting));
    // Frames of an orbit; the last one.
    const auto drawn = [&](std::size_t memory, int frames) {
      setting.options.cells = example.cells;
      setting.options.cells.memory_bytes = memory;
      const auto renderer = test::need(Renderer::create(setting.scene, setting.fabrics, setting.options));
      Frame frame;
      for (int i = 4 - frames; i < 4; ++i) {
        setting.camera.azimuth = i;
        RenderStats stats;
        test::need(renderer->draw(test::camera_of(setting), setting.options, frame, stats));
        CHECK(stats.peak_image_bytes > 0);
        CHECK(stats.peak_image_bytes <= static_cast<std::int64_t>(memory));
        CHECK(stats.remarks.size() == (memory == example.memory ? 1 : 0));
      }
      return frame;
    };
    const Frame frame = drawn(example.memory, 4);
    for (const V4f& p : frame.pixels) CHECK(std::isfinite(p.x + p.y + p.z + p.w));
    const double db = test::decibels(frame, drawn(example.cells.memory_bytes, 4), 1);
    MESSAGE(example.name, ": ", db, " dB");
    CHECK(db > example.db);
    set_thread_limit(1);
    const bool rests = example.cells.remade_fraction == 1;
    CHECK(drawn(example.memory, rests ? 1 : 4).pixels == frame.pixels);
    set_thread_limit(0);
  }
}

}  // namespace selvedge
