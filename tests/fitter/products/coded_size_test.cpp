#include "fitter/products/coded_size.h"

#include <doctest/doctest.h>

#include <filesystem>

#include "format/fabric/file.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"

using namespace selvedge;

TEST_CASE("the size of a layer is known before it is written") {
  const test::Folder folder;
  Fabric fabric = test::random_fabric(32, 32, {8, 8}, 1, 3);
  fabric.levels.resize(1);
  const std::vector<float> opacity = fabric.levels[0][LayerKind::opacity].values;
  REQUIRE(write_fabric(folder / "with.exr", fabric));
  fabric.levels[0].remove_layer(LayerKind::opacity);
  REQUIRE(write_fabric(folder / "without.exr", fabric));
  // The part has 64 channels in the header, and the previews differ.
  const auto difference = static_cast<double>(std::filesystem::file_size(folder / "with.exr")) -
                          static_cast<double>(std::filesystem::file_size(folder / "without.exr"));
  CHECK(coded_bytes(opacity, 64, 32) == doctest::Approx(difference - 64 * 30).epsilon(0.05));
}
