#include "fitter/alternation/texel.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fitter/lobes/lobe_values.h"
#include "fitter/solve/small_solve.h"
#include "fitter/solve/view_sums.h"

namespace selvedge {
namespace {

std::vector<std::uint32_t> all_lights(const TexelSamples& samples) {
  std::vector<std::uint32_t> lights(samples.lights.size());
  std::iota(lights.begin(), lights.end(), 0U);
  return lights;
}

ChannelOptions without_tables(ChannelOptions options) {
  options.view_table = options.light_table = false;
  return options;
}

/// The table nearest to the minimum of `value`, a convex function of it, that is not negative and no worse
/// than the one that is there. `wanted`: the minimum without bounds.
template <class Value>
void move_table(std::vector<double>& table, const std::vector<double>& wanted, const Value& value) {
  std::vector<double> trial = wanted;
  for (double& t : trial) t = std::max(t, 0.0);
  const double before = value(table);
  if (value(trial) <= before) {
    table = trial;
    return;
  }
  // On the way to the minimum the value falls: as far as the first entry that comes to 0.
  double step = 1;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (wanted[i] < 0) step = std::min(step, table[i] / (table[i] - wanted[i]));
  }
  for (std::size_t i = 0; i < table.size(); ++i) {
    trial[i] = std::max(0.0, table[i] + step * (wanted[i] - table[i]));
  }
  if (value(trial) <= before) table = trial;
}

/// Moves a table towards the minimum of its penalty and of table^2 square - 2 table cross, summed over its
/// directions.
void solve_table(DirectionTableSystem system, const std::vector<double>& square,
                 const std::vector<double>& cross, std::vector<double>& table) {
  system.factor(square.data());
  std::vector<double> wanted(table.size());
  system.solve(cross.data(), wanted.data());
  move_table(table, wanted, [&](const std::vector<double>& of) {
    double sum = system.penalty(of.data());
    for (std::size_t i = 0; i < of.size(); ++i) sum += of[i] * (of[i] * square[i] - 2 * cross[i]);
    return sum;
  });
}

}  // namespace

ProductTexel::ProductTexel(const TexelSamples& samples, const ProductTexelOptions& options,
                           const PreparedFunctions& shared)
    : samples_(samples), options_(options), shared_(shared) {
  double weights = 0;
  for (const double w : samples.weight) {
    weight_.push_back(static_cast<float>(w));
    weights += w;
  }
  unit_ = std::max({samples.scale[0], samples.scale[1], samples.scale[2]});
  for (std::size_t c = 0; c < 3; ++c) {
    share_[c] = (samples.scale[c] / unit_) * (samples.scale[c] / unit_);
    problems_.emplace_back(samples, static_cast<int>(c), all_lights(samples),
                           without_tables(options.lobes.channel));
    if (weights > 0 && samples.all_lights > 0) {
      mean_square_[c] = problems_[c].energy() / (weights * static_cast<double>(samples.all_lights));
    }
    pull_[c] = options.pull * mean_square_[c];
  }
}

std::vector<float> ProductTexel::table_of(std::size_t channel) const {
  std::vector<float> table(samples_.stride(), 0);
  for (std::size_t v = 0; v < samples_.views; ++v) {
    table[v] = static_cast<float>(state_.channels[channel].table[v]);
  }
  return table;
}

float ProductTexel::light_factor(std::size_t channel, std::size_t light) const {
  const std::vector<double>& table = state_.channels[channel].light_table;
  return table.empty() ? 1.0F : static_cast<float>(table[samples_.light_of[light]]);
}

void ProductTexel::evaluate_lobes(std::size_t channel) {
  const std::size_t stride = samples_.stride();
  const ChannelState& state = state_.channels[channel];
  g_[channel].resize(samples_.lights.size() * stride);
  for (std::size_t l = 0; l < samples_.lights.size(); ++l) {
    float* g = &g_[channel][l * stride];
    lobe_values(samples_, static_cast<std::uint32_t>(l), state.shapes, state.sizes, g);
    for (std::size_t v = 0; v < stride; ++v) g[v] *= samples_.lights[l].z;
  }
}

void ProductTexel::evaluate_products(std::size_t channel) {
  const std::size_t stride = samples_.stride();
  const std::vector<float> nothing(stride, 0);
  products_[channel].resize(samples_.lights.size() * stride);
  std::array<float, PreparedFunctions::most> c{};
  for (std::size_t l = 0; l < samples_.lights.size(); ++l) {
    const float* psi = shared_.lights(channel) + samples_.light_of[l] * column_group;
    for (std::size_t m = 0; m < shared_.count(); ++m) {
      c[m] = static_cast<float>(state_.coefficients[m]) * psi[m];
    }
    combine_rows(nothing.data(), 0, c.data(), shared_.count(), shared_.view_rows(), stride,
                 &products_[channel][l * stride]);
  }
}

void ProductTexel::take(const ProductState& state) {
  state_ = state;
  for (std::size_t c = 0; c < 3; ++c) {
    evaluate_lobes(c);
    evaluate_products(c);
  }
}

double ProductTexel::error() {
  const std::size_t stride = samples_.stride();
  scratch_.resize(stride);
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<float> table = table_of(c);
    double of_channel = 0;
    for (std::size_t l = 0; l < samples_.lights.size(); ++l) {
      const float one = 1;
      combine_rows(table.data(), light_factor(c, l), &one, 1, &products_[c][l * stride], stride,
                   scratch_.data());
      of_channel += squared_error(weight_.data(), &g_[c][l * stride], &samples_.radiance[c][l * stride],
                                  scratch_.data(), stride);
    }
    sum += share_[c] * of_channel;
  }
  return sum * unit_ * unit_;
}

double ProductTexel::energy() const {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += share_[c] * problems_[c].energy();
  return sum * unit_ * unit_;
}

double ProductTexel::pull_cost() const {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t m = 0; m < shared_.count(); ++m) {
      for (std::size_t n = 0; n < shared_.count(); ++n) {
        const double apart = m == n ? 1 + options_.apart : 1;
        sum += share_[c] * pull_[c] * apart * state_.coefficients[m] * state_.coefficients[n] *
               shared_.view_product(m, n) * shared_.light_product(c, m, n);
      }
    }
  }
  return sum;
}

double ProductTexel::cost() {
  double sum = pull_cost();
  for (std::size_t c = 0; c < 3; ++c) {
    const ChannelState& state = state_.channels[c];
    const ChannelProblem& problem = problems_[c];
    double penalty = problem.size_penalty(state);
    const DirectionTableOptions& tables = options_.lobes.channel.table;
    if (options_.lobes.channel.view_table) {
      penalty += view_table_system(samples_, problem.energy(), tables).penalty(state.table.data());
    }
    if (!state.light_table.empty()) {
      penalty += light_table_system(samples_, problem.energy(), tables).penalty(state.light_table.data());
    }
    sum += share_[c] * penalty;
  }
  return sum * unit_ * unit_ + error();
}

void ProductTexel::rescale_tables() {
  const DirectionTableOptions& tables = options_.lobes.channel.table;
  for (std::size_t c = 0; c < 3; ++c) {
    ChannelState& state = state_.channels[c];
    const auto rescale = [&](std::vector<double>& table, const DirectionTableSystem& system) {
      const auto penalty = [&](double factor) {
        std::vector<double> scaled = table;
        for (double& t : scaled) t *= factor;
        return system.penalty(scaled.data());
      };
      // A quadratic function of the factor, from three of its values.
      const double none = penalty(0);
      const double square = 0.5 * (penalty(2) + none) - penalty(1);
      const double linear = penalty(1) - none - square;
      if (!(square > 0) || !(linear < 0)) return;
      const double factor = -0.5 * linear / square;
      for (std::size_t j = 1; j < state.sizes.size(); ++j) {
        if (state.sizes[j] / factor > problems_[c].peak()) return;
      }
      for (double& t : table) t *= factor;
      for (double& size : state.sizes) size /= factor;
    };
    const double energy = problems_[c].energy();
    if (options_.lobes.channel.view_table) rescale(state.table, view_table_system(samples_, energy, tables));
    if (!state.light_table.empty()) rescale(state.light_table, light_table_system(samples_, energy, tables));
    evaluate_lobes(c);
  }
}

int ProductTexel::improve_lobes(double tolerance, int iterations) {
  const std::size_t stride = samples_.stride();
  int evaluations = 0;
  std::vector<float> factor(samples_.lights.size() * stride);
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<float> table = table_of(c);
    for (std::size_t l = 0; l < samples_.lights.size(); ++l) {
      const float one = 1;
      combine_rows(table.data(), light_factor(c, l), &one, 1, &products_[c][l * stride], stride,
                   &factor[l * stride]);
    }
    ChannelProblem& problem = problems_[c];
    problem.set_factor(factor);
    ChannelState& state = state_.channels[c];
    ChannelState trial;
    trial.shapes = state.shapes;
    trial.sizes = state.sizes;
    trial.table.assign(samples_.views, 1);
    bool converged = false;
    evaluations += minimise(problem, trial, tolerance, iterations, converged);
    state.shapes = trial.shapes;
    state.sizes = trial.sizes;
    evaluate_lobes(c);
  }
  return evaluations;
}

void ProductTexel::improve_table(std::size_t channel) {
  const std::size_t stride = samples_.stride();
  ChannelState& state = state_.channels[channel];
  std::vector<double> square(stride, 0);
  std::vector<double> cross(stride, 0);
  scratch_.resize(2 * stride);
  float* squares = scratch_.data();
  float* crosses = squares + stride;
  for (std::size_t l = 0; l < samples_.lights.size(); ++l) {
    weigh_row(weight_.data(), &g_[channel][l * stride], &samples_.radiance[channel][l * stride],
              &products_[channel][l * stride], stride, squares, crosses);
    const auto s = static_cast<double>(light_factor(channel, l));
    for (std::size_t v = 0; v < stride; ++v) {
      square[v] += s * s * static_cast<double>(squares[v]);
      cross[v] += s * static_cast<double>(crosses[v]);
    }
  }
  solve_table(view_table_system(samples_, problems_[channel].energy(), options_.lobes.channel.table), square,
              cross, state.table);
}

void ProductTexel::improve_light_table(std::size_t channel) {
  const std::size_t stride = samples_.stride();
  ChannelState& state = state_.channels[channel];
  std::vector<double> square(samples_.all_lights, 0);
  std::vector<double> cross(samples_.all_lights, 0);
  scratch_.resize(2 * stride);
  float* squares = scratch_.data();
  float* crosses = squares + stride;
  for (std::size_t l = 0; l < samples_.lights.size(); ++l) {
    weigh_row(weight_.data(), &g_[channel][l * stride], &samples_.radiance[channel][l * stride],
              &products_[channel][l * stride], stride, squares, crosses);
    double& of_light = square[samples_.light_of[l]];
    for (std::size_t v = 0; v < samples_.views; ++v) {
      const double t = state.table[v];
      of_light += t * t * static_cast<double>(squares[v]);
      cross[samples_.light_of[l]] += t * static_cast<double>(crosses[v]);
    }
  }
  solve_table(light_table_system(samples_, problems_[channel].energy(), options_.lobes.channel.table), square,
              cross, state.light_table);
}

void ProductTexel::improve_tables() {
  for (std::size_t c = 0; c < 3; ++c) {
    if (options_.lobes.channel.view_table) improve_table(c);
    if (!state_.channels[c].light_table.empty()) improve_light_table(c);
  }
}

void ProductTexel::sum(Side side) {
  side_ = side;
  const std::size_t stride = samples_.stride();
  const std::size_t lights = samples_.lights.size();
  const std::size_t width = shared_.pair_width();
  std::vector<float> square(lights * stride);
  std::vector<float> cross(stride);
  const std::vector<float> nothing(stride, 0);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t l = 0; l < lights; ++l) {
      weigh_row(weight_.data(), &g_[c][l * stride], nothing.data(), nothing.data(), stride,
                &square[l * stride], cross.data());
    }
    if (side == Side::lights) {
      square_sums_[c].resize(lights * width);
      weighted_sums({square.data(), lights, stride, stride, 1}, nullptr, shared_.view_pairs(), width,
                    square_sums_[c].data());
    } else {
      square_sums_[c].resize(stride * width);
      weighted_sums({square.data(), stride, 1, lights, stride}, samples_.light_of.data(),
                    shared_.light_pairs(c), width, square_sums_[c].data());
    }
  }
}

void ProductTexel::residual_sums() {
  const std::size_t stride = samples_.stride();
  const std::size_t lights = samples_.lights.size();
  std::vector<float> square(stride);
  std::vector<float> cross(lights * stride);
  std::vector<float> base(stride);
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<float> table = table_of(c);
    for (std::size_t l = 0; l < lights; ++l) {
      combine_rows(table.data(), light_factor(c, l), nullptr, 0, nullptr, stride, base.data());
      weigh_row(weight_.data(), &g_[c][l * stride], &samples_.radiance[c][l * stride], base.data(), stride,
                square.data(), &cross[l * stride]);
    }
    if (side_ == Side::lights) {
      cross_sums_[c].resize(lights * column_group);
      weighted_sums({cross.data(), lights, stride, stride, 1}, nullptr, shared_.views(), column_group,
                    cross_sums_[c].data());
    } else {
      cross_sums_[c].resize(stride * column_group);
      weighted_sums({cross.data(), stride, 1, lights, stride}, samples_.light_of.data(), shared_.lights(c),
                    column_group, cross_sums_[c].data());
    }
  }
}

void ProductTexel::improve_coefficients() {
  const std::size_t count = shared_.count();
  const std::size_t width = shared_.pair_width();
  residual_sums();
  std::vector<double> square(width, 0);
  std::vector<double> cross(column_group, 0);
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t rows = square_sums_[c].size() / width;
    std::vector<double> of_channel(width, 0);
    std::vector<double> cross_of_channel(column_group, 0);
    for (std::size_t row = 0; row < rows; ++row) {
      const bool lights = side_ == Side::lights;
      const std::size_t at = lights ? samples_.light_of[row] : row;
      const float* pairs = (lights ? shared_.light_pairs(c) : shared_.view_pairs()) + at * width;
      const float* each = (lights ? shared_.lights(c) : shared_.views()) + at * column_group;
      for (std::size_t p = 0; p < width; ++p) {
        of_channel[p] += static_cast<double>(square_sums_[c][row * width + p] * pairs[p]);
      }
      for (std::size_t m = 0; m < count; ++m) {
        cross_of_channel[m] += static_cast<double>(cross_sums_[c][row * column_group + m] * each[m]);
      }
    }
    for (std::size_t m = 0; m < count; ++m) {
      for (std::size_t n = 0; n <= m; ++n) {
        const double apart = m == n ? 1 + options_.apart : 1;
        square[PreparedFunctions::pair(m, n)] +=
            share_[c] * (of_channel[PreparedFunctions::pair(m, n)] +
                         pull_[c] * apart * shared_.view_product(m, n) * shared_.light_product(c, m, n));
      }
      cross[m] += share_[c] * cross_of_channel[m];
    }
  }
  std::vector<double> matrix(count * count);
  std::vector<char> fixed(count);
  for (std::size_t m = 0; m < count; ++m) {
    for (std::size_t n = 0; n <= m; ++n) {
      matrix[m * count + n] = matrix[n * count + m] = square[PreparedFunctions::pair(m, n)];
    }
    fixed[m] = matrix[m * count + m] > 0 ? 0 : 1;
  }
  const auto value = [&](const std::vector<double>& x) {
    double sum = 0;
    for (std::size_t m = 0; m < count; ++m) {
      double row = -2 * cross[m];
      for (std::size_t n = 0; n < count; ++n)
        row += square[PreparedFunctions::pair(std::max(m, n), std::min(m, n))] * x[n];
      sum += row * x[m];
    }
    return sum;
  };
  std::vector<double> found(cross.begin(), cross.begin() + static_cast<std::ptrdiff_t>(count));
  if (!solve_symmetric(matrix, found, fixed)) return;
  if (!(value(found) < value(state_.coefficients))) return;
  state_.coefficients = found;
  for (std::size_t c = 0; c < 3; ++c) evaluate_products(c);
}

void ProductTexel::add_to(FunctionSums& sums) {
  residual_sums();
  const std::size_t count = shared_.count();
  const std::size_t width = shared_.pair_width();
  const std::size_t pairs = count * (count + 1) / 2;
  const bool lights = side_ == Side::lights;
  for (std::size_t c = 0; c < 3; ++c) {
    const double unit = unit_ * unit_ * share_[c];
    const std::size_t rows = lights ? samples_.lights.size() : samples_.views;
    for (std::size_t row = 0; row < rows; ++row) {
      const std::size_t to = lights ? 3 * std::size_t{samples_.light_of[row]} + c : row;
      for (std::size_t m = 0; m < count; ++m) {
        const double by_m = unit * state_.coefficients[m];
        sums.cross[to * count + m] += by_m * static_cast<double>(cross_sums_[c][row * column_group + m]);
        for (std::size_t n = 0; n <= m; ++n) {
          const std::size_t p = PreparedFunctions::pair(m, n);
          sums.square[to * pairs + p] +=
              by_m * state_.coefficients[n] * static_cast<double>(square_sums_[c][row * width + p]);
        }
      }
    }
    for (std::size_t m = 0; m < count; ++m) {
      for (std::size_t n = 0; n <= m; ++n) {
        const double apart = m == n ? 1 + options_.apart : 1;
        const double others = lights ? shared_.view_product(m, n) : shared_.light_product(c, m, n);
        sums.pulled[lights ? c : 0][PreparedFunctions::pair(m, n)] +=
            unit * pull_[c] * apart * others * state_.coefficients[m] * state_.coefficients[n];
      }
    }
  }
}

std::vector<float> ProductTexel::ratios(std::size_t channel) {
  const std::size_t stride = samples_.stride();
  std::vector<float> result(samples_.lights.size() * stride);
  std::vector<float> square(stride);
  std::vector<float> base(stride);
  const std::vector<float> table = table_of(channel);
  const auto pull = static_cast<float>(pull_[channel]);
  for (std::size_t l = 0; l < samples_.lights.size(); ++l) {
    float* row = &result[l * stride];
    combine_rows(table.data(), light_factor(channel, l), nullptr, 0, nullptr, stride, base.data());
    weigh_row(weight_.data(), &g_[channel][l * stride], &samples_.radiance[channel][l * stride], base.data(),
              stride, square.data(), row);
    for (std::size_t v = 0; v < stride; ++v) {
      const float sum = square[v] + pull;
      row[v] = sum > 0 ? row[v] / sum : 0.0F;
    }
  }
  return result;
}

double ProductTexel::ratio_weight(std::size_t channel) const {
  return unit_ * std::sqrt(share_[channel] * mean_square_[channel]);
}

}  // namespace selvedge
