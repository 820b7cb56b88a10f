#include "converter/measured/import.h"

#include <doctest/doctest.h>

#include <cmath>

#include "converter/bake/bake.h"
#include "fitter/fit.h"
#include "format/base/parallel.h"
#include "format/quality/compare.h"
#include "tests/converter/load_cell.h"
#include "tests/converter/measured/photographs.h"
#include "tests/format/files.h"
#include "tests/require.h"

namespace selvedge {
namespace {

constexpr int texels = 8;

BakeOptions bake_options(int texels_of_it, int pairs, std::uint64_t seed) {
  return {.width = texels_of_it,
          .height = texels_of_it,
          .views = 36,
          .lights = 36,
          .validation_pairs = 0,
          .held_out_pairs = pairs,
          .truth_samples = 8,
          .seed = seed};
}

/// Held-out errors of the paper's model, fitted to samples, on pairs of others.
std::vector<LevelComparison> errors_of(const Samples& samples, const PairSamples& truth) {
  const SideSamples front = side_samples(samples, Side::front);
  const Fabric result =
      test::need(fit(front.level, front.header, {}, {}, front.pairs[index_of(PairKind::measured)]));
  return test::need(compare(result, truth, PairKind::held_out)).levels;
}

TEST_CASE("a traced weave comes back from pictures with noise and shifts, within 1 dB of its own bake") {
  const test::Folder folder;
  const CellMesh mesh = test::need(load_cell("plain-weave"));
  BakeOptions fine = bake_options(3 * texels, 260, 5);
  fine.views = fine.lights = 1;
  fine.samples = 1;
  const Samples photographed = test::need(bake(mesh, "weave", fine)).samples;
  const Samples coarse = test::need(bake(mesh, "weave", bake_options(texels, 64, 9))).samples;
  const PairSamples& truth = coarse.pairs[index_of(PairKind::held_out)];
  const test::PhotographOptions photo;
  test::need(
      test::photograph(photographed.pairs[index_of(PairKind::held_out)], 260, folder / "pictures", photo));

  ImportOptions options{.width_mm = mesh.period.x * photo.size.x / photo.period.x,
                        .texels = V2i(texels, texels),
                        .views = 36,
                        .lights = 36};
  const std::string table = folder / "pictures/table.csv";
  const ImportReport report = test::need(import_pictures(table, options, folder / "import.exr"));
  CHECK(report.picture_count == 260);
  CHECK(report.held_out_count == 26);
  CHECK(report.period_mm.x == doctest::Approx(mesh.period.x).epsilon(0.003));
  // Pixels are square: along y the picture is of a cloth that is stretched.
  CHECK(report.period_mm.y ==
        doctest::Approx(mesh.period.x * photo.period.y / photo.period.x).epsilon(0.003));
  CHECK(report.leave_one_out_error < 0.3);

  const auto own = errors_of(coarse, truth);
  const auto measured = errors_of(test::need(read_samples(folder / "import.exr")), truth);
  REQUIRE(own.size() == measured.size());
  for (std::size_t k = 0; k < own.size(); ++k) {
    CAPTURE(k);
    CHECK(measured[k].psnr > own[k].psnr - 1);
    CHECK(std::abs(measured[k].relative_bias) < 0.05);
  }

  // The same bytes on any number of threads, and the given period as good as the found one.
  set_thread_limit(1);
  test::need(import_pictures(table, options, folder / "alone.exr"));
  set_thread_limit(0);
  CHECK(test::bytes_of(folder / "alone.exr") == test::bytes_of(folder / "import.exr"));
}

TEST_CASE("pictures that do not go together are refused in one line") {
  const test::Folder folder;
  PairSamples samples{.width = 1, .height = 1, .pairs = random_direction_pairs(20, 0.15, 3)};
  samples.alpha.assign(20, 1);
  samples.radiance.assign(20, V3f(0.1F));
  test::PhotographOptions photo;
  photo.size = {16, 12};
  photo.noise = 0;
  test::need(test::photograph(samples, 20, folder / "p", photo));
  const std::string table = folder / "p/table.csv";
  ImportOptions options{.width_mm = 16};
  const auto refused = [&](Code code, const std::string& why) {
    const Error error = test::error_of(import_pictures(table, options, folder / "o.exr"));
    CAPTURE(to_line(error));
    CHECK(error.code == code);
    CHECK(to_line(error).find(why) != std::string::npos);
    CHECK(folder.files() == 1);
  };
  refused(Code::image_mismatch, "show no period along x");
  options.period_mm = V2d(8, 40);
  refused(Code::option_out_of_range, "40 pixels; a picture has 12 along y");
  options.period_mm = V2d(8, 6);
  options.max_memory = 1000;
  refused(Code::file_too_large, "16 x 12 pixels");
  options.max_memory = 20000;
  refused(Code::file_too_large, "20 pictures of 8 x 6 texels");
  options.max_memory = 1 << 20;
  test::need(write_exr(folder / "p/7.exr", Image{4, 4, 3, std::vector<float>(48, 0.5F)}));
  refused(Code::image_mismatch, "7.exr: 4 x 4 pixels");
  Image broken{16, 12, 3, std::vector<float>(576, 0.5F)};
  broken.pixels[3 * (16 * 2 + 5)] = NAN;
  test::need(write_exr(folder / "p/7.exr", broken));
  refused(Code::image_unreadable, "pixel 5,2: is not finite");

  // A grey that all pictures have, by the exposure: radiance of 0.1 everywhere.
  test::need(test::photograph(samples, 20, folder / "p", photo));
  const ImportReport report = test::need(import_pictures(table, options, folder / "p/o.exr"));
  CHECK(report.texels == V2i(8, 6));
  CHECK(report.leave_one_out_error < 0.01);
  const PairSamples held = test::need(read_samples(folder / "p/o.exr")).pairs[index_of(PairKind::held_out)];
  REQUIRE(held.pairs.size() == 1);
  for (const V3f& r : held.radiance) CHECK(r.x == doctest::Approx(0.1).epsilon(0.001));
}

}  // namespace
}  // namespace selvedge
