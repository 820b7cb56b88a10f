// One rule of the EXR structure after the other, broken by hand.
#include "format/exr/scan.h"

#include <doctest/doctest.h>
#include <sys/resource.h>

#include <cmath>
#include <limits>

#include "tests/format/damage.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::exr_value_at;
using test::Folder;
using test::get;
using test::put;

namespace {

/// Two tiled parts of two chunks each and a scanline part of three, uncompressed.
std::string good_file() {
  const Folder folder;
  std::vector<ExrPart> parts(3);
  for (std::size_t p = 0; p < 3; ++p) {
    parts[p].name = std::string("part") + static_cast<char>('A' + p);
    parts[p].width = 20;
    parts[p].height = p == 2 ? 3 : 10;
    parts[p].compression = "none";
    parts[p].tiled = p < 2;
    parts[p].tile_width = 16;
    parts[p].tile_height = 16;
    parts[p].channels = {{"ab", false}, {"cd", true}};
  }
  parts[0].attributes["mark"] = std::string("text");
  auto writer = test::need(ExrWriter::create(folder / "a.exr", parts));
  for (std::size_t p = 0; p < 3; ++p) {
    const ExrPart& part = parts[p];
    const auto count = static_cast<std::size_t>(part.width * part.height);
    const ExrPixels pixels{
        part.width, part.height, {std::vector<float>(count, 1), std::vector<float>(count, 2)}};
    REQUIRE(writer.write_level(static_cast<int>(p), 0, pixels));
  }
  REQUIRE(writer.commit());
  return test::bytes_of(folder / "a.exr");
}

/// The code and message of the refusal, or "good".
std::string verdict(const std::string& bytes, const ExrLimits& limits = {}) {
  const auto reader = ExrReader::open(test::as_bytes(bytes), "f", limits);
  return reader ? "good" : to_line(reader.error());
}

/// Where the offset of a chunk stands in the file.
std::size_t table_at(const std::string& bytes, std::size_t part, std::size_t chunk) {
  // The tables lie right before the first chunk, which is the first of part A.
  const std::size_t tables = 8 * (2 + 2 + 3);
  std::size_t first = bytes.size();
  for (std::size_t at = 0; at + tables <= bytes.size(); ++at) {
    if (get<std::uint64_t>(bytes, at) == at + tables) {
      first = at;
      break;
    }
  }
  REQUIRE(first < bytes.size());
  return first + 8 * (2 * part + chunk);
}

bool has(const std::string& line, const std::string& words) { return line.find(words) != std::string::npos; }

void check_refused(const std::string& bytes, const std::string& words) {
  const std::string line = verdict(bytes);
  CHECK_MESSAGE(has(line, words), line << " instead of " << words);
}

}  // namespace

TEST_CASE("magic number, version and flags are the first to be checked") {
  const std::string good = good_file();
  CHECK(verdict(good) == "good");
  check_refused("", "is not an OpenEXR file [EXR_MALFORMED]");
  check_refused("hello, world", "is not an OpenEXR file [EXR_MALFORMED]");
  std::string bytes = good;
  bytes[4] = 3;
  check_refused(bytes, "[EXR_UNSUPPORTED]");
  bytes = good;
  bytes[5] |= 0x08;
  check_refused(bytes, "deep data");
  bytes = good;
  bytes[5] |= 0x02;
  check_refused(bytes, "tiled and as of several parts");
  bytes = good;
  bytes[6] |= 0x01;
  check_refused(bytes, "later version of OpenEXR [EXR_UNSUPPORTED]");
}

TEST_CASE("a header has every standard attribute once, of the right type and size") {
  const std::string good = good_file();
  for (const char* name :
       {"channels", "compression", "dataWindow", "displayWindow", "lineOrder", "pixelAspectRatio",
        "screenWindowCenter", "screenWindowWidth", "chunkCount", "tiles", "type"}) {
    std::string bytes = good;
    bytes[bytes.find(std::string(name) + '\0')] = '_';
    check_refused(bytes, std::string("'") + name + "' is missing");
  }
  std::string bytes = good;
  bytes[bytes.find(std::string("name") + '\0')] = '_';
  check_refused(bytes, "has no printable name");
  bytes = good;
  bytes.replace(bytes.find(std::string("screenWindowWidth") + '\0'), 17, "screenWindowCente");
  check_refused(bytes, "'screenWindowWidth' is missing");
  bytes = good;
  bytes[bytes.find(std::string("v2f") + '\0') + 2] = 'i';
  check_refused(bytes, "is of type v2i instead of v2f");
  bytes = good;
  bytes.replace(bytes.find(std::string("mark") + '\0'), 4, "name");
  check_refused(bytes, "'name' is there twice");
  bytes = good;
  put<std::int32_t>(bytes, exr_value_at(bytes, "lineOrder", "lineOrder") - 4, 2);
  check_refused(bytes, "has 2 bytes instead of 1");
  put<std::int32_t>(bytes, exr_value_at(bytes, "lineOrder", "lineOrder") - 4, -1);
  check_refused(bytes, "negative size");
  bytes = good;
  put<std::int32_t>(bytes, exr_value_at(bytes, "mark", "string") - 4, 1 << 30);
  check_refused(bytes, "ends within its header [FILE_DAMAGED]");
  bytes = good;
  bytes[bytes.find(std::string("mark") + '\0') + 1] = '\x1b';
  check_refused(bytes, "not printable UTF-8");
  bytes[bytes.find(std::string("m\x1brk"), 0) + 1] = '\xff';
  check_refused(bytes, "not printable UTF-8");
}

TEST_CASE("windows, tiles and channels make sense") {
  const std::string good = good_file();
  const std::size_t window = exr_value_at(good, "dataWindow", "box2i");
  std::string bytes = good;
  put<std::int32_t>(bytes, window, 20);
  check_refused(bytes, "dataWindow: is empty");
  put<std::int32_t>(bytes, window, -5);
  check_refused(bytes, "does not begin at 0,0 [EXR_UNSUPPORTED]");
  put<std::int32_t>(bytes, window, std::numeric_limits<std::int32_t>::min());
  check_refused(bytes, "dataWindow: out of range");
  bytes = good;
  put<std::int32_t>(bytes, window + 8, 40);
  check_refused(bytes, "chunkCount is 2 instead of 3");
  bytes = good;
  put<std::int32_t>(bytes, exr_value_at(bytes, "displayWindow", "box2i") + 8, 40);
  check_refused(bytes, "differ from the first part's");
  bytes = good;
  put<float>(bytes, exr_value_at(bytes, "pixelAspectRatio", "float"), std::nanf(""));
  check_refused(bytes, "pixelAspectRatio: out of range");

  const std::size_t tiles = exr_value_at(good, "tiles", "tiledesc");
  bytes = good;
  put<std::uint32_t>(bytes, tiles, 0);
  check_refused(bytes, "tiles of no size");
  put<std::uint32_t>(bytes, tiles, 0x80000000U);
  check_refused(bytes, "tiles of no size");
  put<std::uint32_t>(bytes, tiles, 20);
  check_refused(bytes, "chunkCount is 2 instead of 1");
  bytes = good;
  bytes[tiles + 8] = 2;
  check_refused(bytes, "levels other than mip maps");
  bytes[tiles + 8] = 3;
  check_refused(bytes, "tile mode 3");
  bytes[tiles + 8] = 1;
  check_refused(bytes, "chunkCount is 2 instead of 6");

  const std::size_t channels = exr_value_at(good, "channels", "chlist");
  bytes = good;
  bytes[channels] = 'c';
  bytes[channels + 1] = 'd';
  check_refused(bytes, "channels are not in order");
  bytes = good;
  put<std::int32_t>(bytes, channels + 3, 0);
  check_refused(bytes, "partA/ab: only half and float channels are read");
  put<std::int32_t>(bytes, channels + 3, 3);
  check_refused(bytes, "pixel type 3");
  bytes = good;
  put<std::int32_t>(bytes, channels + 11, 2);
  check_refused(bytes, "sub-sampled");
  put<std::int32_t>(bytes, channels + 11, 0);
  check_refused(bytes, "sampling rate below 1");
  bytes = good;
  bytes[channels] = '\0';
  check_refused(bytes, "ends before its attribute does");
  bytes = good;
  bytes[exr_value_at(good, "compression", "compression")] = 10;
  check_refused(bytes, "unknown compression 10 [EXR_UNSUPPORTED]");
  bytes = good;
  bytes[exr_value_at(good, "lineOrder", "lineOrder")] = 3;
  check_refused(bytes, "line order 3");
  bytes = good;
  bytes.replace(exr_value_at(good, "type", "string"), 10, "tiledimagf");
  check_refused(bytes, "parts of type 'tiledimagf' are not read");
  bytes = good;
  bytes.replace(bytes.find("partB"), 5, "partA");
  check_refused(bytes, "two parts have this name");
}

TEST_CASE("every offset leads to its chunk, and no byte belongs to two") {
  const std::string good = good_file();
  const auto offset = [&](std::size_t part, std::size_t chunk) {
    return get<std::uint64_t>(good, table_at(good, part, chunk));
  };
  for (const std::uint64_t wrong :
       {std::uint64_t{1}, std::uint64_t{good.size()}, std::uint64_t{good.size() - 3}, offset(0, 0) - 8,
        ~std::uint64_t{0}, std::uint64_t{1} << 63}) {
    std::string bytes = good;
    put(bytes, table_at(good, 0, 1), wrong);
    check_refused(bytes, "is outside of the chunks [FILE_DAMAGED]");
  }
  std::string bytes = good;
  put<std::uint64_t>(bytes, table_at(good, 2, 1), 0);
  check_refused(bytes, "partC/row 1: was never written [FILE_DAMAGED]");
  for (const auto& [part, chunk] : {std::pair{0, 1}, {1, 0}, {2, 0}}) {
    bytes = good;
    put(bytes, table_at(good, static_cast<std::size_t>(part), static_cast<std::size_t>(chunk)), offset(0, 0));
    check_refused(bytes, "another chunk stands at its offset");
  }
  // Part number, column, row, level and level of the second tile of part B.
  const auto head = static_cast<std::size_t>(offset(1, 1));
  for (std::size_t number = 0; number < 5; ++number) {
    bytes = good;
    put<std::int32_t>(bytes, head + 4 * number, 7);
    check_refused(bytes, "partB/level 0/tile 1,0: another chunk stands at its offset");
  }
  bytes = good;
  put<std::int32_t>(bytes, head + 20, 4 * 10 * 6 + 1);
  check_refused(bytes, "has 241 packed bytes for 240 of pixels");
  put<std::int32_t>(bytes, head + 20, 4 * 10 * 6 - 1);
  check_refused(bytes, "has 239 packed bytes for 240 of pixels");
  put<std::int32_t>(bytes, head + 20, 0);
  check_refused(bytes, "has 0 packed bytes");
  put<std::int32_t>(bytes, head + 20, -1);
  check_refused(bytes, "reaches beyond the end of the file");
  // A second head for the last row, within the pixels of the first tile.
  bytes = good;
  const auto inside = static_cast<std::size_t>(offset(0, 0)) + 24 + 8;
  bytes.replace(inside, 12, good.substr(offset(2, 2), 12));
  put<std::uint64_t>(bytes, table_at(good, 2, 2), inside);
  check_refused(bytes, "chunks share bytes of the file");
}

TEST_CASE("bytes that belong to no chunk are left alone") {
  std::string bytes = good_file();
  bytes += "what an archive appends";
  CHECK(verdict(bytes) == "good");
}

TEST_CASE("a small file that declares what is large is refused at once and without the memory") {
  const std::string good = good_file();
  const auto used = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;  // kilobytes
  };
  const auto before = used();
  const std::size_t window = exr_value_at(good, "dataWindow", "box2i");
  const std::size_t tiles = exr_value_at(good, "tiles", "tiledesc");
  const std::size_t count = exr_value_at(good, "chunkCount", "int");
  const auto declare = [&](std::int32_t side, std::int32_t tile, std::int32_t chunks) {
    std::string bytes = good;
    put(bytes, window + 8, side - 1);
    put(bytes, window + 12, side - 1);
    put(bytes, tiles, tile);
    put(bytes, tiles + 4, tile);
    put(bytes, count, chunks);
    return verdict(bytes);
  };
  CHECK(has(declare(1 << 29, 16, 1), "[FILE_TOO_LARGE]"));
  CHECK(has(declare(32768, 1, 1 << 30), "ends within the offsets of the 1073741824 chunks [FILE_DAMAGED]"));
  CHECK(has(declare(32768, 32768, 1), "for 6442450944 of pixels [FILE_DAMAGED]"));
  std::string bytes = good;
  put<std::int32_t>(bytes, exr_value_at(good, "mark", "string") - 4, 0x7FFFFFFF);
  check_refused(bytes, "ends within its header [FILE_DAMAGED]");
  CHECK(used() - before < 64 * 1024);
  CHECK(has(verdict(good, {.header_bytes = 500}), "more than 500 bytes [FILE_TOO_LARGE]"));
  CHECK(has(verdict(good, {.parts = 2}), "more than 2 parts [FILE_TOO_LARGE]"));
  CHECK(has(verdict(good, {.attributes = 5}), "more than 5 attributes [FILE_TOO_LARGE]"));
}

TEST_CASE("only what is asked for is read, and every byte counts once") {
  const Folder folder;
  ExrPart part;
  part.name = "a";
  part.width = 20;
  part.height = 400;
  part.compression = "none";
  part.channels = {{"ab", false}, {"cd", true}};
  auto writer = test::need(ExrWriter::create(folder / "a.exr", {part}));
  const std::vector<float> plane(20 * 400, 1);
  REQUIRE(writer.write_level(0, 0, {20, 400, {plane, plane}}));
  REQUIRE(writer.commit());
  const std::string bytes = test::bytes_of(folder / "a.exr");
  auto reader = test::need(ExrReader::open(test::as_bytes(bytes), "f"));
  // Headers, tables and the heads of the chunks.
  const std::uint64_t opened = reader.bytes_read();
  CHECK(opened < bytes.size() / 2);
  REQUIRE(reader.read_rows(0, 390, 10));
  CHECK(reader.bytes_read() - opened == 10 * 20 * 6);
  REQUIRE(reader.read_rows(0, 392, 3));
  CHECK(reader.bytes_read() - opened == 10 * 20 * 6);
  REQUIRE(reader.read_rows(0, 380, 15));
  CHECK(reader.bytes_read() - opened == 20 * 20 * 6);
  REQUIRE(reader.read_level(0, 0));
  CHECK(reader.bytes_read() == bytes.size());
}
