// The reader of EXR files against OpenImageIO, on pictures that neither has written.
#include <OpenImageIO/imageio.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "format/exr/exr.h"
#include "tests/shared_data.h"

using namespace selvedge;
namespace fs = std::filesystem;

namespace {

/// The same bits, or not a number in both: a conversion may touch which one.
bool same_value(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

/// Number of values at which the two readers differ.
std::size_t differences(const ExrPart& part, const ExrPixels& pixels, OIIO::ImageInput& other, int level) {
  const OIIO::ImageSpec spec = other.spec(0, level);
  REQUIRE(spec.width == pixels.width);
  REQUIRE(spec.height == pixels.height);
  REQUIRE(spec.channelnames.size() == part.channels.size());
  const std::size_t count = part.channels.size();
  std::vector<float> values(pixels.planes[0].size() * count);
  REQUIRE(other.read_image(0, level, 0, static_cast<int>(count), OIIO::TypeDesc::FLOAT, values.data()));
  std::size_t different = 0;
  for (std::size_t c = 0; c < count; ++c) {
    const auto name = std::find(spec.channelnames.begin(), spec.channelnames.end(), part.channels[c].name);
    REQUIRE(name != spec.channelnames.end());
    const auto at = static_cast<std::size_t>(name - spec.channelnames.begin());
    for (std::size_t i = 0; i < pixels.planes[c].size(); ++i) {
      different += same_value(pixels.planes[c][i], values[i * count + at]) ? 0 : 1;
    }
  }
  return different;
}

}  // namespace

TEST_CASE(
    "exr: pictures of the OpenEXR project are read as OpenImageIO reads them, or refused for what they are") {
  const std::string folder = test::shared_data("exr");
  if (folder.empty()) return;
  // Luminance and chroma sub-sampled; a data window off the origin.
  const std::set<std::string> refused{"Rec709_YC.exr", "XYZ_YC.exr", "t08.exr"};
  int read = 0;
  int lossy = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".exr") continue;
    CAPTURE(entry.path().string());
    auto reader = ExrReader::open(entry.path().string());
    CHECK(reader.has_value() == !refused.contains(entry.path().filename().string()));
    if (!reader) {
      CHECK(reader.error().code == Code::exr_unsupported);
      continue;
    }
    const auto other = OIIO::ImageInput::open(entry.path().string());
    REQUIRE(other);
    const ExrPart& part = reader->parts().front();
    CHECK(part.compression == other->spec().get_string_attribute("compression"));
    for (int level = 0; level < part.levels; ++level) {
      const auto pixels = reader->read_level(0, level);
      if (is_lossy(part.compression)) {
        REQUIRE_FALSE(pixels);
        CHECK(pixels.error().code == Code::exr_unsupported);
        ++lossy;
        continue;
      }
      REQUIRE_MESSAGE(pixels, to_line(pixels.error()));
      CHECK(differences(part, *pixels, *other, level) == 0);
      ++read;
    }
    CHECK_FALSE(other->seek_subimage(0, part.levels));
    CHECK_FALSE(other->seek_subimage(1, 0));
  }
  CHECK(read > 40);
  CHECK(lossy > 5);
}
