#include "format/samples/samples.h"

#include <doctest/doctest.h>

#include "format/samples/pool.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

SamplesHeader small_header() {
  SamplesHeader header;
  header.width = 3;
  header.height = 2;
  header.views = {2, 2};
  header.lights = {1, 3};
  header.pairs[1] = random_direction_pairs(2, 0.15, 1);
  header.provenance = R"({"stitch":"none"})";
  return header;
}

ViewSamples view_samples(const SamplesHeader& h, int view) {
  const auto texels = static_cast<std::size_t>(h.texels());
  const auto lights = static_cast<std::size_t>(h.lights.count());
  ViewSamples s;
  for (std::size_t t = 0; t < texels; ++t) {
    s.alpha.push_back(0.25F * static_cast<float>(view + 1));
    s.normal.emplace_back(0.0F, 0.5F, static_cast<float>(t));
  }
  for (std::size_t i = 0; i < texels * lights; ++i) {
    // Whole numbers below 2048 are exact in half precision.
    s.radiance.emplace_back(static_cast<float>(i), static_cast<float>(view), 1.0F);
  }
  return s;
}

Samples small_samples(float last_value = 1) {
  Samples samples;
  const SamplesHeader& header = samples.header = small_header();
  for (int v = 0; v < header.views.count(); ++v) {
    samples.views.push_back(view_samples(header, v));
    samples.views.back().radiance.back().z = last_value;
  }
  PairSamples& pairs = samples.pairs[1];
  pairs.width = header.width;
  pairs.height = header.height;
  pairs.pairs = header.pairs[1];
  for (std::size_t i = 0; i < 2 * static_cast<std::size_t>(header.texels()); ++i) {
    pairs.alpha.push_back(0.5F);
    pairs.alpha_noise.push_back(-0.25F);
    pairs.radiance.emplace_back(static_cast<float>(i), 2.0F, 3.0F);
    pairs.noise.emplace_back(0.5F, -0.5F, static_cast<float>(i));
  }
  return samples;
}

}  // namespace

TEST_CASE("samples come back from their file in the texel's order") {
  const Folder folder;
  const SamplesHeader header = small_header();
  test::need(write_samples(folder / "s.exr", small_samples()));
  const Samples samples = test::need(read_samples(folder / "s.exr"));
  CHECK(samples.header.width == 3);
  CHECK(samples.header.lights == header.lights);
  CHECK(samples.header.pairs[1][1].light == header.pairs[1][1].light);
  const SideSamples front = side_samples(samples, Side::front);
  const SampleLevel& level = front.level;
  for (std::size_t t = 0; t < 6; ++t) {
    CHECK(level.normal_sum[t] == V3f(0, 2, 4 * static_cast<float>(t)));
    for (std::size_t v = 0; v < 4; ++v) {
      CHECK(level.alpha[t * 4 + v] == 0.25F * static_cast<float>(v + 1));
      for (std::size_t l = 0; l < 3; ++l) {
        const V3f& r = level.radiance[(t * 4 + v) * 3 + l];
        CHECK(r == V3f(static_cast<float>(l * 6 + t), static_cast<float>(v), 1));
      }
    }
  }
  const PairSamples& pairs = front.pairs[index_of(PairKind::held_out)];
  CHECK(pairs.radiance[7] == V3f(7, 2, 3));
  CHECK(pairs.noise[7] == V3f(0.5F, -0.5F, 7));
  CHECK(front.pairs[index_of(PairKind::measured)].pairs.empty());
}

TEST_CASE("negative samples are refused with their place, in a file and before they are written") {
  const Folder folder;
  Samples samples = small_samples(-1);
  test::need(write_samples(folder / "s.exr", samples));
  for (const Error& error :
       {test::error_of(read_samples(folder / "s.exr")), test::error_of(round_to_half(samples))}) {
    CHECK(error.code == Code::samples_not_finite);
    CHECK(error.place == "radiance/pixel 8,1");
  }
  for (const float value : {std::nanf(""), 1e6F}) {
    Samples wild = small_samples(value);
    CHECK(test::error_of(round_to_half(wild)).code == Code::samples_not_finite);
  }
}

TEST_CASE("a count that does not fit into an int is refused") {
  std::string text = samples_header_to_json(SamplesHeader());
  const std::size_t at = text.find("\"columns\":8");
  REQUIRE(at != std::string::npos);
  text.replace(at, 11, "\"columns\":4294967297");
  const Error error = test::error_of(samples_header_from_json(text, "s.exr"));
  CHECK(error.code == Code::samples_malformed);
  CHECK(error.message.starts_with("4294967297 is outside of 1 to "));
}

TEST_CASE("samples of another version are refused, with both versions") {
  std::string text = samples_header_to_json(SamplesHeader());
  REQUIRE(samples_header_from_json(text, "s.exr"));
  const std::size_t at = text.find("\"version\":3");
  REQUIRE(at != std::string::npos);
  text.replace(at, 11, "\"version\":1");
  const Error error = test::error_of(samples_header_from_json(text, "s.exr"));
  CHECK(error.code == Code::samples_malformed);
  CHECK(error.message == "1 is not understood: this program reads version 3");
}

TEST_CASE("the fractions of a coarse texel sum to 1 and cover every fine texel once") {
  for (int fine = 1; fine <= 40; ++fine) {
    const int coarse = fine > 1 ? fine / 2 : 1;
    std::vector<double> covered(static_cast<std::size_t>(fine), 0);
    for (const auto& row : texel_overlaps(fine, coarse)) {
      double sum = 0;
      for (const Overlap& o : row) {
        sum += o.fraction;
        covered[o.fine] += o.fraction * fine / coarse;
      }
      CHECK(sum == doctest::Approx(1));
    }
    for (const double c : covered) CHECK(c == doctest::Approx(1));
  }
}

TEST_CASE("pooling weights radiance by opacity and averages opacity by area") {
  SampleLevel fine{.width = 2,
                   .height = 1,
                   .views = 1,
                   .lights = 1,
                   .alpha = {1.0F, 0.25F},
                   .normal_sum = {V3f(0, 0, 1), V3f(0.25F, 0, 0)},
                   .radiance = {V3f(1, 1, 1), V3f(5, 5, 5)}};
  const SampleLevel coarse = pool(fine);
  CHECK(coarse.width == 1);
  CHECK(coarse.alpha[0] == doctest::Approx(0.625));
  CHECK(coarse.radiance[0].x == doctest::Approx((1.0 + 0.25 * 5) / 1.25));
  CHECK(coarse.normal_sum[0].x == doctest::Approx(0.125));
}

TEST_CASE("odd sizes keep the mean") {
  std::vector<V3d> values;
  V3d sum(0, 0, 0);
  for (int i = 0; i < 35; ++i) {
    values.emplace_back(i * i % 17, i, 1);
    sum += values.back() / 35;
  }
  std::vector<V3d> pooled = pool_image(values, 7, 5);
  CHECK(pooled.size() == 6);
  V3d mean(0, 0, 0);
  for (const V3d& v : pooled) mean += v / 6;
  CHECK(mean.x == doctest::Approx(sum.x));
  CHECK(mean.y == doctest::Approx(sum.y));
  CHECK(mean.z == doctest::Approx(1));
}
