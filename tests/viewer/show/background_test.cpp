#include "viewer/show/background.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>

#include "format/fabric/file.h"
#include "tests/format/files.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/require.h"
#include "tests/viewer/shapes.h"

namespace selvedge {
namespace {

const V2i size(100, 80);

/// One triangle of 2 m without a fabric.
const std::string triangle = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
    "nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[2,2,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":
    "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAAAQAAAAAAAAAAAAAAAAAAAAEAAAAAA"}]})";

Scene square() {
  Scene scene;
  test::add(scene, test::square(3), test::material(0));
  scene.fabrics.resize(1);
  return scene;
}

std::unique_ptr<ShowPicture> picture_of(const Scene& scene) {
  return test::need(ShowPicture::create(scene, {test::random_fabric(16, 16, 1)}));
}

ShowState state_of(const ShowPicture& picture) {
  ShowState result = test::need(picture.first_state({}, 1.25));
  result.lights = default_lights(Camera{});
  return result;
}

/// Instead of the converter: whatever is dressed becomes a triangle without a fabric, and what is saved is
/// names.
GarmentWriter garment_writer() {
  return {[](const std::string& garment, const std::string& fabric) {
            test::write_bytes(fabric + ".gltf", triangle);
            return fabric + (garment.empty() ? "" : ".gltf");
          },
          [](const std::string& garment, const Scene& worn, const std::string& output) {
            const int fabric = worn.materials.front().fabric->fabric;
            test::write_bytes(output, garment + " in " + worn.fabrics[fabric].path);
            return std::string();
          }};
}

/// The window's side: keeps the last of everything that is told.
class Listener {
 public:
  explicit Listener(std::unique_ptr<ShowPicture> shown)
      : state(state_of(*shown)),
        background(std::move(shown), "square.glb", "square.glb", {}, garment_writer(), [] {}) {}

  /// Polls until `is_there`, which must be so within a time that only a dead thread takes.
  template <class Condition>
  void listen(Condition is_there) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    do {
      RenderUpdate now = background.poll();
      REQUIRE_FALSE(now.failure.has_value());
      if (now.picture) picture = now.picture;
      if (now.garment) {
        if (now.garment->camera) state.camera = *now.garment->camera;
        state.worn_fabrics = now.garment->worn_fabrics;
      }
      if (now.state) state = *now.state;
      if (now.worn_fabrics) state.worn_fabrics = *now.worn_fabrics;
      for (const OfferedFabric& offer : now.offers) offers.push_back(offer);
      if (now.garment) garment = now.garment->path;
      for (const std::string& line : now.messages) message = line;
      generation = now.generation;
      finished = now.is_finished;
      probe = now.probe;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      REQUIRE(std::chrono::steady_clock::now() < end);
    } while (!is_there());
  }
  void listen_to_the_end() {
    listen([&] { return finished; });
  }
  void send_request(Redraw change, const std::optional<V2d>& probed = {}) {
    background.request({state, change, size, probed, generation});
  }

  ShowState state;
  std::shared_ptr<const ShownPicture> picture;
  std::optional<PixelProbe> probe;
  std::vector<OfferedFabric> offers;
  std::string garment;
  std::string message;
  int generation = 0;
  bool finished = false;
  PictureThread background;
};

/// The picture at rest, made without a thread.
std::vector<std::uint8_t> bytes_at_rest(const ShowState& state) {
  const auto picture = picture_of(square());
  test::need(picture->update(state, Redraw::scene, size, 1));
  while (test::need(picture->refine(state))) {
  }
  return picture->drawn().bytes;
}

TEST_CASE("a picture made in the background ends as the one at rest, whatever was requested before") {
  Listener window(picture_of(square()));
  for (int i = 0; i < 60; ++i) {
    window.state.camera.azimuth = i;
    window.state.display.exposure = i % 7 == 0 ? 2 : 1;
    window.send_request(i == 0 ? Redraw::scene : i % 7 == 0 ? Redraw::display : Redraw::frame);
    if (i % 10 == 0) window.listen([&] { return true; });
  }
  const std::vector<std::uint8_t> expected = bytes_at_rest(window.state);
  window.listen([&] { return window.finished && window.picture->bytes == expected; });
  CHECK(window.picture->width == size.x);
  CHECK(window.picture->size_divisor == 1);
  // A further probe draws nothing.
  const std::int64_t frames = window.picture->frame_count;
  window.send_request(Redraw::none, V2d(0.5, 0.5));
  window.listen_to_the_end();
  REQUIRE(window.probe);
  CHECK(window.probe->pixel == V2i(50, 40));
  CHECK(window.picture->frame_count == frames);
  window.send_request(Redraw::display);
  window.listen_to_the_end();
  CHECK(window.picture->frame_count == frames);
}

TEST_CASE("an interrupted picture is drawn again in full") {
  const auto picture = picture_of(square());
  ShowState state = state_of(*picture);
  test::need(picture->update(state, Redraw::scene, size, 1));
  const std::vector<std::uint8_t> first = picture->drawn().bytes;
  state.camera.azimuth = 40;
  const std::atomic<bool> interrupted{true};
  test::need(picture->update(state, Redraw::frame, size, 1, &interrupted));
  CHECK(picture->drawn().bytes == first);
  CHECK_FALSE(test::need(picture->refine(state, &interrupted)));
  test::need(picture->update(state, Redraw::frame, size, 1));
  while (test::need(picture->refine(state))) {
  }
  CHECK(picture->drawn().bytes == bytes_at_rest(state));
}

TEST_CASE("what cannot be drawn is told, and the window goes back to what could be") {
  Listener window(picture_of(square()));
  window.send_request(Redraw::scene);
  window.listen_to_the_end();
  const ShowState good = window.state;
  // More texels of a shadow map than are allowed.
  window.state.shadow_map_size = 1 << 30;
  window.send_request(Redraw::frame);
  window.listen([&] { return window.generation == 1 && window.finished; });
  CHECK(window.message.find("OPTION_OUT_OF_RANGE") != std::string::npos);
  CHECK(window.state.shadow_map_size == good.shadow_map_size);
  const std::vector<std::uint8_t> expected = bytes_at_rest(good);
  window.listen([&] { return window.picture->bytes == expected; });
  // A request that was made before the window knew is dropped.
  ShowState late = good;
  late.worn_fabrics.fabrics.clear();
  window.background.request({late, Redraw::scene, size, {}, 0});
  window.send_request(Redraw::none);
  window.listen([&] { return window.finished && window.picture->bytes == expected; });
}

TEST_CASE("files that are added are another garment, an environment or an error") {
  const test::Folder folder;
  Listener window(picture_of(square()));
  window.send_request(Redraw::scene);
  window.listen_to_the_end();
  const auto first = window.picture;
  window.background.add_file(folder / "none.glb");
  window.listen([&] { return !window.message.empty(); });
  CHECK(window.message.find("none.glb") != std::string::npos);
  CHECK(window.message.find("FILE_MISSING") != std::string::npos);
  window.listen_to_the_end();
  CHECK(window.picture->materials == first->materials);
  test::write_bytes(folder / "triangle.gltf", triangle);
  window.background.add_file(folder / "triangle.gltf");
  window.listen([&] { return window.generation == 1; });
  window.send_request(Redraw::frame);
  window.listen_to_the_end();
  CHECK(window.message.empty());
  CHECK(window.picture->scene_diagonal == doctest::Approx(std::sqrt(8.0)));
  CHECK(window.state.worn_fabrics.fabrics == std::vector<int>(window.picture->materials.size(), -1));
}

TEST_CASE("the fabrics of a folder are offered with pictures, worn when chosen, and saved as they are worn") {
  const test::Folder folder;
  const Fabric cloth = test::random_fabric(8, 8, 2);
  for (const char* name : {"b.exr", "a.exr"}) test::need(write_fabric(folder / name, cloth));
  test::write_bytes(folder / "c.exr", "no fabric");
  test::write_bytes(folder / "d.txt", "no fabric either");
  Listener window(picture_of(square()));
  window.send_request(Redraw::scene);
  window.background.add_file(folder.path().string());
  window.listen([&] { return window.offers.size() == 2 && window.finished; });
  CHECK(window.offers[0].path == folder / "a.exr");
  CHECK(window.offers[1].path == folder / "b.exr");
  for (const OfferedFabric& offer : window.offers) {
    REQUIRE(offer.picture.size() == 4 * thumbnail_side * thumbnail_side);
    CHECK(std::ranges::max(offer.picture) > std::ranges::min(offer.picture));
  }
  window.listen([&] { return window.message.find("c.exr") != std::string::npos; });
  const std::vector<std::uint8_t> before = window.picture->bytes;
  CHECK(toggle_comparison(window.state) == Redraw::scene);
  window.send_request(Redraw::scene);
  window.listen_to_the_end();
  for (int i = 1; i <= 2; ++i) {  // the second time it is there
    window.background.wear(folder / "b.exr");
    window.listen([&] { return window.generation == i && window.finished; });
    CHECK(window.state.worn_fabrics.fabrics == std::vector<int>{1});
    CHECK(window.state.compared_fabrics.has_value());
    CHECK(window.picture->fabric_names.size() == 2);
    CHECK(window.picture->bytes != before);
  }
  window.background.save_garment(folder / "saved");
  window.listen([&] { return window.message.starts_with("saved"); });
  CHECK(test::bytes_of(folder / "saved-1.glb") == "square.glb in " + (folder / "b.exr"));
}

TEST_CASE("a fabric for a garment without one dresses it, under its own name") {
  const test::Folder folder;
  test::write_bytes(folder / "plain.gltf", triangle);
  Listener window(picture_of(square()));
  window.background.add_file(folder / "plain.gltf");
  window.listen([&] { return window.generation == 1; });
  window.background.wear(folder / "knit");
  window.listen([&] { return window.generation == 2; });
  CHECK(window.garment == folder / "plain.gltf");
  window.listen_to_the_end();
}

}  // namespace
}  // namespace selvedge
