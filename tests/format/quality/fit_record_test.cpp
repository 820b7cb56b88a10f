#include "format/quality/fit_record.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/check/fabric.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

/// Random radiance and opacity for random pairs, of 8 x 8 texels.
PairSamples random_truth(int count, std::uint64_t seed) {
  PairSamples truth;
  truth.width = truth.height = 8;
  truth.pairs = random_pairs(count, 0.15, seed);
  Random random(seed);
  for (int i = 0; i < count * 64; ++i) {
    truth.alpha.push_back(test::uniform(random, 0, 1));
    truth.alpha_noise.push_back(0);
    truth.radiance.emplace_back(test::uniform(random, 0, 1), test::uniform(random, 0, 1),
                                test::uniform(random, 0, 1));
    truth.noise.emplace_back(0.0F, 0.0F, 0.0F);
  }
  return truth;
}

std::optional<FitRecord> record_in(const Fabric& fabric) {
  IssueSink sink("");
  return fit_record_of(fabric.provenance, static_cast<int>(fabric.levels.size()), sink);
}

/// Places of the advice that the check gives on a fabric with that provenance.
std::vector<std::string> advice_on(const std::string& provenance) {
  const Folder folder;
  Fabric fabric = test::lambert_fabric(2, 1, {1, 1, 1});
  fabric.provenance = provenance;
  test::need(write_fabric(folder / "f.exr", fabric));
  std::vector<std::string> places;
  for (const Error& issue : check_fabric(folder / "f.exr")) {
    CHECK(severity_of(issue.code) == Severity::warning);
    if (issue.code == Code::fabric_advice) places.push_back(issue.place);
  }
  std::sort(places.begin(), places.end());
  return places;
}

}  // namespace

TEST_CASE("a fabric file says of every level what compare finds in it, and how many bytes it takes") {
  const Folder folder;
  const Fabric fabric = test::with_yarn(test::random_product_fabric(8, 8, {2, 2}, 2, 3), 1);
  const PairSamples held_out = random_truth(6, 1);
  const PairSamples training = random_truth(9, 2);
  const FabricWriteOptions options;
  FitRecord record;
  record.warnings.push_back({Code::samples_sparse, {}, "level 0", "3 of 64 texels are holes"});
  const Fabric stored = as_stored(fabric, options.half);
  REQUIRE(measure_errors(stored, held_out, training, record.peak, record.levels));
  record.levels[1].iterations = 12.34;
  record.levels[1].converged = 15;
  record.levels[1].at_limit = 1;
  REQUIRE(write_fabric(folder / "f.exr", stored, record, options));

  for (const Error& issue : check_fabric(folder / "f.exr")) CHECK(issue.code != Code::fabric_advice);
  auto reader = test::need(FabricReader::open(folder / "f.exr"));
  const auto read = test::need(reader.read());
  const auto found = test::need(record_in(read));
  REQUIRE(found.levels.size() == 4);
  const auto of_held_out = test::need(compare(read, held_out, PairKind::held_out));
  const auto of_training = test::need(compare(read, training, PairKind::held_out, of_held_out.peak));
  CHECK(found.peak == doctest::Approx(of_held_out.peak).epsilon(1e-5));
  for (std::size_t k = 0; k < 4; ++k) {
    const LevelReport& level = found.levels[k];
    REQUIRE(level.held_out);
    REQUIRE(level.training);
    CHECK(level.held_out->pairs == 6);
    CHECK(level.training->pairs == 9);
    // Half a unit of the last digit that is written.
    CHECK(std::abs(level.held_out->psnr - of_held_out.levels[k].psnr) < 0.00501);
    CHECK(std::abs(level.training->psnr - of_training.levels[k].psnr) < 0.00501);
    CHECK(std::abs(level.held_out->relative_l2 - of_held_out.levels[k].relative_l2) < 0.0000501);
    CHECK(std::abs(level.training->relative_l2 - of_training.levels[k].relative_l2) < 0.0000501);
    CHECK(level.layers == layers_text(read.levels[k]));
    std::uint64_t bytes = 0;
    for (const LayerKind layer : {LayerKind::lobes, LayerKind::frame, LayerKind::table, LayerKind::opacity,
                                  LayerKind::light, LayerKind::products}) {
      bytes += reader.packed_bytes(layer, static_cast<int>(k));
    }
    CHECK(level.bytes == bytes);
    CHECK(bytes > 0);
  }
  CHECK(found.levels[1].iterations == 12.3);
  CHECK(found.levels[1].converged == 15);
  CHECK(found.levels[1].at_limit == 1);
  CHECK_FALSE(found.levels[0].iterations);
  REQUIRE(found.warnings.size() == 1);
  CHECK(found.warnings[0].message == record.warnings[0].message);
}

TEST_CASE("without compression a level takes the bytes of its values") {
  const Folder folder;
  const Fabric fabric = test::random_fabric(8, 4, {2, 2}, 2, 1);
  FabricWriteOptions options;
  options.codec = "none";
  REQUIRE(write_fabric(folder / "f.exr", fabric, FitRecord(), options));
  const auto read = test::need(read_fabric(folder / "f.exr"));
  const auto record = test::need(record_in(read));
  // Three channels of rho and two lobes of four floats; frame, table and opacity in halves.
  const std::uint64_t per_texel = 3 * 9 * 4 + 6 * 2 + 4 * 3 * 2 + 4 * 2;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto texels = static_cast<std::uint64_t>(read.levels[k].texels());
    CHECK(record.levels[k].bytes == texels * per_texel);
    CHECK_FALSE(record.levels[k].held_out);
  }
  CHECK(record.levels[0].layers == "2 lobes x table");
}

TEST_CASE("a fabric as stored is the fabric that is read") {
  const Folder folder;
  Fabric fabric = test::random_product_fabric(4, 4, {2, 2}, 1, 9);
  for (FabricLevel& level : fabric.levels) {
    for (float& alpha : level.opacity()) alpha *= 0.7F;  // no half any more
  }
  const FabricWriteOptions options;
  const Fabric stored = as_stored(fabric, options.half);
  CHECK(stored.levels[0][LayerKind::opacity] != fabric.levels[0][LayerKind::opacity]);
  REQUIRE(write_fabric(folder / "f.exr", fabric, options));
  const auto read = test::need(read_fabric(folder / "f.exr"));
  for (std::size_t k = 0; k < read.levels.size(); ++k) {
    CHECK(stored.levels[k][LayerKind::opacity] == read.levels[k][LayerKind::opacity]);
    CHECK(stored.levels[k][LayerKind::lobes] == read.levels[k][LayerKind::lobes]);
    CHECK(stored.levels[k][LayerKind::products] == read.levels[k][LayerKind::products]);
    CHECK(stored.levels[k].bases == stored.levels[0].bases);
  }
  REQUIRE(write_fabric(folder / "s.exr", stored, options));
  CHECK(test::bytes_of(folder / "s.exr") == test::bytes_of(folder / "f.exr"));
}

TEST_CASE("a record of a fit that is not as described is advice") {
  const std::vector<std::string> advice{"/provenance/fit"};
  CHECK(advice_on(R"({"fit":{"lobes":2}})").empty());
  CHECK(advice_on(R"({"fit":7})").empty());
  for (const char* record :
       {R"({"levels":3})", R"({"levels":[{}],"peak":1,"warnings":[]})",
        R"({"levels":[7,8],"peak":1,"warnings":[]})", R"({"levels":[],"peak":1,"warnings":7})"}) {
    CAPTURE(record);
    CHECK(advice_on(fmt::format(R"({{"fit":{}}})", record)) == advice);
  }
  const auto with = [&](const char* level, const char* warning) {
    return advice_on(
        fmt::format(R"({{"fit":{{"levels":[{0},{0}],"peak":1,"warnings":[{1}]}}}})", level, warning));
  };
  for (const char* level :
       {R"({"layers":"x"})", R"({"layers":"x","bytes":-1})", R"({"layers":"x","bytes":1.5})",
        R"({"layers":"x","bytes":1,"iterations":"many"})", R"({"layers":"x","bytes":1,"atLimit":4294967296})",
        R"({"layers":"x","bytes":1,"heldOut":{"pairs":1}})"}) {
    CAPTURE(level);
    CHECK(with(level, "") == advice);
  }
  CHECK(with(R"({"layers":"x","bytes":1})", "5") == advice);
  // A code of a later version is passed over; that the bytes are others is advice of its own.
  CHECK(with(R"({"layers":"x","bytes":1})", R"({"code":"OTHER","place":"","message":""})") != advice);
}

TEST_CASE("levels that are cut out keep their record, and errors only with their values") {
  FitRecord record;
  record.levels.resize(3);
  for (std::size_t k = 0; k < 3; ++k) {
    record.levels[k].held_out = FitError{1, static_cast<double>(k), 0};
    record.levels[k].training = FitError{1, 0, 0};
    record.levels[k].converged = static_cast<int>(k);
  }
  const FitRecord kept = record_of_levels(record, 1, 2, false);
  REQUIRE(kept.levels.size() == 2);
  CHECK(kept.levels[0].held_out->psnr == 1);
  CHECK(kept.levels[1].converged == 2);
  const FitRecord changed = record_of_levels(record, 0, 0, true);
  REQUIRE(changed.levels.size() == 1);
  CHECK_FALSE(changed.levels[0].held_out);
  CHECK_FALSE(changed.levels[0].training);
  CHECK(changed.levels[0].converged == 0);
}
