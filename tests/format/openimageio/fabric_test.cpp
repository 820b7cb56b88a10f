// OpenImageIO, which we did not write, reads of a fabric file what we read.
#include <OpenImageIO/imageio.h>
#include <doctest/doctest.h>

#include <cstring>

#include "format/fabric/file.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

/// Every channel of every level of every part, bit by bit; gives back how many values were compared.
std::size_t compare_with_openimageio(const std::string& path) {
  auto ours = test::need(ExrReader::open(path));
  const auto theirs = OIIO::ImageInput::open(path);
  REQUIRE(theirs);
  std::size_t compared = 0;
  for (int p = 0; p < static_cast<int>(ours.parts().size()); ++p) {
    const ExrPart& part = ours.parts()[p];
    for (int k = 0; k < part.levels; ++k) {
      CAPTURE(part.name);
      CAPTURE(k);
      REQUIRE(theirs->seek_subimage(p, k));
      const OIIO::ImageSpec& spec = theirs->spec();
      CHECK(spec.get_string_attribute("oiio:subimagename") == part.name);
      REQUIRE(spec.nchannels == static_cast<int>(part.channels.size()));
      const auto pixels = test::need(ours.read_level(p, k));
      REQUIRE(spec.width == pixels.width);
      REQUIRE(spec.height == pixels.height);
      const auto texels = static_cast<std::size_t>(spec.width * spec.height);
      std::vector<float> values(texels * part.channels.size());
      REQUIRE(theirs->read_image(p, k, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, values.data()));
      for (std::size_t c = 0; c < part.channels.size(); ++c) {
        const int channel = spec.channelindex(part.channels[c].name);
        REQUIRE(channel >= 0);
        const bool half = spec.channelformat(channel) == OIIO::TypeDesc::HALF;
        CHECK(half == part.channels[c].is_half);
        bool equal = true;
        for (std::size_t i = 0; i < texels; ++i) {
          const float value = values[i * part.channels.size() + static_cast<std::size_t>(channel)];
          equal = equal && std::memcmp(&value, &pixels.planes[c][i], sizeof value) == 0;
        }
        CHECK(equal);
        compared += texels;
      }
    }
    CHECK_FALSE(theirs->seek_subimage(p, part.levels));
  }
  CHECK_FALSE(theirs->seek_subimage(static_cast<int>(ours.parts().size()), 0));
  return compared;
}

}  // namespace

TEST_CASE("OpenImageIO reads every part and level of a fabric bit by bit as we do") {
  const Folder folder;
  Fabric fabric = test::random_product_fabric(70, 9, {2, 2}, 2, 12);
  fabric.levels[1].remove_layer(LayerKind::table);  // a level of zeros
  FabricWriteOptions options;
  for (const LayerSet& half : {LayerSet(), half_precision_layers, LayerSet::all()}) {
    options.half_layers = half;
    test::need(write_fabric(folder / "a.exr", fabric, options));
    // 4 channels of the preview; 27 + 6 + 12 + 4 + 9 + 2 + 1 of the layers, over all levels.
    CHECK(compare_with_openimageio(folder / "a.exr") ==
          70 * 9 * 4 + 61 * (70 * 9 + 35 * 4 + 17 * 2 + 8 + 4 + 2 + 1));
  }
}
