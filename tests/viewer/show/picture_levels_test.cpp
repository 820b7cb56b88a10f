// Levels of fabrics that a picture reads from files as frames ask for them.
#include <doctest/doctest.h>

#include "format/fabric/file.h"
#include "tests/format/files.h"
#include "tests/require.h"
#include "tests/viewer/indexed.h"
#include "viewer/show/picture.h"

namespace selvedge {
namespace {

std::unique_ptr<ShowPicture> picture_of(const Scene& scene, const std::vector<Fabric>& fabrics) {
  return test::need(ShowPicture::create(scene, fabrics));
}

TEST_CASE("a long zoom reads each level once, and none before it is asked for") {
  const test::Folder folder;
  // Levels that are large beside the headers.
  Fabric fabric = test::random_fabric(64, 64, 7);
  test::need(write_fabric(folder / "a.exr", fabric));
  Scene scene;
  test::add(scene, test::square(40), test::material(0));
  OpenScene open;
  FabricReader reader = test::need(FabricReader::open(folder / "a.exr"));
  open.file_bytes = std::filesystem::file_size(folder / "a.exr");
  scene.fabrics.resize(1);
  open.scene = scene;
  open.readers.push_back(std::move(reader));
  const auto picture = test::need(ShowPicture::create(std::move(open)));
  const Fabric read = test::need(read_fabric(folder / "a.exr"));
  const auto whole = picture_of(scene, {read});
  CameraOptions far;
  far.distance = 60;
  auto state = test::need(picture->first_state(far, 1));
  state.levels = best_levels;
  state.lights = default_lights(Camera{});
  state.lights_in_camera_frame = true;
  std::uint64_t bytes = 0;
  int readings = 0;
  // There and back, and there again.
  for (const double step : {0.7, 1 / 0.7, 0.7}) {
    for (int i = 0; i < 22; ++i) {
      *state.camera.distance *= step;
      test::need(picture->update(state, Change::frame, V2i(60, 60), 1));
      test::need(whole->update(state, Change::frame, V2i(60, 60), 1));
      CHECK(picture->bytes() == whole->bytes());
      readings += picture->bytes_read() > bytes ? 1 : 0;
      if (i == 2 && readings < 3) CHECK(picture->bytes_read() < picture->file_bytes() / 4);
      bytes = picture->bytes_read();
    }
    CHECK(picture->fabrics()[0].first_level() == 0);
  }
  CHECK(readings >= 3);
  CHECK(readings <= 7);
  CHECK(bytes <= picture->file_bytes());
  // A level that is asked for by its number is counted as in the file.
  const auto forced = test::need(ShowPicture::create([&] {
    OpenScene again;
    again.scene = scene;
    again.readers.push_back(std::move(*FabricReader::open(folder / "a.exr")));
    return again;
  }()));
  state.levels.forced = 2;
  test::need(forced->update(state, Change::scene, V2i(60, 60), 1));
  test::need(whole->update(state, Change::frame, V2i(60, 60), 1));
  CHECK(forced->bytes() == whole->bytes());
  CHECK(forced->fabrics()[0].first_level() == 2);
  const auto probe = test::need(forced->probe(V2d(0.5, 0.5)));
  REQUIRE(probe.has_value());
  CHECK(probe->texels[0].level == 2);
}

TEST_CASE("a picture tells when it may ask for a level that a file does not have, finer or coarser") {
  const test::Folder folder;
  Scene scene;
  test::add(scene, test::sphere(24, 16, V2d(9, 5)), test::material(0));
  REQUIRE(write_fabric(folder / "a.exr", test::random_fabric(64, 64, 3)));
  auto whole = test::need(FabricReader::open(folder / "a.exr"));
  const auto part = test::need(whole.read_levels(2, 3));
  REQUIRE(write_fabric(folder / "b.exr", part));
  scene.fabrics.resize(1);
  scene.fabrics[0].name = "b.exr";
  OpenScene open;
  open.scene = scene;
  open.readers.push_back(std::move(*FabricReader::open(folder / "b.exr")));
  const auto level_by_level = test::need(ShowPicture::create(std::move(open)));
  const auto at_once = picture_of(scene, {part});
  for (ShowPicture* picture : {level_by_level.get(), at_once.get()}) {
    auto state = test::need(picture->first_state({}, 1));
    state.levels = best_levels;
    for (const auto& [distance, asked] : {std::pair{3.0, "levels 0-3 "}, std::pair{200.0, "levels 2-6 "}}) {
      state.camera.distance = distance;
      test::need(picture->update(state, Change::frame, V2i(400, 400), 1));
      REQUIRE(picture->warnings().size() == 1);
      CHECK(picture->warnings()[0].code == Code::fabric_levels);
      CHECK(picture->warnings()[0].file == "b.exr");
      CHECK(picture->warnings()[0].message.starts_with("the file has levels 2-3 of the whole, and "));
      CHECK(picture->warnings()[0].message.find(asked) != std::string::npos);
    }
    // A level that is chosen by its number is what was asked for.
    state.levels.forced = 2;
    test::need(picture->update(state, Change::frame, V2i(400, 400), 1));
    CHECK(picture->warnings().empty());
  }
}

}  // namespace
}  // namespace selvedge
