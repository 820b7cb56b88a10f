#include "converter/measured/import.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "format/base/atomic_file.h"
#include "tests/format/files.h"
#include "tests/require.h"

namespace selvedge {
namespace {

/// A table of so many pictures in different directions, which are there; the others lines are added.
std::string table_of(const test::Folder& folder, int pictures, const std::string& more = {}) {
  std::string text = "# a comment\nexposure,file,light_x,light_y,light_z,view_x,view_y,view_z\n";
  for (int i = 0; i < pictures; ++i) {
    const std::string name = fmt::format("{}.png", i);
    test::write_bytes(folder / name, "");
    text += fmt::format("0.5, {} ,{},0,2,0,0,7\r\n", name, i);
  }
  const std::string path = folder / "t.csv";
  test::need(write_file(path, text + more));
  return path;
}

TEST_CASE("a table has its columns in any order, and directions of any length") {
  const test::Folder folder;
  const auto pictures = test::need(read_picture_table(table_of(folder, 20)));
  REQUIRE(pictures.size() == 20);
  CHECK(pictures[2].file == folder / "2.png");
  CHECK(pictures[2].exposure == 0.5);
  CHECK(pictures[2].table_line == 5);
  CHECK((pictures[2].pair.light - V3f(1, 0, 1) / std::sqrt(2.0F)).length() < 1e-6F);
  CHECK(pictures[2].pair.view == V3f(0, 0, 1));
}

TEST_CASE("a folder has the angles in its files' names, as UTIA's and Bonn's") {
  const test::Folder folder;
  for (int i = 0; i < 10; ++i) {
    const std::string view = fmt::format("tv015_pv{:03}", 36 * i);
    std::filesystem::create_directories(folder / view);
    test::write_bytes(folder / fmt::format("{0}/tl060_pl090_{0}.png", view), "");
    test::write_bytes(folder / fmt::format("WOOL_{:05}_tl000_pl000_{}.jpg", i, view), "");
  }
  test::write_bytes(folder / "readme.txt", "");
  const auto pictures = test::need(read_picture_table(folder.path().string()));
  REQUIRE(pictures.size() == 20);
  CHECK(pictures.front().pair.light == V3f(0, 0, 1));
  const MeasuredPicture& last = pictures.back();
  CHECK(last.file.ends_with("tv015_pv324/tl060_pl090_tv015_pv324.png"));
  CHECK((last.pair.light - V3f(0, std::sqrt(0.75F), 0.5F)).length() < 1e-6F);
  CHECK(last.pair.view.z == doctest::Approx(0.9659258));
  CHECK(last.pair.view.y == doctest::Approx(0.2588190 * -0.5877853));
  // At the horizon.
  test::write_bytes(folder / "tl090_pl000_tv000_pv000.png", "");
  CHECK(test::error_of(read_picture_table(folder.path().string()))
            .file.ends_with("tl090_pl000_tv000_pv000.png"));
}

TEST_CASE("bad tables are refused with the line") {
  const test::Folder folder;
  const auto refused = [&](const std::string& line, const std::string& why) {
    CAPTURE(line);
    const Error error = test::error_of(read_picture_table(table_of(folder, 20, line)));
    CHECK(error.code == Code::samples_malformed);
    CHECK(error.place == "line 23");
    CAPTURE(error.message);
    CHECK(error.message.find(why) != std::string::npos);
  };
  refused("1,none.png,1,9,1,0,0,1", "does not exist");
  refused("1,1.png,0,0,0,0,0,1", "the direction of the light has no length");
  refused("1,1.png,0,9,1,0,0,nan", "view_z is no number");
  refused("1,1.png,0,9,1,0,1,-0.1", "the view lies at or below the horizon");
  refused("1,1.png,0,9,1,0,0", "7 fields");
  refused("0,1.png,0,9,1,0,0,1", "exposure");
  refused("1,,0,9,1,0,0,1", "no file");
  refused("1,1.png,2,0,1,0,0,1", "has the directions of line 7");
  CHECK(test::error_of(read_picture_table(table_of(folder, 19))).message.starts_with("19 pictures"));
  test::need(write_file(folder / "t.csv", "file,light_x,light_y,light_z,view_x,view_y,veiw_z\n"));
  CHECK(test::error_of(read_picture_table(folder / "t.csv")).message.find("veiw_z") != std::string::npos);
  test::need(write_file(folder / "t.csv", "file,light_x,light_y,light_z,view_x,view_y\n"));
  CHECK(test::error_of(read_picture_table(folder / "t.csv")).message.find("view_z") != std::string::npos);
  CHECK(test::error_of(read_picture_table(folder / "none.csv")).code == Code::file_missing);
  std::filesystem::create_directories(folder / "empty");
  CHECK(test::error_of(read_picture_table(folder / "empty")).message.find("tl000") != std::string::npos);
}

}  // namespace
}  // namespace selvedge
