#include "fitter/alternation/start.h"

#include <algorithm>
#include <cmath>

#include "fitter/solve/principal.h"
#include "fitter/solve/texel_blocks.h"
#include "format/base/random.h"

namespace selvedge {
namespace {

/// Columns of numbers, `width` of them of `rows` each: [row][column].
struct Columns {
  std::size_t rows = 0;
  std::size_t width = 0;
  std::vector<double> value;
  double& at(std::size_t row, std::size_t column) { return value[row * width + column]; }
};

/// Makes the columns orthonormal, each to those before it (twice, for what rounding leaves); one that is a
/// combination of others becomes 0.
void make_orthonormal(Columns& columns) {
  for (std::size_t j = 0; j < columns.width; ++j) {
    const auto dot = [&](std::size_t i) {
      double sum = 0;
      for (std::size_t row = 0; row < columns.rows; ++row) sum += columns.at(row, i) * columns.at(row, j);
      return sum;
    };
    const double before = std::sqrt(dot(j));
    for (int pass = 0; pass < 2; ++pass) {
      for (std::size_t i = 0; i < j; ++i) {
        const double along = dot(i);
        for (std::size_t row = 0; row < columns.rows; ++row) columns.at(row, j) -= along * columns.at(row, i);
      }
    }
    const double length = std::sqrt(dot(j));
    const double factor = length > 1e-9 * before && length > 0 ? 1 / length : 0;
    for (std::size_t row = 0; row < columns.rows; ++row) columns.at(row, j) *= factor;
  }
}

Columns random_columns(std::size_t rows, std::size_t width, std::uint64_t seed) {
  Columns columns{rows, width, {}};
  Random random(seed);
  for (std::size_t i = 0; i < rows * width; ++i) columns.value.push_back(random.uniform() - 0.5);
  make_orthonormal(columns);
  return columns;
}

/// Sums over texels of one pass.
struct Pass {
  std::vector<double> views;       ///< [view][column]: X (X^T view columns)
  std::vector<double> lights;      ///< [3 * light + channel][column]: X^T (X light columns)
  std::vector<double> view_gram;   ///< [column][column]: of X^T view columns
  std::vector<double> light_gram;  ///< of X light columns
  std::vector<double> core;        ///< [view column][light column]: squares of a texel's

  void add(const Pass& other) {
    const auto join = [](std::vector<double>& to, const std::vector<double>& more) {
      for (std::size_t i = 0; i < to.size(); ++i) to[i] += more[i];
    };
    join(views, other.views);
    join(lights, other.lights);
    join(view_gram, other.view_gram);
    join(light_gram, other.light_gram);
    join(core, other.core);
  }
};

void add_gram(const std::vector<float>& rows, std::size_t width, double weight, std::vector<double>& gram) {
  for (std::size_t first = 0; first < rows.size(); first += width) {
    for (std::size_t a = 0; a < width; ++a) {
      const double scaled = weight * static_cast<double>(rows[first + a]);
      for (std::size_t b = 0; b <= a; ++b)
        gram[a * width + b] += scaled * static_cast<double>(rows[first + b]);
    }
  }
}

class Subspaces {
 public:
  Subspaces(std::size_t views, std::size_t stride, std::size_t lights, std::size_t width)
      : stride_(stride),
        width_(width),
        views_(random_columns(views, width, 1)),
        lights_(random_columns(3 * lights, width, 2)) {
    lay_out();
  }

  Pass empty() const {
    Pass pass;
    pass.views.resize(views_.value.size());
    pass.lights.resize(lights_.value.size());
    pass.view_gram.resize(width_ * width_);
    pass.light_gram.resize(width_ * width_);
    pass.core.resize(width_ * width_);
    return pass;
  }

  void add(const TexelRatios& x, Pass& pass) const {
    const std::size_t lights = x.light_of.size();
    std::vector<float> of_views(stride_ * width_, 0);
    std::vector<float> part(stride_ * width_);
    double largest = std::max({x.weight[0], x.weight[1], x.weight[2]});
    if (!(largest > 0)) return;
    std::array<float, 3> share{};
    for (std::size_t c = 0; c < 3; ++c) share[c] = static_cast<float>(x.weight[c] / largest);
    const double unit = largest * largest;
    for (std::size_t c = 0; c < 3; ++c) {
      weighted_sums({x.value[c].data(), stride_, 1, lights, stride_}, x.light_of.data(),
                    light_columns_[c].data(), width_, part.data());
      for (std::size_t i = 0; i < part.size(); ++i) of_views[i] += share[c] * part[i];
    }
    add_gram(of_views, width_, unit, pass.light_gram);
    std::vector<double> core(width_ * width_, 0);
    for (std::size_t v = 0; v < views_.rows; ++v) {
      for (std::size_t a = 0; a < width_; ++a) {
        for (std::size_t b = 0; b < width_; ++b) {
          core[a * width_ + b] +=
              views_.value[v * width_ + a] * static_cast<double>(of_views[v * width_ + b]);
        }
      }
    }
    for (std::size_t i = 0; i < core.size(); ++i) pass.core[i] += unit * core[i] * core[i];
    for (std::size_t c = 0; c < 3; ++c) {
      const auto weight = unit * static_cast<double>(share[c]);
      const PairWeights by_light{x.value[c].data(), lights, stride_, stride_, 1};
      std::vector<float> rows(lights * width_);
      weighted_sums(by_light, nullptr, of_views.data(), width_, rows.data());
      for (std::size_t l = 0; l < lights; ++l) {
        for (std::size_t j = 0; j < width_; ++j) {
          pass.lights[(3 * std::size_t{x.light_of[l]} + c) * width_ + j] +=
              weight * static_cast<double>(rows[l * width_ + j]);
        }
      }
      weighted_sums(by_light, nullptr, view_columns_.data(), width_, rows.data());
      add_gram(rows, width_, weight * static_cast<double>(share[c]), pass.view_gram);
      weighted_sums({x.value[c].data(), stride_, 1, lights, stride_}, nullptr, rows.data(), width_,
                    part.data());
      for (std::size_t i = 0; i < views_.value.size(); ++i) {
        pass.views[i] += weight * static_cast<double>(share[c]) * static_cast<double>(part[i]);
      }
    }
  }

  /// One step of the iteration.
  void step(const Pass& pass) {
    views_.value = pass.views;
    lights_.value = pass.lights;
    make_orthonormal(views_);
    make_orthonormal(lights_);
    lay_out();
  }

  /// Turns the columns to the principal ones.
  void turn(const Pass& pass) {
    turn(views_, pass.view_gram);
    turn(lights_, pass.light_gram);
    lay_out();
  }

  const Columns& views() const { return views_; }
  const Columns& lights() const { return lights_; }

 private:
  static void turn(Columns& columns, const std::vector<double>& gram) {
    const Principal principal = principal_components(gram, columns.width, columns.width);
    const Columns before = columns;
    for (std::size_t row = 0; row < columns.rows; ++row) {
      for (std::size_t j = 0; j < columns.width; ++j) {
        double sum = 0;
        for (std::size_t i = 0; i < columns.width; ++i) {
          sum += before.value[row * columns.width + i] * principal.vectors[j][i];
        }
        columns.at(row, j) = sum;
      }
    }
  }

  void lay_out() {
    view_columns_.assign(stride_ * width_, 0);
    for (std::size_t i = 0; i < views_.value.size(); ++i)
      view_columns_[i] = static_cast<float>(views_.value[i]);
    for (std::size_t c = 0; c < 3; ++c) {
      light_columns_[c].clear();
      for (std::size_t row = c; row < lights_.rows; row += 3) {
        for (std::size_t j = 0; j < width_; ++j)
          light_columns_[c].push_back(static_cast<float>(lights_.at(row, j)));
      }
    }
  }

  std::size_t stride_;
  std::size_t width_;
  Columns views_;
  Columns lights_;
  std::vector<float> view_columns_;                  ///< [view][column]
  std::array<std::vector<float>, 3> light_columns_;  ///< [light][column]
};

/// A column with mean square 1.
std::vector<double> function_of(const Columns& columns, std::size_t column) {
  std::vector<double> result;
  const double scale = std::sqrt(static_cast<double>(columns.rows));
  for (std::size_t row = 0; row < columns.rows; ++row) {
    result.push_back(scale * columns.value[row * columns.width + column]);
  }
  return result;
}

}  // namespace

SharedFunctions start_functions(std::size_t texels, const std::function<TexelRatios(std::size_t)>& ratios,
                                std::size_t views, std::size_t stride, std::size_t lights,
                                std::size_t count) {
  constexpr int steps = 2;
  // Some more columns than are needed make the iteration quick.
  const std::size_t width = (count + 8 + column_group - 1) / column_group * column_group;
  Subspaces spaces(views, stride, lights, width);
  const auto pass_over = [&] {
    return sum_over_blocks(texels, spaces.empty(),
                           [&](std::size_t texel, Pass& pass) { spaces.add(ratios(texel), pass); });
  };
  for (int i = 0; i < steps; ++i) spaces.step(pass_over());
  spaces.turn(pass_over());
  const Pass last = pass_over();
  std::vector<std::size_t> strongest;
  for (std::size_t i = 0; i < last.core.size(); ++i) strongest.push_back(i);
  std::stable_sort(strongest.begin(), strongest.end(),
                   [&](std::size_t a, std::size_t b) { return last.core[a] > last.core[b]; });
  SharedFunctions functions;
  for (std::size_t m = 0; m < count; ++m) {
    functions.view.push_back(function_of(spaces.views(), strongest[m] / width));
    functions.light.push_back(function_of(spaces.lights(), strongest[m] % width));
  }
  return functions;
}

}  // namespace selvedge
