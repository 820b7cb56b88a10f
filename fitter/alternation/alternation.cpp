#include "fitter/alternation/alternation.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "fitter/alternation/start.h"
#include "fitter/alternation/texel.h"
#include "fitter/slabs/basis_list.h"
#include "fitter/slabs/quantise.h"
#include "fitter/solve/small_solve.h"
#include "fitter/solve/texel_blocks.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

/// Evaluations of the samples that a turn's search of the lobes may take.
constexpr int lobe_steps = 3;
/// Of tables and coefficients in a pass: their minima lie along each other.
constexpr int table_rounds = 2;
constexpr int max_turns = 60;
/// Share of the cost below which a turn counts as none.
constexpr double min_gain = 2e-3;
/// How far functions go beyond their minimum, in steps of the turn before: as long as that pays.
constexpr double first_step_beyond = 0.5;
constexpr double longest_step_beyond = 4;
constexpr double step_grows = 1.3;
constexpr double step_shrinks = 0.4;
/// Functions are stored as multiples of this, which half precision has exactly up to 2,048 of them; their
/// mean square is 1.
constexpr double function_step = 1.0 / 64;
/// Coefficients likewise, of the power of two below the strongest product's; and what a bit of them may cost.
constexpr float coefficient_step = 0x1p-6F;
constexpr float coefficient_price = 0.3F;

float clamp_to_finite(double value) {
  constexpr auto largest = static_cast<double>(std::numeric_limits<float>::max());
  return static_cast<float>(std::clamp(value, -largest, largest));
}

/// What a pass over the texels of a level sums up.
struct LevelSums {
  FunctionSums functions;
  double evaluations = 0;
  void add(const LevelSums& other) {
    functions.add(other.functions);
    evaluations += other.evaluations;
  }
};

struct TexelCost {
  double cost = 0;
  double error = 0;  ///< without the penalties
};

/// All that is searched of a level.
struct LevelState {
  SharedFunctions functions;
  std::vector<ProductState> texels;
  std::vector<TexelCost> costs;  ///< of each
  double cost() const {
    double sum = 0;
    for (const TexelCost& texel : costs) sum += texel.cost;
    return sum;
  }
};

SharedFunctions no_functions(std::size_t views, std::size_t lights, std::size_t count) {
  return {std::vector(count, std::vector<double>(views, 0)),
          std::vector(count, std::vector<double>(3 * lights, 0))};
}

/// Makes the functions of one side the minimum of the summed equations, each row by itself; rows that say
/// nothing stay.
void solve_functions(const FunctionSums& sums, SharedFunctions& functions) {
  const std::size_t count = sums.count;
  const std::size_t pairs = count * (count + 1) / 2;
  auto& side = sums.side == Side::views ? functions.view : functions.light;
  parallel_for(0, static_cast<int>(sums.rows), [&](int index) {
    const auto row = static_cast<std::size_t>(index);
    const std::vector<double>& pulled = sums.pulled[sums.side == Side::views ? 0 : row % 3];
    std::vector<double> square(count * count);
    std::vector<double> cross(count);
    std::vector<double> before(count);
    std::vector<char> fixed(count);
    for (std::size_t m = 0; m < count; ++m) {
      for (std::size_t n = 0; n <= m; ++n) {
        const std::size_t p = PreparedFunctions::pair(m, n);
        square[m * count + n] = square[n * count + m] = sums.square[row * pairs + p] + pulled[p];
      }
      square[m * count + m] *= 1 + 1e-12;
      cross[m] = sums.cross[row * count + m];
      before[m] = side[m][row];
      fixed[m] = square[m * count + m] > 0 ? 0 : 1;
    }
    const auto value = [&](const std::vector<double>& x) {
      double sum = 0;
      for (std::size_t m = 0; m < count; ++m) {
        double line = -2 * cross[m];
        for (std::size_t n = 0; n < count; ++n) line += square[m * count + n] * x[n];
        sum += line * x[m];
      }
      return sum;
    };
    std::vector<double> matrix = square;
    std::vector<double> found = cross;
    if (!solve_symmetric(matrix, found, fixed) || !(value(found) < value(before))) return;
    for (std::size_t m = 0; m < count; ++m) {
      if (!fixed[m]) side[m][row] = found[m];
    }
  });
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

/// Functions to a mean square of 1, coefficients by the inverse.
void normalise(LevelState& state) {
  for (auto* side : {&state.functions.view, &state.functions.light}) {
    for (std::size_t m = 0; m < side->size(); ++m) {
      const double size = root_mean_square((*side)[m]);
      if (!(size > 0)) continue;
      for (double& value : (*side)[m]) value /= size;
      for (ProductState& texel : state.texels) texel.coefficients[m] *= size;
    }
  }
}

/// As the file holds them.
void round_to_stored(SharedFunctions& functions) {
  for (auto* side : {&functions.view, &functions.light}) {
    for (auto& function : *side) {
      for (double& value : function) value = function_step * std::round(value / function_step);
    }
  }
}

/// Takes the functions further on their way from those of the turn before.
void go_beyond(LevelState& state, const SharedFunctions& before, double step) {
  const auto move = [step](std::vector<std::vector<double>>& functions,
                           const std::vector<std::vector<double>>& from) {
    for (std::size_t m = 0; m < functions.size(); ++m) {
      for (std::size_t i = 0; i < functions[m].size(); ++i) {
        functions[m][i] += step * (functions[m][i] - from[m][i]);
      }
    }
  };
  move(state.functions.view, before.view);
  move(state.functions.light, before.light);
  normalise(state);
}

class LevelAlternation {
 public:
  LevelAlternation(const SampleLevel& samples, const SamplesHeader& header, const FitOptions& options,
                   FabricLevel& level)
      : samples_(samples),
        directions_{directions_of(header.views), directions_of(header.lights), header.views, header.lights},
        level_(level),
        products_(static_cast<std::size_t>(options.products)) {
    options_.lobes.channel.view_table = options.view_table;
    options_.lobes.channel.light_table = options.light_table;
    options_.lobes.channel.table = options.table;
    options_.lobes.lobes = options.lobes;
    options_.lobes.tolerance = options.tolerance;
    options_.pull = options.table.damping;
  }

  /// By turns to the end. Gives the level its products and what else has become better.
  ProductTrace run(FitLevelReport& report, const Progress& progress);
  /// Of the level, once run; none where no texel has any.
  const Products& products() const { return stored_; }

 private:
  std::size_t texels() const { return static_cast<std::size_t>(samples_.texels()); }
  std::size_t lights() const { return directions_.lights.size(); }
  TexelSamples gather(std::size_t texel) const;
  ProductState given(std::size_t texel, const TexelSamples& samples) const;
  void begin();
  LevelSums pass(LevelState& state, Side side, bool lobes) const;
  void store_products();
  void write();

  const SampleLevel& samples_;
  TexelDirections directions_;
  FabricLevel& level_;
  std::size_t products_;
  ProductTexelOptions options_;
  std::size_t stride_ = 0;
  LevelState state_;
  std::vector<TexelCost> without_;  ///< of each texel as it was given
  double energy_ = 0;
  double unreachable_ = 0;
  Products stored_;
};

TexelSamples LevelAlternation::gather(std::size_t texel) const {
  const std::size_t views = directions_.views.size();
  return gather_texel(&samples_.alpha[texel * views], &samples_.radiance[texel * views * lights()],
                      directions_, level_.frame->normal[texel], level_.frame->tangent[texel]);
}

ProductState LevelAlternation::given(std::size_t texel, const TexelSamples& samples) const {
  const std::size_t views = directions_.views.size();
  const auto stride = static_cast<std::size_t>(parameter_count(level_.lobes->lobes));
  ProductState state;
  state.coefficients.assign(products_, 0);
  for (std::size_t c = 0; c < 3; ++c) {
    ChannelFit fit;
    const float* parameters = &level_.lobes->parameters[(texel * 3 + c) * stride];
    fit.parameters.assign(parameters, parameters + stride);
    const int channel = static_cast<int>(c);
    fit.table.assign(views, 1);
    for (std::size_t v = 0; level_.view_table && v < views; ++v) {
      fit.table[v] = static_cast<double>(level_.view_table->colour[texel * views + v][channel]);
    }
    for (std::size_t l = 0; level_.light_table && l < lights(); ++l) {
      fit.light_table.push_back(
          static_cast<double>(level_.light_table->value[texel * lights() + l][channel]));
    }
    state.channels[c] = state_of(samples, channel, fit);
  }
  return state;
}

/// The level as it was given, and functions of what it leaves.
void LevelAlternation::begin() {
  stride_ = gather(0).stride();
  state_.functions = no_functions(directions_.views.size(), lights(), products_);
  state_.texels.resize(texels());
  without_.resize(texels());
  std::vector<V2d> energies(texels());
  const PreparedFunctions none(state_.functions, stride_);
  parallel_for(0, samples_.texels(), [&](int index) {
    const auto t = static_cast<std::size_t>(index);
    const TexelSamples samples = gather(t);
    ProductTexel texel(samples, options_, none);
    texel.take(given(t, samples));
    texel.rescale_tables();
    without_[t] = {texel.cost(), texel.error()};
    energies[t] = V2d(texel.energy(), samples.energy_below_horizon);
    state_.texels[t] = texel.state();
  });
  state_.costs = without_;
  for (const V2d& energy : energies) {
    energy_ += energy.x;
    unreachable_ += energy.y;
  }
  const auto ratios = [&](std::size_t t) {
    const TexelSamples samples = gather(t);
    ProductTexel texel(samples, options_, none);
    texel.take(state_.texels[t]);
    TexelRatios result;
    result.light_of = samples.light_of;
    for (std::size_t c = 0; c < 3; ++c) {
      result.value[c] = texel.ratios(c);
      result.weight[c] = texel.ratio_weight(c);
    }
    return result;
  };
  state_.functions =
      start_functions(texels(), ratios, directions_.views.size(), stride_, lights(), products_);
}

/// Improves what is each texel's own, and sums up the equations of the functions of one side.
LevelSums LevelAlternation::pass(LevelState& state, Side side, bool lobes) const {
  const PreparedFunctions prepared(state.functions, stride_);
  const std::size_t rows = side == Side::views ? directions_.views.size() : 3 * lights();
  LevelSums empty{FunctionSums(side, rows, products_)};
  return sum_over_blocks(texels(), empty, [&](std::size_t t, LevelSums& sums) {
    const TexelSamples samples = gather(t);
    ProductTexel texel(samples, options_, prepared);
    texel.take(state.texels[t]);
    if (lobes) sums.evaluations += texel.improve_lobes(options_.lobes.tolerance, lobe_steps);
    texel.sum(side);
    for (int round = 0; round < table_rounds; ++round) {
      texel.improve_tables();
      texel.improve_coefficients();
    }
    texel.add_to(sums.functions);
    state.costs[t] = {texel.cost(), texel.error()};
    state.texels[t] = texel.state();
  });
}

ProductTrace LevelAlternation::run(FitLevelReport& report, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  begin();
  ProductTrace trace;
  trace.without = state_.cost();
  LevelState next = state_;
  double evaluations = 0;
  const auto advance = [&](LevelState tried, Side side) {
    const LevelSums sums = pass(tried, side, side == Side::lights);
    evaluations += sums.evaluations;
    if (!(tried.cost() < state_.cost())) return false;
    trace.costs.push_back(tried.cost());
    next = tried;
    state_ = std::move(tried);
    solve_functions(sums.functions, next.functions);
    normalise(next);
    return true;
  };
  bool falls = true;
  bool converged = false;
  double beyond = first_step_beyond;
  SharedFunctions last = next.functions;
  for (int turn = 0; falls && !converged && turn < max_turns; ++turn) {
    const double before = state_.cost();
    SharedFunctions solved = next.functions;
    falls = false;
    if (turn > 1) {
      LevelState tried = next;
      go_beyond(tried, last, beyond);
      falls = advance(std::move(tried), Side::lights);
      beyond = falls ? std::min(beyond * step_grows, longest_step_beyond) : beyond * step_shrinks;
    }
    if (!falls) falls = advance(next, Side::lights);
    falls = falls && advance(next, Side::views);
    last = std::move(solved);
    const double cost = state_.cost();
    converged = falls && before - cost <= min_gain * cost;
    if (progress) progress(1 - std::pow(0.9, turn + 1));
  }
  // The last half turn's functions are not judged yet; rounded, they are.
  if (!falls) next = state_;
  round_to_stored(next.functions);
  evaluations += pass(next, Side::lights, true).evaluations;
  for (std::size_t t = 0; t < texels(); ++t) {
    if (next.costs[t].cost < without_[t].cost) continue;
    next.costs[t] = without_[t];
    next.texels[t].coefficients.clear();
  }
  state_ = std::move(next);
  trace.stored = state_.cost();
  store_products();
  if (!stored_.pairs.empty()) write();

  double error = unreachable_;
  for (const TexelCost& texel : state_.costs) error += texel.error;
  const double energy = energy_ + unreachable_;
  report.cost = energy > 0 ? (trace.stored + unreachable_) / energy : 0;
  report.training_error = energy > 0 ? std::sqrt(error / energy) : 0;
  report.mean_iterations += evaluations / (3.0 * samples_.texels());
  report.unconverged = converged || !falls ? 0 : samples_.texels();
  report.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return trace;
}

/// Coefficients as the file holds them, of the products that have any.
void LevelAlternation::store_products() {
  Products products;
  const auto floats = [](const std::vector<double>& values) {
    return std::vector<float>(values.begin(), values.end());
  };
  for (std::size_t m = 0; m < products_; ++m) {
    products.view.push_back(floats(state_.functions.view[m]));
    products.light.push_back(floats(state_.functions.light[m]));
    products.pairs.emplace_back(static_cast<int>(m), static_cast<int>(m));
  }
  for (const ProductState& texel : state_.texels) {
    for (std::size_t m = 0; m < products_; ++m) {
      products.coefficient.push_back(texel.coefficients.empty() ? 0.0F
                                                                : clamp_to_finite(texel.coefficients[m]));
    }
  }
  const float scale = scale_of(products);
  if (!(scale > 0)) return;
  Quantisation how;
  how.step = coefficient_step * std::exp2(std::floor(std::log2(scale)));
  how.price = coefficient_price;
  how.width = static_cast<std::size_t>(samples_.width);
  stored_ = quantised(products, how, nullptr);
  if (level_.view_table || level_.light_table) return;
  // Without a table the sum of products is all of the factor: the 1 beside them is one more.
  Products all = stored_;
  all.pairs.emplace_back(static_cast<int>(all.view.size()), static_cast<int>(all.light.size()));
  all.view.emplace_back(directions_.views.size(), 1.0F);
  all.light.emplace_back(3 * lights(), 1.0F);
  all.coefficient.clear();
  for (std::size_t t = 0; t < texels(); ++t) {
    const std::size_t count = stored_.pairs.size();
    all.coefficient.insert(all.coefficient.end(), &stored_.coefficient[t * count],
                           &stored_.coefficient[t * count] + count);
    all.coefficient.push_back(1);
  }
  stored_ = std::move(all);
}

/// Lobes and tables of the texels that have products.
void LevelAlternation::write() {
  const std::size_t views = directions_.views.size();
  const auto stride = static_cast<std::size_t>(parameter_count(level_.lobes->lobes));
  for (std::size_t t = 0; t < texels(); ++t) {
    if (state_.texels[t].coefficients.empty()) continue;
    const TexelSamples samples = gather(t);
    for (std::size_t c = 0; c < 3; ++c) {
      const ChannelState& state = state_.texels[t].channels[c];
      const double scale = samples.scale[c];
      float* parameters = &level_.lobes->parameters[(t * 3 + c) * stride];
      *parameters++ = clamp_to_finite(state.sizes[0] * scale);
      for (std::size_t j = 0; j < state.shapes.size(); ++j) {
        const LobeShape& shape = state.shapes[j];
        const double size = state.sizes[j + 1] * scale;
        const double length = size > 0 ? std::pow(size, 1 / shape.exponent) : 0;
        for (const double d : shape.direction) *parameters++ = clamp_to_finite(length * d);
        *parameters++ = clamp_to_finite(shape.exponent);
      }
      const int channel = static_cast<int>(c);
      for (std::size_t v = 0; level_.view_table && v < views; ++v) {
        level_.view_table->colour[t * views + v][channel] = clamp_to_finite(state.table[v]);
      }
      for (std::size_t l = 0; l < state.light_table.size(); ++l) {
        level_.light_table->value[t * lights() + l][channel] = clamp_to_finite(state.light_table[l]);
      }
    }
  }
}

}  // namespace

ProductLevel fit_products(const SampleLevel& samples, const SamplesHeader& header, const FitOptions& options,
                          FabricLevel& level, FitLevelReport& report, const Progress& progress) {
  LevelAlternation alternation(samples, header, options, level);
  ProductTrace trace = alternation.run(report, progress);
  return {alternation.products(), std::move(trace)};
}

std::vector<ProductTrace> add_products(SampleLevel samples, const SamplesHeader& header,
                                       const FitOptions& options, FitResult& fit, const Progress& progress) {
  double all = 0;
  for (const FabricLevel& level : fit.fabric.levels) all += level.texels();
  double done = 0;
  std::vector<ProductTrace> traces;
  FunctionList functions;
  for (std::size_t k = 0; k < fit.fabric.levels.size(); ++k) {
    if (k > 0) samples = pool(samples);
    FabricLevel& level = fit.fabric.levels[k];
    ProductLevel fitted = fit_products(samples, header, options, level, fit.levels[k], [&](double share) {
      if (progress) progress((done + share * level.texels()) / all);
    });
    done += level.texels();
    traces.push_back(std::move(fitted.trace));
    if (fitted.products.pairs.empty()) continue;
    ProductLayer layer{1, fitted.products.pairs, fitted.products.coefficient};
    for (V2i& pair : layer.pairs) pair = functions.add(fitted.products, pair);
    level.products = std::move(layer);
    fit.fabric.lights = header.lights;
  }
  const auto bases = std::make_shared<const ProductBases>(functions.bases());
  for (FabricLevel& level : fit.fabric.levels) {
    if (level.products) level.bases = bases;
  }
  return traces;
}

}  // namespace selvedge
