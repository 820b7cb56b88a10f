// spec/fabric.md against the code: the example file, digests, members, channels and directions.
#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "format/base/digest.h"
#include "format/exr/exr.h"
#include "format/fabric/file.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/require.h"
#include "tests/spec/spec_text.h"

using namespace selvedge;
using namespace selvedge::test;
using nlohmann::json;

namespace {

/// The fabric that the page describes above its JSON text.
Fabric example() {
  Fabric fabric;
  fabric.period_mm = {2, 1};
  fabric.reference_height = 0.5F;
  fabric.thickness_mm = 0.75F;
  fabric.views = {1, 2};
  fabric.provenance = R"({"software":"example"})";
  for (int k = 0; k < 2; ++k) {
    FabricLevel level;
    level.width = level_size(2, k);
    level.height = 1;
    level.add_layer(LayerKind::lobes, 15);
    for (int i = 0; i < 15 * level.texels(); ++i)
      level.lobes()[i] = std::array{0.25F, -0.5F, -0.5F, 0.5F, 4.0F}[i % 5];
    fabric.levels.push_back(level);
  }
  fabric.levels[0].set_layer(LayerKind::opacity, {2, {1, 0.5F, 0.25F, 0}});
  return fabric;
}

std::string text_attribute(const ExrReader& reader, const std::string& name) {
  return reader.parts().front().attributes.at(name);
}

DirectionGrid grid_named(const std::string& cell) {
  return cell.find("8x16") != std::string::npos ? DirectionGrid{8, 16} : DirectionGrid{8, 8};
}

}  // namespace

TEST_CASE("the example of the attribute text is what the described fabric is written with") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "example.exr", example()));
  const FabricReader reader = test::need(FabricReader::open(folder / "example.exr"));
  const auto blocks = code_blocks(page("fabric.md"), "json");
  REQUIRE(blocks.size() == 1);
  CHECK(json::parse(blocks[0]) == json::parse(reader.header_text()));
}

TEST_CASE("digests are made of the bytes that the page states") {
  const std::string text = page("fabric.md");
  CHECK(names(text, digest_of(std::string("selvedge"))));
  const std::string opacity("\x00\x3c\x00\x34\x00\x38\x00\x00", 8);
  CHECK(text.find(digest_of(opacity)) != std::string::npos);

  const Folder folder;
  REQUIRE(write_fabric(folder / "example.exr", example()));
  const auto reader = test::need(ExrReader::open(folder / "example.exr"));
  const auto blocks = code_blocks(text, "text");
  REQUIRE(blocks.size() == 1);
  std::string tail = blocks[0];
  tail.pop_back();  // the line feed before the fence
  const std::string digest = digest_of(text_attribute(reader, "selvedge.fabric") + tail);
  CHECK(digest == text_attribute(reader, "selvedge.digest"));
  CHECK(names(text, digest));
}

TEST_CASE("the table of cells is the layout of directions") {
  const std::string text = page("fabric.md");
  for (const auto& [name, grid] : {std::pair{"8x8", DirectionGrid{8, 8}}, {"8x16", DirectionGrid{8, 16}}}) {
    const auto rows = rows_of(text, name, 5);
    CHECK(rows.size() == 4);
    for (const auto& row : rows) {
      const V3f d = cell_direction(grid, std::stoi(row[1]));
      // Seven decimals and single precision.
      for (unsigned i = 0; i < 3; ++i)
        CHECK(std::abs(std::stod(row[2 + i]) - static_cast<double>(d[i])) < 1e-6);
    }
  }
}

TEST_CASE("the table of interpolation agrees with the code") {
  const auto rows = rows_of(page("fabric.md"), "8x8", 6);
  CHECK(rows.size() == 4);
  for (const auto& row : rows) {
    const auto d = numbers_of(row[1]);
    const V2d square = hemisphere_to_square({d[0], d[1], d[2]});
    CHECK(std::abs(square.x - std::stod(row[2])) < 1e-6);
    CHECK(std::abs(square.y - std::stod(row[3])) < 1e-6);
    const DirectionTaps taps = interpolate(grid_named(row[0]), V3f(V3d(d[0], d[1], d[2])));
    const auto cells = numbers_of(row[4]);
    const auto weights = numbers_of(row[5]);
    for (std::size_t k = 0; k < 4; ++k) {
      CHECK(taps.cell[k] == static_cast<int>(cells[k]));
      CHECK(std::abs(weights[k] - static_cast<double>(taps.weight[k])) < 1e-5);  // five decimals
    }
  }
}

TEST_CASE("the stated limits agree with the code") {
  const std::string text = page("fabric.md");
  const FabricLimits limits;
  const ExrLimits exr;
  CHECK(limits.texels_per_side == 4096);
  CHECK(limits.directions == 4096);
  CHECK(exr.pixels_per_part == std::uint64_t{1} << 30);
  CHECK(exr.bytes_per_read == std::uint64_t{1} << 32);
  CHECK(exr.floats_per_byte == 2200);
  CHECK(exr.header_bytes == std::uint64_t{1} << 24);
  CHECK(exr.attributes == 4096);
  CHECK(text.find("| lobes | " + std::to_string(limits.lobes) + " |") != std::string::npos);
  CHECK(text.find("| parts in the file | " + std::to_string(exr.parts) + " |") != std::string::npos);
  CHECK(exr.channels == 32768);
  for (const auto& [what, most] :
       {std::pair{"products, functions of the view, functions of the light", limits.products}}) {
    CHECK(text.find(std::string("| ") + what + " | " + std::to_string(most) + " |") != std::string::npos);
  }
  CHECK(limits.functions == limits.products);
  CHECK(limits.curves == 1 << 16);
  CHECK(limits.nodes == 1 << 20);
  CHECK(limits.stations == 1 << 18);
  CHECK(limits.values_per_curve == 64);
  CHECK(limits.values_per_station == 256);
  for (const char* row :
       {"| texels along a side | 4,096 |", "| views, lights: `columns` x `rows` | 4,096 |",
        "| channels in a part | 32,768 |", "| pixels in a part | 2^30 |", "| all headers | 2^24 bytes |",
        "| attributes in a part | 4,096 |", "| curves of yarn | 65,536 |", "| nodes of yarn | 2^20 |",
        "| stations of yarn | 2^18 |", "| fields of a curve of yarn | 64 |",
        "| values of a station of yarn | 256 |",
        "| decoded level of one part, as 32-bit floats | 2^32 bytes |",
        "| decoded chunk, as 32-bit floats | 2200 times its packed bytes |"}) {
    CHECK_MESSAGE(text.find(row) != std::string::npos, row);
  }
}
