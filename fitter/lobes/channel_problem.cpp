#include "fitter/lobes/channel_problem.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace selvedge {
namespace {

double energy_of(const TexelSamples& samples, int channel) {
  const std::vector<float>& radiance = samples.radiance[channel];
  std::vector<double> square(samples.stride(), 0);
  for (std::size_t light = 0; light < samples.lights.size(); ++light) {
    const float* r = &radiance[light * samples.stride()];
    for (std::size_t v = 0; v < square.size(); ++v)
      square[v] += static_cast<double>(r[v]) * static_cast<double>(r[v]);
  }
  return dot(square.data(), samples.view_weights.data(), square.size());
}

double peak_of(const TexelSamples& samples, int channel) {
  constexpr float min_cosine = 0.25F;
  const std::vector<float>& radiance = samples.radiance[channel];
  float largest = 0;
  for (std::size_t l = 0; l < samples.lights.size(); ++l) {
    const float* r = &radiance[l * samples.stride()];
    float brightest = 0;
    for (std::size_t v = 0; v < samples.stride(); ++v) brightest = std::max(brightest, r[v]);
    largest = std::max(largest, brightest / std::max(samples.lights[l].z, min_cosine));
  }
  return static_cast<double>(largest);
}

/// Damping and smoothness are in units of the mean over directions of the squared radiance.
DirectionTableSystem view_table_system(const TexelSamples& samples, double energy,
                                       const DirectionTableOptions& options) {
  const double weight = std::accumulate(samples.view_weights.begin(), samples.view_weights.end(), 0.0);
  const double unit = weight > 0 ? energy / weight : 0;
  return {samples.view_count, samples.grid, options.damping * unit, options.smoothness * unit};
}

/// The derivative of the model by an unknown, as a combination of `count` columns of LobeMoments from `first`
/// on.
struct Derivative {
  std::size_t first = 0;
  std::size_t count = 1;
  std::array<double, 3> factor{1, 0, 0};
};

std::vector<Derivative> derivatives_of(const ChannelState& state) {
  std::vector<Derivative> derivatives(1);  // by rho: the cosine
  for (std::size_t j = 0; j < state.shapes.size(); ++j) {
    const LobeShape& shape = state.shapes[j];
    const double scale = state.sizes[j + 1] * shape.exponent;
    const std::size_t first = 1 + 4 * j;
    const std::size_t kept = longest_component(shape);
    derivatives.push_back({first, 3, shape.direction});
    for (const std::size_t column : {(kept + 1) % 3, (kept + 2) % 3, std::size_t{3}})
      derivatives.push_back({first + column, 1, {scale}});
  }
  return derivatives;
}

}  // namespace

DirectionTableSystem::DirectionTableSystem(std::size_t directions, const DirectionGrid& grid, double d,
                                           double s)
    : count_(directions),
      columns_(s > 0 ? grid.columns : 0),
      damping_(d),
      smoothness_(s),
      penalties_(count_, d),
      // Padded by rows of zeros, so that loops need no check of the end.
      band_((count_ + columns_) * (columns_ + 1)) {
  for (std::size_t v = 0; v < count_ && columns_ > 0; ++v) {
    const std::size_t neighbours = (v % columns_ > 0 ? 1U : 0U) + (v % columns_ + 1 < columns_ ? 1U : 0U) +
                                   (v >= columns_ ? 1U : 0U) + (v + columns_ < count_ ? 1U : 0U);
    penalties_[v] += smoothness_ * static_cast<double>(neighbours);
  }
}

void DirectionTableSystem::factorise(const double* square) {
  const std::size_t width = columns_ + 1;
  std::ranges::fill(band_, 0.0);
  for (std::size_t v = 0; v < count_; ++v) {
    band_[v * width] = square[v] + penalties_[v];
    if (columns_ == 0) continue;
    if (v % columns_ + 1 < columns_) band_[v * width + 1] -= smoothness_;
    if (v + columns_ < count_) band_[v * width + columns_] -= smoothness_;
  }
  for (std::size_t v = 0; v < count_; ++v) {
    double* column = &band_[v * width];
    const double inverse = column[0] > 0 ? 1 / column[0] : 0;
    for (std::size_t i = 1; i < width; ++i) {
      const double l = column[i] * inverse;
      double* below = &band_[(v + i) * width];
      for (std::size_t j = i; j < width; ++j) below[j - i] -= l * column[j];
    }
    column[0] = inverse;
    for (std::size_t i = 1; i < width; ++i) column[i] *= inverse;
  }
}

void DirectionTableSystem::solve(const double* cross, double* table) const {
  const std::size_t width = columns_ + 1;
  std::vector<double> b(count_ + columns_, 0);
  for (std::size_t v = 0; v < count_; ++v) b[v] = cross[v] + damping_;
  for (std::size_t v = 0; v < count_; ++v) {
    const double* column = &band_[v * width];
    for (std::size_t i = 1; i < width; ++i) b[v + i] -= column[i] * b[v];
  }
  std::fill_n(b.begin() + static_cast<std::ptrdiff_t>(count_), columns_, 0.0);
  for (std::size_t v = count_; v-- > 0;) {
    const double* column = &band_[v * width];
    b[v] *= column[0];
    for (std::size_t i = 1; i < width; ++i) b[v] -= column[i] * b[v + i];
    table[v] = column[0] > 0 ? b[v] : 1;
  }
}

void DirectionTableSystem::form_schur_complement(std::vector<double>& b, std::size_t count,
                                                 std::vector<double>& matrix) const {
  const std::size_t width = columns_ + 1;
  b.resize((count_ + columns_) * count, 0);
  for (std::size_t v = 0; v < count_; ++v) {
    const double* column = &band_[v * width];
    const double* own = &b[v * count];
    for (std::size_t i = 1; i < width; ++i) {
      if (column[i] == 0) continue;
      double* below = &b[(v + i) * count];
      for (std::size_t k = 0; k < count; ++k) below[k] -= column[i] * own[k];
    }
    for (std::size_t k = 0; k < count; ++k) {
      const double c = column[0] * own[k];
      for (std::size_t j = k; j < count; ++j) matrix[k * count + j] -= c * own[j];
    }
  }
}

double DirectionTableSystem::penalty(const double* table) const {
  double sum = 0;
  for (std::size_t v = 0; v < count_; ++v) {
    const double t = table[v];
    sum += damping_ * (t - 1) * (t - 1);
    if (columns_ == 0) continue;
    if (v % columns_ > 0) sum += smoothness_ * (t - table[v - 1]) * (t - table[v - 1]);
    if (v >= columns_) sum += smoothness_ * (t - table[v - columns_]) * (t - table[v - columns_]);
  }
  return sum;
}

ChannelProblem::ChannelProblem(const TexelSamples& samples, int channel, const FitOptions& options)
    : samples_(samples),
      channel_(channel),
      options_(options),
      energy_(energy_of(samples, channel)),
      peak_(peak_of(samples, channel) * options.max_peak_ratio),
      ridge_(peak_ > 0 ? options.ridge * energy_ / (peak_ * peak_) : 0),
      system_(view_table_system(samples, energy_, options.table)),
      square_(samples.stride()),
      cross_(samples.stride()),
      weights_(16 * samples.stride()) {
  for (const V3f& light : samples.lights) cosine_.push_back(light.z);
  factor_[0].assign(samples.stride(), 1);
  for (std::size_t k = 0; k < 3; ++k)
    factor_[k + 1].assign(samples.view_xyz[k].begin(), samples.view_xyz[k].end());
}

/// The basis function of a lobe is the combination sum_k d_k v_k of its first three columns.
void ChannelProblem::gather_bases(const ChannelState& state) {
  const std::size_t n = samples_.stride();
  const std::size_t bases = state.shapes.size() + 1;
  const std::size_t columns = moments_.columns();
  products_.resize(columns * bases * n);
  basis_gram_.resize(bases * bases * n);
  basis_cross_.resize(bases * n);
  const auto combine = [&](std::size_t lobe, const auto& of_column, double* to) {
    std::fill_n(to, n, 0.0);
    for (std::size_t k = 0; k < 3; ++k)
      add_product(to, state.shapes[lobe].direction[k], factor_[k + 1].data(), of_column(1 + 4 * lobe + k), n);
  };
  for (std::size_t a = 0; a < columns; ++a) {
    std::copy_n(moments_.column_moment(0, a), n, &products_[a * bases * n]);
    const auto product = [&](std::size_t b) { return moments_.column_moment(a, b); };
    for (std::size_t j = 1; j < bases; ++j) combine(j - 1, product, &products_[(a * bases + j) * n]);
  }
  const auto radiance_moment = [&](std::size_t a) { return moments_.radiance_moment(a); };
  std::copy_n(radiance_moment(0), n, basis_cross_.data());
  for (std::size_t i = 1; i < bases; ++i) combine(i - 1, radiance_moment, &basis_cross_[i * n]);
  std::copy_n(products_.data(), n, basis_gram_.data());
  for (std::size_t i = 1; i < bases; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const auto product = [&](std::size_t a) { return &products_[(a * bases + j) * n]; };
      combine(i - 1, product, &basis_gram_[(i * bases + j) * n]);
    }
  }
}

/// Least squares within 0 <= size <= peak: sizes beyond a bound are fixed there and the others solved again.
/// This is not the exact minimiser within the bounds, which is not needed as long as shapes change.
void ChannelProblem::solve_sizes(ChannelState& state) {
  const std::size_t n = samples_.stride();
  const std::size_t bases = state.sizes.size();
  double* weight_t = weights_.data();  // w T
  double* weight_tt = weight_t + n;    // w T^2
  for (std::size_t v = 0; v < n; ++v) {
    const double t = v < samples_.view_count ? state.table[v] : 0;
    weight_t[v] = samples_.view_weights[v] * t;
    weight_tt[v] = weight_t[v] * t;
  }
  std::vector<double> gram(bases * bases);
  std::vector<double> cross(bases);
  for (std::size_t i = 0; i < bases; ++i) {
    for (std::size_t j = 0; j <= i; ++j)
      gram[i * bases + j] = gram[j * bases + i] = dot(weight_tt, &basis_gram_[(i * bases + j) * n], n);
    gram[i * bases + i] += i > 0 ? ridge_ : 0;
    cross[i] = dot(weight_t, &basis_cross_[i * n], n);
  }
  const auto value = [&](const std::vector<double>& x) {
    double sum = 0;
    for (std::size_t i = 0; i < bases; ++i) {
      double row = -2 * cross[i];
      for (std::size_t j = 0; j < bases; ++j) row += gram[i * bases + j] * x[j];
      sum += row * x[i];
    }
    return sum;
  };
  std::vector<double> found(bases, 0);
  std::vector<char> fixed(bases, 0);
  for (std::size_t i = 0; i < bases; ++i) fixed[i] = gram[i * bases + i] > 0 ? 0 : 1;
  for (std::size_t round = 0; round <= bases; ++round) {
    std::vector<double> x = cross;
    std::vector<double> matrix = gram;
    for (std::size_t i = 0; i < bases; ++i) {
      matrix[i * bases + i] *= 1 + 1e-12;
      for (std::size_t j = 0; j < bases; ++j) x[i] -= fixed[j] ? gram[i * bases + j] * found[j] : 0;
    }
    if (!solve_symmetric(matrix, x, fixed)) break;
    bool inside = true;
    for (std::size_t i = 0; i < bases; ++i) {
      if (fixed[i]) continue;
      const double max_size = i > 0 ? peak_ : std::numeric_limits<double>::max();
      found[i] = std::clamp(x[i], 0.0, max_size);
      if (found[i] == x[i]) continue;
      fixed[i] = 1;
      inside = false;
    }
    if (inside) break;
  }
  // The given sizes, of a start, may be beyond the bounds.
  for (std::size_t i = 0; i < bases; ++i)
    state.sizes[i] = std::clamp(state.sizes[i], 0.0, i > 0 ? peak_ : std::numeric_limits<double>::max());
  if (value(found) <= value(state.sizes)) state.sizes = found;
}

void ChannelProblem::sum_model(const ChannelState& state) {
  const std::size_t n = samples_.stride();
  const std::size_t bases = state.sizes.size();
  std::ranges::fill(square_, 0.0);
  std::ranges::fill(cross_, 0.0);
  for (std::size_t i = 0; i < bases; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const double c = state.sizes[i] * state.sizes[j] * (i == j ? 1 : 2);
      add_product(square_.data(), c, samples_.view_weights.data(), &basis_gram_[(i * bases + j) * n], n);
    }
    add_product(cross_.data(), state.sizes[i], samples_.view_weights.data(), &basis_cross_[i * n], n);
  }
}

void ChannelProblem::evaluate(ChannelState& state, int turns) {
  moments_.compute(samples_, channel_, cosine_, state.shapes);
  gather_bases(state);
  if (!options_.view_table) turns = std::min(turns, 1);
  for (int i = 0; i < turns; ++i) {
    solve_sizes(state);
    if (!options_.view_table) break;
    sum_model(state);
    system_.factorise(square_.data());
    system_.solve(cross_.data(), state.table.data());
  }
  if (turns == 0 || !options_.view_table) sum_model(state);
  state.error = energy_;
  for (std::size_t v = 0; v < samples_.view_count; ++v) {
    const double t = state.table[v];
    state.error += t * (t * square_[v] - 2 * cross_[v]);
  }
  state.error = std::max(state.error, 0.0);
  double penalty_of_sizes = 0;
  for (std::size_t j = 1; j < state.sizes.size(); ++j)
    penalty_of_sizes += ridge_ * state.sizes[j] * state.sizes[j];
  state.cost = state.error + penalty_of_sizes;
  if (options_.view_table) state.cost += system_.penalty(state.table.data());
}

/// The normal equations for factors of the columns of LobeMoments, each multiplied by its function of the
/// view.
NormalEquations ChannelProblem::column_equations(const ChannelState& state) {
  const std::size_t n = samples_.stride();
  const std::size_t columns = moments_.columns();
  const std::size_t bases = state.sizes.size();
  std::vector<double> table(n, 0);
  std::copy_n(state.table.begin(), samples_.view_count, table.begin());
  const auto factor_of = [&](std::size_t column) { return factor_[column % 4].data(); };

  // w T^2 times the functions of the view of two columns, for every pair of functions.
  const auto weights_of = [&](std::size_t a, std::size_t b) {
    return &weights_[(4 * std::min(a % 4, b % 4) + std::max(a % 4, b % 4)) * n];
  };
  for (std::size_t p = 0; p < 4; ++p) {
    for (std::size_t q = p; q < 4; ++q) {
      double* to = weights_of(p, q);
      for (std::size_t v = 0; v < n; ++v)
        to[v] = samples_.view_weights[v] * table[v] * table[v] * factor_[p][v] * factor_[q][v];
    }
  }
  NormalEquations raw{std::vector<double>(columns * columns), std::vector<double>(columns)};
  for (std::size_t a = 0; a < columns; ++a)
    for (std::size_t b = a; b < columns; ++b)
      raw.matrix[a * columns + b] = dot(weights_of(a, b), moments_.column_moment(a, b), n);
  std::vector<double> model(n);
  coupling_.assign(n * columns, 0);
  for (std::size_t a = 0; a < columns; ++a) {
    std::ranges::fill(model, 0.0);
    for (std::size_t i = 0; i < bases; ++i)
      add_scaled(model.data(), state.sizes[i], &products_[(a * bases + i) * n], n);
    const double* f = factor_of(a);
    const double* radiance = moments_.radiance_moment(a);
    for (std::size_t v = 0; v < samples_.view_count; ++v) {
      const double c = samples_.view_weights[v] * table[v] * f[v];
      raw.gradient[a] += c * (table[v] * model[v] - radiance[v]);
      coupling_[v * columns + a] = c * model[v];
    }
  }
  if (options_.view_table) system_.form_schur_complement(coupling_, columns, raw.matrix);
  for (std::size_t a = 0; a < columns; ++a)
    for (std::size_t b = 0; b < a; ++b) raw.matrix[a * columns + b] = raw.matrix[b * columns + a];
  return raw;
}

/// With D the derivatives by the unknowns in terms of the columns: D^T matrix D and D^T gradient.
NormalEquations ChannelProblem::normal_equations(const ChannelState& state) {
  const NormalEquations raw = column_equations(state);
  const std::vector<Derivative> derivatives = derivatives_of(state);
  const std::size_t n = derivatives.size();
  std::vector<double> half(n * n, 0);  // D^T matrix
  NormalEquations result{std::vector<double>(n * n, 0), std::vector<double>(n, 0)};
  for (std::size_t u = 0; u < n; ++u) {
    const Derivative& by = derivatives[u];
    for (std::size_t i = 0; i < by.count; ++i) {
      result.gradient[u] += by.factor[i] * raw.gradient[by.first + i];
      for (std::size_t b = 0; b < n; ++b)
        half[u * n + b] += by.factor[i] * raw.matrix[(by.first + i) * n + b];
    }
  }
  for (std::size_t u = 0; u < n; ++u) {
    for (std::size_t w = 0; w < n; ++w) {
      const Derivative& by = derivatives[w];
      for (std::size_t i = 0; i < by.count; ++i)
        result.matrix[u * n + w] += by.factor[i] * half[u * n + by.first + i];
    }
  }
  for (std::size_t j = 0; j < state.shapes.size(); ++j) {
    const std::size_t size = 1 + LobeStep::unknowns * j;
    result.matrix[size * n + size] += ridge_;
    result.gradient[size] += ridge_ * state.sizes[j + 1];
  }
  return result;
}

}  // namespace selvedge
