// Pictures for an accuracy, or for a time, beside the picture with 64 rays a pixel.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "format/base/srgb.h"
#include "format/picture/display.h"
#include "tests/viewer/small_frames.h"
#include "viewer/accuracy.h"

namespace selvedge {
namespace {

struct Ball {
  Scene scene;
  std::vector<Fabric> fabrics{test::random_fabric(8, 8, 3)};
  RenderOptions options = test::small({test::from_the_side});
  Ball() { test::add(scene, test::sphere(64, 32, V2d(24, 12)), test::material(0)), scene.fabrics.resize(1); }
};

TEST_CASE("an estimated accuracy is near the true one, and at least what was asked for") {
  const Ball ball;
  const Camera camera = test::camera_for(ball.scene, ball.options);
  RenderOptions best = ball.options;
  best.supersample = 8;
  best.cells.samples = samples_of(8);
  const Image truth =
      to_display_image(test::render_or_fail(ball.scene, ball.fabrics, camera, best), default_display());
  const auto renderer = test::need(Renderer::create(ball.scene, ball.fabrics, ball.options));
  for (const double wanted : {20.0, 34.0, 40.0}) {
    Frame frame;
    RenderStats stats;
    const AccuratePicture picture =
        test::need(draw_for(*renderer, {wanted, {}}, ball.options, camera, ball.options, frame, stats));
    const Image shown = to_display_image(frame, default_display());
    double sum = 0;
    for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
      const auto value = [&](const Image& image) {
        return linear_to_srgb(std::min(std::max(image.pixels[i], 0.0F), 1.0F));
      };
      sum += std::pow(value(shown) - value(truth), 2);
    }
    const double true_accuracy = -10 * std::log10(sum / static_cast<double>(truth.pixels.size()));
    MESSAGE(wanted, " dB asked, ", picture.accuracy, " estimated, ", true_accuracy, " true, ",
            picture.supersample);
    CHECK(picture.accuracy >= wanted);
    CHECK(true_accuracy >= wanted - 0.7);
    CHECK(std::abs(picture.accuracy - true_accuracy) < 3);
  }
}

TEST_CASE("the smallest pictures end, and what shows nothing is exact") {
  Ball ball;
  for (const V2i& size : {V2i(1, 1), V2i(3, 9), V2i(40, 20)}) {
    ball.options.width = size.x;
    ball.options.height = size.y;
    Camera camera = test::camera_for(ball.scene, ball.options);
    const auto renderer = test::need(Renderer::create(ball.scene, ball.fabrics, ball.options));
    Frame frame;
    RenderStats stats;
    const PictureGoal goal{40.0, {}};
    CHECK(test::need(draw_for(*renderer, goal, ball.options, camera, ball.options, frame, stats)).accuracy >
          10);
    camera.position += V3d(0, 100, 0);
    CHECK(test::need(draw_for(*renderer, goal, ball.options, camera, ball.options, frame, stats)).accuracy >
          100);
  }
}

TEST_CASE("no time is enough for a first picture, and rows have as many rays as reported") {
  const Ball ball;
  const Camera camera = test::camera_for(ball.scene, ball.options);
  const auto renderer = test::need(Renderer::create(ball.scene, ball.fabrics, ball.options));
  for (const double seconds : {1e-6, 0.2}) {
    Frame frame;
    RenderStats stats;
    const AccuratePicture picture =
        test::need(draw_for(*renderer, {{}, seconds}, ball.options, camera, ball.options, frame, stats));
    CHECK(picture.rows.contains(picture.supersample));
    if (seconds < 1e-3) CHECK(picture.supersample <= 2);
    std::map<int, int> alike;
    std::vector<bool> is_known(frame.height);
    for (const auto& [supersample, rows] : picture.rows) {
      RenderOptions again = ball.options;
      again.supersample = supersample;
      again.cells.samples = samples_of(supersample);
      const Frame whole = test::render_or_fail(ball.scene, ball.fabrics, camera, again);
      for (int y = 0; y < frame.height; ++y) {
        float worst = 0;
        for (int i = y * frame.width; i < (y + 1) * frame.width; ++i)
          worst = std::max(worst, (frame.pixels[i] - whole.pixels[i]).length());
        if (worst < 2e-3F) ++alike[supersample], is_known[y] = true;
      }
      CHECK(alike[supersample] >= rows);
    }
    CHECK(std::ranges::count(is_known, true) == frame.height);
  }
}

}  // namespace
}  // namespace selvedge
