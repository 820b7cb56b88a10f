#include "format/samples/pool.h"

#include <doctest/doctest.h>

using namespace selvedge;

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
