// Textures at the size that a frame shows, against frames with the whole picture.
#include "viewer/light/picture_textures.h"

#include <doctest/doctest.h>

#include <numbers>

#include "tests/require.h"
#include "tests/viewer/paths.h"
#include "viewer/accuracy.h"
#include "viewer/renderer.h"
#include "viewer/scene/mesh.h"

namespace selvedge {
namespace {

/// Waves of 32 pixels and, on top, of two, which no frame from afar shows.
SceneImage waves(int side) {
  Image image{side, side, 3, {}};
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double wide = std::sin((x + 2 * y) * std::numbers::pi / 16);
      const auto value = static_cast<float>(0.5 + 0.2 * wide + ((x + y) % 2 == 0 ? 0.2 : -0.2));
      image.pixels.insert(image.pixels.end(), {value, 0.5F * value, 1 - value});
    }
  }
  return {"waves", "image/png", test::need(encode_png(image))};
}

/// A square of 1 m that shows the picture once.
Scene picture_scene(SceneImage image) {
  Scene scene;
  SceneMaterial material = test::material(-1);
  material.base_color_texture.image = 0;
  material.unlit = true;
  test::add(scene, test::square(1), material);
  scene.images.push_back(std::move(image));
  return scene;
}

Camera camera_of(const Scene& scene, double zoom = 1) {
  CameraOptions options;
  options.projection = Projection::parallel;
  options.zoom = zoom;
  return test::need(make_camera(test::need(world_points(scene)), 1, options));
}

int halvings_of(const Scene& scene, const Camera& camera, int height) {
  const V3d origin(0, 0, 0);
  const auto surfaces = test::need(build_surfaces(scene, origin));
  std::vector<std::string> remarks;
  const Materials materials = materials_of(scene, surfaces, remarks);
  return shown_halvings(merge(surfaces), materials, origin, camera, height).at(0);
}

TEST_CASE("a picture is halved until its texels are about as large as the frame's pixels") {
  const Scene scene = picture_scene(waves(512));
  // The picture is as large as the frame, but for a margin.
  CHECK(halvings_of(scene, camera_of(scene), 2048) == 0);
  CHECK(halvings_of(scene, camera_of(scene), 512) == 0);
  const int far = halvings_of(scene, camera_of(scene), 64);
  CHECK(far >= 2);
  CHECK(far <= 3);
  CHECK(halvings_of(scene, camera_of(scene, 4), 64) == far - 2);
  CHECK(halvings_of(scene, camera_of(scene), 1) <= 9);
  // Behind the camera, or with all corners on one point of the picture.
  Camera away = camera_of(scene);
  away.window_centre = V2d(1e6, 0);
  CHECK(halvings_of(scene, away, 64) == halvings_of_hidden);
  Scene point = scene;
  for (V2d& uv : point.primitives[0].tex_coords[0]) uv = V2d(0.5, 0.5);
  CHECK(halvings_of(point, camera_of(scene), 64) == 0);
}

TEST_CASE(
    "a frame with halved textures equals the frame with whole ones, and does not depend on earlier frames") {
  const Scene scene = picture_scene(waves(512));
  RenderOptions options;
  options.width = options.height = 64;
  const auto draw = [&](Renderer& renderer, double zoom) {
    Frame frame;
    RenderStats stats;
    test::need(renderer.draw(camera_of(scene, zoom), options, frame, stats));
    return frame;
  };
  const auto first = test::need(Renderer::create(scene, {}, options));
  const Frame far = draw(*first, 1);
  const Frame near = draw(*first, 6);
  const auto second = test::need(Renderer::create(scene, {}, options));
  CHECK(draw(*second, 6).pixels == near.pixels);
  CHECK(draw(*second, 1).pixels == far.pixels);
  // A corner outside of the frame that magnifies the picture asks for all of it.
  Scene whole = scene;
  test::add(whole, test::square(1), whole.materials[0]);
  whole.instances.back().world.translate(V3d(0, 0, -1e-3));
  for (V2d& uv : whole.primitives.back().tex_coords[0]) uv *= 1e-3;
  const auto third = test::need(Renderer::create(whole, {}, options));
  CHECK(frame_psnr_db(draw(*third, 1), far) > 40);
}

TEST_CASE("a large picture is decoded once for all supersamplings of a still") {
  constexpr int side = 2100;
  const Image grey{side, side, 1, std::vector<float>(std::size_t{1} * side * side, 0.5F)};
  const Scene scene = picture_scene({"grey", "image/png", test::need(encode_png(grey))});
  RenderOptions options;
  options.width = options.height = 32;
  const auto renderer = test::need(Renderer::create(scene, {}, options));
  for (const int supersample : {2, 4, 2, 8, 3, 4}) {
    options.supersample = supersample;
    test::need(renderer->resize(options));
    Frame frame;
    RenderStats stats;
    test::need(renderer->draw(camera_of(scene), options, frame, stats));
    CHECK(stats.decoded_pictures == 1);
  }
}

TEST_CASE("textures that do not fit into the memory are refused, and fit into a smaller frame") {
  Scene scene = picture_scene(waves(512));
  scene.file = "a.gltf";
  scene.memory_left = 6 << 20;  // a whole one takes 12 MiB
  RenderOptions options;
  options.width = options.height = 1024;
  const auto renderer = test::need(Renderer::create(scene, {}, options));
  Frame frame;
  RenderStats stats;
  const Error error = test::error_of(renderer->draw(camera_of(scene), options, frame, stats));
  CHECK(error.code == Code::file_too_large);
  CHECK(error.file == "a.gltf");
  CHECK(error.message.find("--max-memory") != std::string::npos);
  options.width = options.height = 64;
  test::need(renderer->resize(options));
  test::need(renderer->draw(camera_of(scene), options, frame, stats));
}

TEST_CASE("a picture that ends early is told once, when a frame shows it, and drawn without") {
  Scene scene = picture_scene(waves(64));
  scene.images[0].bytes.resize(200);
  RenderOptions options;
  options.width = options.height = 32;
  const auto renderer = test::need(Renderer::create(scene, {}, options));
  Frame frame;
  RenderStats stats;
  for (int i = 0; i < 2; ++i) {
    test::need(renderer->draw(camera_of(scene, i + 1), options, frame, stats));
    CHECK(stats.remarks.size() == 1);
  }
}

}  // namespace
}  // namespace selvedge
