#include "fitter/products/texel_basis.h"

#include <doctest/doctest.h>

#include <cmath>

#include "format/base/random.h"

using namespace selvedge;

TEST_CASE("texels that are products of few functions are found again") {
  const DirectionGrid views{4, 4};
  const DirectionGrid lights{4, 3};
  Random random(2);
  std::vector<SampleLevel> levels;
  for (const int width : {4, 2}) {
    SampleLevel level{.width = width, .height = width, .views = views.count(), .lights = lights.count()};
    level.normal_sum.assign(width * width, V3f(0, 0, 1));
    for (int texel = 0; texel < width * width; ++texel) {
      const auto a = static_cast<float>(random.uniform());
      const auto b = static_cast<float>(random.uniform());
      for (const V3f& v : cell_directions(views)) {
        level.alpha.push_back(level.alpha.size() % 16 == 5 ? 0.0F : a);  // one view sees holes
        for (const V3f& l : cell_directions(lights))
          level.radiance.emplace_back(a * l.z * (1 + v.x) + b * v.z * (l.y + 1), a * l.z * (1 + v.x),
                                      b * v.z);
      }
    }
    levels.push_back(level);
  }
  const std::vector<BasisFit> fitted = texel_basis(levels, lights, 6, 8);
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const SampleLevel& level = levels[k];
    double error = 0;
    double energy = 0;
    for (std::size_t row = 0; row < level.alpha.size(); ++row) {
      const std::size_t texel = row / 16;
      for (int l = 0; l < 12; ++l) {
        for (int c = 0; c < 3; ++c) {
          double f = 0;
          for (std::size_t m = 0; m < fitted[k].pairs.size(); ++m) {
            const V2i pair = fitted[k].pairs[m];
            f +=
                static_cast<double>(fitted[k].coefficient[texel * fitted[k].pairs.size() + m] *
                                    fitted[k].view_functions[pair.x][row % 16] * cell_direction(lights, l).z *
                                    fitted[k].light_functions[pair.y][static_cast<std::size_t>(3 * l + c)]);
          }
          const auto alpha = static_cast<double>(level.alpha[row]);
          const auto truth = static_cast<double>(level.radiance[row * 12 + static_cast<std::size_t>(l)][c]);
          error += alpha * alpha * (f - truth) * (f - truth);
          energy += alpha * alpha * truth * truth;
        }
      }
    }
    CHECK(std::sqrt(error / energy) < 0.01);  // the functions' rounding, and a slight pull towards 0
  }
}
