// A damaged file ends in a named issue or leaves the fabric bit-equal: tried on every byte of a small file.
#include <doctest/doctest.h>

#include "format/exr/exr.h"
#include "format/exr/scan.h"
#include "format/fabric/file.h"
#include "format/samples/samples.h"
#include "tests/format/damage.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool same_level(const FabricLevel& a, const FabricLevel& b) {
  const auto same_layer = [&](LayerKind kind) {
    return a[kind].channels == b[kind].channels && same_bits(a[kind].values, b[kind].values);
  };
  return a.width == b.width && a.height == b.height && a.pairs == b.pairs &&
         std::all_of(all_layers.begin(), all_layers.end(), same_layer) &&
         (a.bases != nullptr) == (b.bases != nullptr) &&
         (!a.bases || (same_bits(a.bases->view, b.bases->view) && same_bits(a.bases->light, b.bases->light)));
}

bool same_fabric(const Fabric& a, const Fabric& b) {
  return a.period_mm == b.period_mm && a.reference_height == b.reference_height &&
         a.thickness_mm == b.thickness_mm && a.views == b.views && a.lights == b.lights &&
         a.provenance == b.provenance &&
         std::equal(a.levels.begin(), a.levels.end(), b.levels.begin(), b.levels.end(), same_level);
}

bool same_pixels(const ExrPixels& a, const ExrPixels& b) {
  return a.width == b.width && a.height == b.height &&
         std::equal(a.planes.begin(), a.planes.end(), b.planes.begin(), b.planes.end(), same_bits<float>);
}

/// An issue that a person can act on.
bool is_named(const Error& error) {
  return error.file == "damaged" && !error.message.empty() && to_line(error).find('\n') == std::string::npos;
}

/// Two levels, two views.
std::string file_of(const Fabric& fabric) {
  const Folder folder;
  REQUIRE(write_fabric(folder / "a.exr", fabric));
  return test::bytes_of(folder / "a.exr");
}
std::string file_of_all_layers() { return file_of(test::random_product_fabric(3, 2, {1, 2}, 1, 7)); }
std::string file_of_the_papers_layers() { return file_of(test::random_fabric(3, 2, {1, 2}, 1, 7)); }

/// Where the packed pixels of the first chunk begin: all before it is structure.
std::size_t begin_of_pixels(const std::string& bytes) {
  const InputFile source(test::as_bytes(bytes));
  const auto scan = test::need(scan_exr(source, "whole", {}));
  std::uint64_t first = bytes.size();
  for (const auto& part : scan.chunks) {
    for (const ExrChunk& chunk : part) first = std::min(first, chunk.offset);
  }
  return static_cast<std::size_t>(first);
}

/// Two texels, two views, one light, two held-out pairs.
void write_small_samples(const std::string& path) {
  Samples samples;
  SamplesHeader& header = samples.header;
  header.width = 2;
  header.height = 1;
  header.views = {1, 2};
  header.lights = {1, 1};
  header.pairs[1] = random_pairs(2, 0.15, 1);
  header.provenance = "{}";
  samples.views.assign(2, {{0.5F, 1}, {{0, 0, 1}, {0, 0.5F, 1}}, {{1, 2, 3}, {4, 5, 6}}});
  samples.pairs[1] = {2,
                      1,
                      header.pairs[1],
                      std::vector<float>(4, 0.5F),
                      std::vector<V3f>(4, V3f(1, 2, 3)),
                      std::vector<V3f>(4, V3f(0.5F)),
                      std::vector<float>(4, 0.25F)};
  test::need(write_samples(path, samples));
}

}  // namespace

TEST_CASE("a fabric file cut short anywhere is refused when it is opened") {
  const std::string bytes = file_of_the_papers_layers();
  test::need(ExrReader::open(test::as_bytes(bytes), "whole"));
  std::size_t accepted = 0;
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    // A buffer of that length and no more: a read beyond it is one that the address sanitizer sees.
    const std::vector<std::uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
    const auto reader = ExrReader::open(cut, "damaged");
    const auto fabric = read_fabric(cut, "damaged");
    if (reader || fabric || !is_named(reader.error()) || !is_named(fabric.error())) ++accepted;
  }
  CHECK(accepted == 0);
}

TEST_CASE("a fabric file with a damaged byte is refused or read bit-equal") {
  const std::string bytes = file_of_all_layers();
  const auto whole = test::need(read_fabric(test::as_bytes(bytes), "whole"));
  std::size_t refused = 0;
  std::size_t equal = 0;
  std::string wrong;
  test::damage_each_byte(bytes, 0, bytes.size(), [&](const std::string& damaged, std::size_t at) {
    const auto fabric = read_fabric(test::as_bytes(damaged), "damaged");
    if (fabric) {
      same_fabric(*fabric, whole) ? void(++equal) : void(wrong += std::to_string(at) + " ");
    } else {
      is_named(fabric.error()) ? void(++refused) : void(wrong += std::to_string(at) + " ");
    }
  });
  CHECK_MESSAGE(wrong.empty(), "read as another fabric, or an unnamed issue: bytes " << wrong);
  // Both must happen, or nothing was tried: names and pixels are refused, the preview's pixels mean nothing.
  CHECK(refused > bytes.size());
  CHECK(equal > 0);
}

TEST_CASE("one level of one part of a damaged file is refused or read, and never of another shape") {
  const std::string bytes = file_of_the_papers_layers();
  auto whole = test::need(ExrReader::open(test::as_bytes(bytes), "whole"));
  const std::size_t parts = whole.parts().size();
  REQUIRE(parts == 5);
  std::vector<ExrPixels> expected;
  for (std::size_t p = 0; p < parts; ++p) {
    auto pixels = test::need(whole.read_level(static_cast<int>(p), 0));
    expected.push_back(std::move(pixels));
  }
  const std::size_t first_pixels = begin_of_pixels(bytes);
  std::string wrong;
  test::damage_each_byte(bytes, 0, bytes.size(), [&](const std::string& damaged, std::size_t at) {
    auto reader = ExrReader::open(test::as_bytes(damaged), "damaged");
    if (!reader) {
      if (!is_named(reader.error())) wrong += std::to_string(at) + " ";
      return;
    }
    for (std::size_t p = 0; p < reader->parts().size(); ++p) {
      const ExrPart& part = reader->parts()[p];
      const auto pixels = reader->read_level(static_cast<int>(p), 0);
      const bool good = pixels ? pixels->width == part.width && pixels->height == part.height &&
                                     pixels->planes.size() == part.channels.size()
                               : is_named(pixels.error());
      // Precision of a channel and its name are the header digest's to hold.
      const bool same_channels =
          part.name == whole.parts()[p].name &&
          std::equal(part.channels.begin(), part.channels.end(), whole.parts()[p].channels.begin(),
                     whole.parts()[p].channels.end(), [](const ExrChannel& a, const ExrChannel& b) {
                       return a.name == b.name && a.half == b.half;
                     });
      const bool changed = pixels && same_channels && at < first_pixels && !same_pixels(*pixels, expected[p]);
      if (!good || changed) wrong += std::to_string(at) + " ";
    }
  });
  CHECK_MESSAGE(wrong.empty(), "bytes " << wrong);
}

TEST_CASE("a samples file cut short is refused, and one with a damaged byte is refused or in range") {
  const Folder folder;
  write_small_samples(folder / "a.exr");
  const std::string bytes = test::bytes_of(folder / "a.exr");
  test::need(read_samples(test::as_bytes(bytes), "whole"));
  std::size_t wrong = 0;
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const std::string cut = bytes.substr(0, length);
    const auto level = read_samples(test::as_bytes(cut), "cut");
    if (level || !is_named(level.error())) ++wrong;
  }
  // Without digests a number of the text or a pixel that was stored as it is can change unseen: what is read
  // keeps its shape and its range all the same.
  test::damage_each_byte(bytes, 0, bytes.size(), [&](const std::string& damaged, std::size_t) {
    const auto read = read_samples(test::as_bytes(damaged), "damaged");
    if (!read) {
      wrong += is_named(read.error()) ? 0 : 1;
      return;
    }
    const SampleLevel level = samples_of(*read, Side::front).level;
    const auto texels = static_cast<std::size_t>(level.texels());
    const std::size_t seen = texels * static_cast<std::size_t>(level.views);
    const bool in_range =
        std::all_of(level.alpha.begin(), level.alpha.end(), [](float a) { return a >= 0 && a <= 1; }) &&
        std::all_of(level.radiance.begin(), level.radiance.end(), [](const V3f& r) {
          return r.x >= 0 && r.y >= 0 && r.z >= 0 && std::isfinite(r.length2());
        });
    const bool shaped = level.normal.size() == texels && level.alpha.size() == seen &&
                        level.radiance.size() == seen * static_cast<std::size_t>(level.lights);
    if (!in_range || !shaped) ++wrong;
  });
  CHECK(wrong == 0);
}
