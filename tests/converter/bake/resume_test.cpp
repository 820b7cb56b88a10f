// Journals, shards and targets of the bake. The kill itself is in tests/cli/bake.sh.
#include <doctest/doctest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "converter/bake/bake.h"
#include "converter/bake/journal.h"
#include "format/base/atomic_file.h"
#include "tests/converter/bake_cells.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

CellMesh mesh() { return fence(2, 1, 0.5F, 0.8F); }

BakeOptions small_bake() {
  BakeOptions o;
  o.width = 6;
  o.height = 4;
  o.views = 9;
  o.lights = 12;
  o.samples = 6;
  o.validation_pairs = 3;
  o.held_out_pairs = 5;
  o.rim_pairs = 2;
  o.truth_samples = 8;
  return o;
}

BakeReport baked(const BakeOptions& options, const std::string& output) {
  return test::need(bake(mesh(), "test", options, "{}", output));
}

/// The journal of a bake that ended early: a shard of everything is one, before it got its name.
std::string journal_of(const BakeOptions& options, const Folder& folder, const char* output) {
  const std::string path = folder / (std::string(output) + ".journal");
  test::need(bake_shard(mesh(), "test", options, "{}", {}, folder / "all.shard"));
  std::filesystem::rename(folder / "all.shard", path);
  return path;
}

}  // namespace

TEST_CASE("a journal that was cut anywhere is gone on with, to the same bytes") {
  const Folder folder;
  const BakeOptions o = small_bake();
  CHECK(baked(o, folder / "whole.exr").resumed == 0);
  const std::string wanted = bytes_of(folder / "whole.exr");
  for (const double share : {0.0, 0.3, 0.6, 0.9, 0.999, 1.0}) {
    const std::string journal = journal_of(o, folder, "cut.exr");
    const auto size = std::filesystem::file_size(journal);
    std::filesystem::resize_file(journal, static_cast<std::uintmax_t>(share * static_cast<double>(size)));
    const BakeReport report = baked(o, folder / "cut.exr");
    CHECK(bytes_of(folder / "cut.exr") == wanted);
    CHECK(report.resumed + report.units == 19);
    CHECK((report.resumed == 0) == (share < 0.3));
    CHECK((report.units == 0) == (share == 1.0));
    // Views are larger than pairs: with three fifths of the bytes more than four views are there.
    if (share == 0.6) CHECK(report.resumed >= 4);
    CHECK_FALSE(std::filesystem::exists(journal));
    std::filesystem::remove(folder / "cut.exr");
  }
}

TEST_CASE("a damaged record of a journal is baked again") {
  const Folder folder;
  const BakeOptions o = small_bake();
  baked(o, folder / "whole.exr");
  const std::string journal = journal_of(o, folder, "s.exr");
  std::string bytes = bytes_of(journal);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  REQUIRE(write_file(journal, bytes));
  const BakeReport report = baked(o, folder / "s.exr");
  CHECK(report.resumed > 0);
  CHECK(report.units > 0);
  CHECK(bytes_of(folder / "s.exr") == bytes_of(folder / "whole.exr"));
}

TEST_CASE("a journal of another bake is not gone on with") {
  const Folder folder;
  BakeOptions o = small_bake();
  journal_of(o, folder, "s.exr");
  SUBCASE("another seed") { o.seed = 2; }
  SUBCASE("other samples") { o.samples = 7; }
  SUBCASE("another kind of indirect light") { o.indirect = IndirectLight::traced; }
  SUBCASE("a ground") { o.ground = 0.5; }
  SUBCASE("another plane") { o.reference = {ReferencePlane::Kind::at, 0.3}; }
  CHECK(baked(o, folder / "s.exr").resumed == 0);
  CHECK_FALSE(std::filesystem::exists(folder / "s.exr.journal"));
}

TEST_CASE("shards in any order merge to the bytes of the whole") {
  const Folder folder;
  const BakeOptions o = small_bake();
  baked(o, folder / "whole.exr");
  std::vector<std::string> shards;
  for (const int index : {2, 0, 1}) {
    shards.push_back(folder / ("part" + std::to_string(index)));
    const auto report = test::need(bake_shard(mesh(), "test", o, "{}", {index, 3}, shards.back()));
    CHECK(report.units >= 6);
  }
  const auto merged = test::need(merge_shards(shards, folder / "merged.exr"));
  CHECK(bytes_of(folder / "merged.exr") == bytes_of(folder / "whole.exr"));
  CHECK(folder.files() == 5);
}

TEST_CASE("shards that do not make a whole are refused") {
  const Folder folder;
  BakeOptions o = small_bake();
  REQUIRE(bake_shard(mesh(), "test", o, "{}", {0, 2}, folder / "a"));
  o.seed = 2;
  REQUIRE(bake_shard(mesh(), "test", o, "{}", {1, 2}, folder / "b"));
  const auto refused = [&](std::vector<std::string> shards, const char* why) {
    const Error error = test::error_of(merge_shards(shards, folder / "m.exr"));
    CHECK_MESSAGE(error.message.find(why) != std::string::npos, to_line(error));
    CHECK_FALSE(std::filesystem::exists(folder / "m.exr"));
  };
  refused({folder / "a"}, "in none of the shards");
  refused({folder / "a", folder / "b"}, "is of another bake");
  refused({folder / "a", folder / "missing"}, "no such file");
  REQUIRE(write_file(folder / "c", bytes_of(folder / "a").substr(0, 5000)));
  refused({folder / "c"}, "damaged");
  REQUIRE(write_file(folder / "d", std::string("not a journal")));
  refused({folder / "d"}, "not a journal");
  CHECK_FALSE(bake_shard(mesh(), "test", o, "{}", {2, 2}, folder / "e"));
}

TEST_CASE("a shard with samples that no reader takes is refused, whatever its digests say") {
  const Folder folder;
  const std::string part = folder / "part";
  test::need(bake_shard(mesh(), "test", small_bake(), "{}", {}, part));
  const SamplesHeader header = test::need(BakeJournal::read(part)).header();
  const std::vector<BakeUnit> units = units_of(header);
  REQUIRE(units[9].kind == BakeUnit::Kind::pair);
  const std::string whole = bytes_of(part);
  for (const std::size_t unit : {0, 9}) {
    for (const auto& [place, plane, value] : {std::tuple("opacity", 0, 1.5F), std::tuple("opacity", 0, -0.5F),
                                              std::tuple("radiance", 2, -1.0F)}) {
      REQUIRE(write_file(part, whole));
      {
        auto journal = test::need(BakeJournal::open(part, header, {}, true));
        UnitSamples samples = blank_samples(header, units[unit]);
        const Planes planes = planes_of(samples);
        REQUIRE(journal.read(unit, planes));
        planes[plane][5] = value;
        REQUIRE(journal.write(unit, planes, journal.noise(unit)));
      }
      const std::vector<std::string> parts{part};
      const Error error = test::error_of(merge_shards(parts, folder / "m.exr"));
      CHECK(error.code == Code::samples_not_finite);
      CHECK(error.file == part);
      CHECK(error.place == place);
      CHECK_FALSE(std::filesystem::exists(folder / "m.exr"));
    }
  }
}

TEST_CASE("the noise of a bake is in its file") {
  const Folder folder;
  const BakeReport report = baked(small_bake(), folder / "s.exr");
  const auto reader = test::need(SamplesReader::open(folder / "s.exr"));
  const auto noise = nlohmann::json::parse(reader.header().provenance)["bake"]["noise"];
  CHECK(noise["samples"] == report.noise);
  CHECK(noise["truth"] == report.truth_noise);
  CHECK(report.noise > 0);
}
