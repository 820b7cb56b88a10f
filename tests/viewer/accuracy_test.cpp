// Pictures for an accuracy, or for a time, against the picture with 64 rays a pixel.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
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
  best.cells.samples_per_pixel_side = image_samples(8);
  const Frame best_frame = test::render_or_fail(ball.scene, ball.fabrics, camera, best);
  const auto renderer = test::need(Renderer::create(ball.scene, ball.fabrics, ball.options));
  struct Row {
    double wanted;
    float behind;
  };
  for (const auto& [wanted, behind] :
       {Row{20, 0.18F}, Row{34, 0.18F}, Row{38, 0.18F}, Row{34, 1}, Row{38, 1}}) {
    DisplayOptions display = default_display();
    display.background = V3f(behind);
    const Image truth = to_display_image(best_frame, display);
    Frame frame;
    RenderStats stats;
    const AccuratePicture picture = test::need(
        draw_for_goal(*renderer, {wanted, {}, display}, ball.options, camera, ball.options, frame, stats));
    const Image shown = to_display_image(frame, display);
    double sum = 0;
    for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
      const auto value = [&](const Image& image) {
        return linear_to_srgb(std::min(std::max(image.pixels[i], 0.0F), 1.0F));
      };
      sum += std::pow(value(shown) - value(truth), 2);
    }
    const double true_accuracy = -10 * std::log10(sum / static_cast<double>(truth.pixels.size()));
    MESSAGE(wanted, " dB asked over ", behind, ", ", picture.accuracy_db, " estimated, ", true_accuracy,
            " true, ", picture.supersample);
    CHECK(picture.accuracy_db >= wanted);
    CHECK(true_accuracy >= wanted - 0.7);
    CHECK(std::abs(picture.accuracy_db - true_accuracy) < 3);
  }
}

TEST_CASE("dark cloth in whose holes a bright floor shows has no pixel brighter than with 64 rays") {
  Ball ball;
  ball.fabrics = {test::lambert_fabric(8, V3f(0.02F), 0.9F)};
  ball.options.width = ball.options.height = 120;
  const Camera camera = test::camera_for(ball.scene, ball.options);
  DisplayOptions display = default_display();
  display.background = V3f(0.8F);
  const auto renderer = test::need(Renderer::create(ball.scene, ball.fabrics, ball.options));
  const auto draw = [&](int supersample, const PictureGoal& goal, AccuratePicture& picture) {
    FrameSize size = ball.options;
    size.supersample = supersample;
    DrawOptions options = ball.options;
    options.cells.samples_per_pixel_side = image_samples(supersample);
    Frame frame;
    RenderStats stats;
    picture = test::need(draw_for_goal(*renderer, goal, size, camera, options, frame, stats));
    return frame;
  };
  AccuratePicture picture, other;
  const Frame truth = draw(8, {}, other);
  const auto specks = [&](const Frame& frame) {
    std::vector<std::uint8_t> shown, true_bytes;
    to_display_bytes(frame, display, shown);
    to_display_bytes(truth, display, true_bytes);
    int count = 0;
    for (std::size_t i = 0; i < shown.size(); ++i) count += shown[i] > true_bytes[i] + 12 ? 1 : 0;
    return count;
  };
  CHECK(specks(draw(2, {}, other)) > 0);
  const Frame frame = draw(1, {default_accuracy_db, {}, display}, picture);
  CHECK(specks(frame) == 0);
  const double true_db = frame_psnr_db(frame, truth, display);
  MESSAGE(picture.accuracy_db, " dB estimated, ", true_db, " true, ", picture.supersample);
  CHECK(picture.supersample == 2);
  CHECK(true_db > default_accuracy_db);
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
    CHECK(test::need(draw_for_goal(*renderer, goal, ball.options, camera, ball.options, frame, stats))
              .accuracy_db > 10);
    camera.position += V3d(0, 100, 0);
    CHECK(test::need(draw_for_goal(*renderer, goal, ball.options, camera, ball.options, frame, stats))
              .accuracy_db > 100);
  }
}

TEST_CASE("a picture for a time is whole: magnified where the time is short, with all rays where it is not") {
  Ball ball;
  ball.options.width = 300;
  ball.options.height = 200;
  const Camera camera = test::camera_for(ball.scene, ball.options);
  RenderOptions best = ball.options;
  best.supersample = 8;
  best.cells.samples_per_pixel_side = image_samples(8);
  const Frame truth = test::render_or_fail(ball.scene, ball.fabrics, camera, best);
  const auto renderer = test::need(Renderer::create(ball.scene, ball.fabrics, ball.options));
  struct Row {
    double seconds;
    int supersample, magnification;
    double accuracy;
  };
  for (const Row& row : {Row{1e-6, 1, 2, 20}, Row{3600, 8, 1, 60}}) {
    Frame frame;
    RenderStats stats;
    const AccuratePicture picture = test::need(
        draw_for_goal(*renderer, {{}, row.seconds}, ball.options, camera, ball.options, frame, stats));
    CHECK(picture.supersample == row.supersample);
    CHECK(picture.magnification == row.magnification);
    REQUIRE(frame.pixels.size() == truth.pixels.size());
    const double true_db = frame_psnr_db(frame, truth);
    CHECK(true_db > row.accuracy);
    const bool is_known = picture.accuracy_db > 0;  // not where the time to compare was too short
    CHECK((row.magnification == 1 ? is_known : !is_known || std::abs(picture.accuracy_db - true_db) < 4));
  }
}

}  // namespace
}  // namespace selvedge
