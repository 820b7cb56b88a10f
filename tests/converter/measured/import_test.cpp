#include "converter/measured/import.h"

#include <doctest/doctest.h>

#include <fmt/format.h>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>

#include "converter/bake/bake.h"
#include "converter/measured/repeats.h"
#include "converter/measured/scattered.h"
#include "fitter/fit.h"
#include "format/base/atomic_file.h"
#include "format/base/parallel.h"
#include "format/base/random.h"
#include "format/fabric/lafortune.h"
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

/// A picture of four channels; row 0 is on top.
Image picture_of(const V2i& size, const std::function<double(int x, int y)>& value) {
  Image picture{size.x, size.y, 4, {}};
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      const auto v = static_cast<float>(value(x, y));
      for (const float channel : {v, v / 2, 0.0F, 1.0F}) picture.pixels.push_back(channel);
    }
  }
  return picture;
}

TEST_CASE("the period is found to a twentieth of a pixel under noise, not a part of it and not a multiple") {
  const V2d period(17.37, 12.81);
  std::array<Image, 4> pictures;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    Random random(3, i);
    pictures[i] = luminance_of(picture_of({90, 70}, [&](int x, int y) {
      const double a = 2 * std::numbers::pi * x / period.x;
      const double b = 2 * std::numbers::pi * y / period.y;
      // Two bumps a period, not quite alike.
      return 1 + std::sin(2 * a) + 0.5 * std::sin(a) + 0.7 * std::cos(b + a) + 0.4 * (random.uniform() - 0.5);
    }));
  }
  CHECK(std::abs(find_period(pictures, 0).value_or(0) - period.x) < 0.05);
  CHECK(std::abs(find_period(pictures, 1).value_or(0) - period.y) < 0.05);
  // Noise alone, and nothing at all.
  for (const double amplitude : {1.0, 0.0}) {
    Random random(5);
    const std::array<Image, 1> none{
        luminance_of(picture_of({90, 70}, [&](int, int) { return 1 + amplitude * random.uniform(); }))};
    CHECK_FALSE(find_period(none, 0).has_value());
    CHECK_FALSE(find_period(none, 1).has_value());
  }
}

TEST_CASE("texels are means of what they cover of all repeats, from the lower left corner") {
  const RepeatAverage average({12, 8}, {6, 4}, {3, 2});
  const RepeatAverage::Cell cell =
      average.average(picture_of({12, 8}, [](int x, int y) { return x % 6 + 10 * ((7 - y) % 4); }));
  REQUIRE(cell.values.size() == 6);
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 3; ++i) {
      const double expected = 2 * i + 0.5 + 10 * (2 * j + 0.5);
      CHECK(cell.values[j * 3 + i].x == doctest::Approx(expected));
      CHECK(cell.values[j * 3 + i].y == doctest::Approx(expected / 2));
    }
  }
  CHECK(cell.variance == doctest::Approx(0));
  CHECK(average.repeats() == V2d(2, 2));
  // Parts of pixels: a ramp has its value at the centre of every texel, whatever the period.
  const RepeatAverage uneven({12, 8}, {12, 8}, {5, 7});
  const auto ramp = uneven.average(picture_of({12, 8}, [](int x, int) { return x + 0.5; }));
  for (int i = 1; i < 4; ++i) CHECK(ramp.values[i].x == doctest::Approx((i + 0.5) * 12 / 5).epsilon(0.02));
}

TEST_CASE("holes do not count for radiance, and are opacity") {
  const auto open = [](int x, int) { return x % 4 == 0 ? 0.0 : 1.0; };
  const RepeatAverage average({16, 8}, {8, 8}, {4, 1}, picture_of({16, 8}, open));
  const auto cell =
      average.average(picture_of({16, 8}, [&](int x, int y) { return open(x, y) > 0 ? 3 : 77; }));
  const std::vector<float> alpha = average.alpha();
  for (int i = 0; i < 4; ++i) {
    CHECK(cell.values[i].x == doctest::Approx(3));
    CHECK(alpha[i] == doctest::Approx(i % 2 == 0 ? 0.5 : 1));
  }
  const RepeatAverage nothing({16, 8}, {8, 8}, {4, 1}, picture_of({16, 8}, [](int, int) { return 0; }));
  CHECK(nothing.average(picture_of({16, 8}, open)).values[2] == V3f(0, 0, 0));
  CHECK(nothing.alpha()[2] == 0);
}

enum class Function { lambert, gloss, bilinear };

double value_of(Function function, const DirectionPair& pair) {
  const V3d light(pair.light);
  const V3d view(pair.view);
  const std::array<double, 5> gloss{0.1, -0.8, -0.8, 0.9, 3};
  if (function == Function::gloss) return lafortune(gloss.data(), 1, &light.x, &view.x);
  return function == Function::lambert ? light.z : (1 + light.x - light.y) * (2 + view.z);
}

PairValues known_at(Function function, const std::vector<DirectionPair>& pairs) {
  PairValues known{pairs, {}};
  known.values.resize(static_cast<Eigen::Index>(pairs.size()), 1);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    known.values(static_cast<Eigen::Index>(i), 0) = static_cast<float>(value_of(function, pairs[i]));
  return known;
}

/// Relative root mean square error at other pairs.
double error_of(Function function, const PairValues& known, const std::vector<DirectionPair>& pairs) {
  const Eigen::MatrixXf found = interpolate(known, choose_covariance(known, 1), pairs);
  double error = 0;
  double energy = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double truth = value_of(function, pairs[i]);
    error += std::pow(static_cast<double>(found(static_cast<Eigen::Index>(i), 0)) - truth, 2);
    energy += truth * truth;
  }
  return std::sqrt(error / energy);
}

TEST_CASE("functions of light and view are recovered from 400 scattered pairs") {
  const auto error = [](Function function) {
    return error_of(function, known_at(function, random_direction_pairs(400, 0.15, 11)),
                    random_direction_pairs(200, 0.15, 12));
  };
  CHECK(error(Function::lambert) < 0.005);
  CHECK(error(Function::bilinear) < 0.005);
  CHECK(error(Function::gloss) < 0.1);
}

TEST_CASE("the left-out error is the error of interpolation without each pair") {
  const PairValues known = known_at(Function::gloss, random_direction_pairs(25, 0.15, 13));
  const PairCovariance kernel = choose_covariance(known, 1);
  double error = 0;
  for (std::size_t i = 0; i < known.pairs.size(); ++i) {
    PairValues others{{}, {}};
    others.values.resize(24, 1);
    for (std::size_t j = 0; j < known.pairs.size(); ++j) {
      if (j == i) continue;
      others.values(static_cast<Eigen::Index>(others.pairs.size()), 0) =
          known.values(static_cast<Eigen::Index>(j), 0);
      others.pairs.push_back(known.pairs[j]);
    }
    const float found = interpolate(others, kernel, {&known.pairs[i], 1})(0, 0);
    error += std::pow(1.0 * found - 1.0 * known.values(static_cast<Eigen::Index>(i), 0), 2);
  }
  const double expected = std::sqrt(error) / known.values.cast<double>().norm();
  CHECK(kernel.leave_one_out_error == doctest::Approx(expected).epsilon(1e-4));
}

}  // namespace
}  // namespace selvedge
