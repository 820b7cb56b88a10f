#include "fitter/lobes/channel_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fitter/lobes/light_sums.h"
#include "fitter/solve/small_solve.h"
#include "fitter/solve/view_sums.h"

namespace selvedge {
namespace {

double energy_of(const TexelSamples& samples, int channel, const std::vector<std::uint32_t>& lights) {
  const std::vector<float>& radiance = samples.radiance[channel];
  std::vector<double> square(samples.stride(), 0);
  for (const std::uint32_t light : lights) {
    const float* r = &radiance[light * samples.stride()];
    for (std::size_t v = 0; v < square.size(); ++v) {
      square[v] += static_cast<double>(r[v]) * static_cast<double>(r[v]);
    }
  }
  return dot(square.data(), samples.weight.data(), square.size());
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

/// Mean over views of the squared radiance, the unit of the table's penalties.
double mean_energy(const TexelSamples& samples, double energy) {
  double weight = 0;
  for (const double w : samples.weight) weight += w;
  return weight > 0 ? energy / weight : 0;
}

/// Mean over lights of the squared radiance, likewise.
double mean_of_lights(const TexelSamples& samples, double energy) {
  return samples.lights.empty() ? 0 : energy / static_cast<double>(samples.lights.size());
}

/// Which factor of the view a column of LobeMoments has.
std::size_t factor_of(std::size_t column) { return column == 0 || column % 4 == 0 ? 0 : column % 4; }

}  // namespace

std::size_t longest(const LobeShape& shape) {
  std::size_t at = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (std::abs(shape.direction[k]) > std::abs(shape.direction[at])) at = k;
  }
  return at;
}

DirectionTableSystem view_table_system(const TexelSamples& samples, double energy,
                                       const DirectionTableOptions& options) {
  const double unit = mean_energy(samples, energy);
  return {samples.views, samples.grid, options.damping * unit, options.smoothness * unit};
}

DirectionTableSystem light_table_system(const TexelSamples& samples, double energy,
                                        const DirectionTableOptions& options) {
  const double unit = mean_of_lights(samples, energy);
  return {samples.all_lights, samples.light_grid, options.damping * unit, options.smoothness * unit};
}

ChannelProblem::ChannelProblem(const TexelSamples& samples, int channel, std::vector<std::uint32_t> lights,
                               const ChannelOptions& options)
    : samples_(samples),
      channel_(channel),
      lights_(std::move(lights)),
      options_(options),
      energy_(energy_of(samples, channel, lights_)),
      peak_(peak_of(samples, channel) * options.peak),
      ridge_(peak_ > 0 ? options.ridge * energy_ / (peak_ * peak_) : 0),
      system_(view_table_system(samples, energy_, options.table)),
      light_system_(light_table_system(samples, energy_, options.table)),
      square_(samples.stride()),
      cross_(samples.stride()),
      weights_(10 * samples.stride()) {
  factor_[0].assign(samples.stride(), 1);
  for (std::size_t k = 0; k < 3; ++k) factor_[k + 1].assign(samples.view[k].begin(), samples.view[k].end());
}

/// A lobe without its size is the combination sum_k d_k v_k of its three first columns.
void ChannelProblem::gather_bases(const ChannelState& state) {
  const std::size_t n = samples_.stride();
  const std::size_t bases = state.shapes.size() + 1;
  const std::size_t columns = moments_.columns();
  products_.resize(columns * bases * n);
  basis_gram_.resize(bases * bases * n);
  basis_cross_.resize(bases * n);
  const auto combine = [&](std::size_t lobe, const auto& of_column, double* to) {
    std::fill_n(to, n, 0.0);
    for (std::size_t k = 0; k < 3; ++k) {
      add_product(to, state.shapes[lobe].direction[k], factor_[k + 1].data(), of_column(1 + 4 * lobe + k), n);
    }
  };
  for (std::size_t a = 0; a < columns; ++a) {
    std::copy_n(moments_.product(0, a), n, &products_[a * bases * n]);
    for (std::size_t j = 1; j < bases; ++j) {
      combine(
          j - 1, [&](std::size_t b) { return moments_.product(a, b); }, &products_[(a * bases + j) * n]);
    }
  }
  std::copy_n(moments_.with_radiance(0), n, basis_cross_.data());
  for (std::size_t i = 1; i < bases; ++i) {
    combine(
        i - 1, [&](std::size_t a) { return moments_.with_radiance(a); }, &basis_cross_[i * n]);
  }
  for (std::size_t j = 0; j < bases; ++j) {
    std::copy_n(&products_[j * n], n, &basis_gram_[j * n]);
    for (std::size_t i = 1; i < bases; ++i) {
      double* to = &basis_gram_[(i * bases + j) * n];
      if (j <= i) {
        combine(
            i - 1, [&](std::size_t a) { return &products_[(a * bases + j) * n]; }, to);
      }
    }
  }
  for (std::size_t i = 0; i < bases; ++i) {
    for (std::size_t j = i + 1; j < bases; ++j) {
      std::copy_n(&basis_gram_[(j * bases + i) * n], n, &basis_gram_[(i * bases + j) * n]);
    }
  }
}

/// Least squares within 0 <= size <= peak. Sizes that leave their range are held at its end and the others
/// solved again; the exact minimiser within the bounds is not needed, as shapes move on anyway.
void ChannelProblem::solve_sizes(ChannelState& state) {
  const std::size_t n = samples_.stride();
  const std::size_t bases = state.sizes.size();
  double* once = weights_.data();
  double* twice = once + n;
  for (std::size_t v = 0; v < n; ++v) {
    const double t = v < samples_.views ? state.table[v] : 0;
    once[v] = samples_.weight[v] * t;
    twice[v] = once[v] * t;
  }
  std::vector<double> gram(bases * bases);
  std::vector<double> cross(bases);
  for (std::size_t i = 0; i < bases; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      gram[i * bases + j] = gram[j * bases + i] = dot(twice, &basis_gram_[(i * bases + j) * n], n);
    }
    gram[i * bases + i] += i > 0 ? ridge_ : 0;
    cross[i] = dot(once, &basis_cross_[i * n], n);
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
      const double most = i > 0 ? peak_ : std::numeric_limits<double>::max();
      found[i] = std::clamp(x[i], 0.0, most);
      if (found[i] == x[i]) continue;
      fixed[i] = 1;
      inside = false;
    }
    if (inside) break;
  }
  // Sizes from outside, of a start or of another frame, may lie beyond the bounds.
  for (std::size_t i = 0; i < bases; ++i) {
    state.sizes[i] = std::clamp(state.sizes[i], 0.0, i > 0 ? peak_ : std::numeric_limits<double>::max());
  }
  if (value(found) <= value(state.sizes)) state.sizes = found;
}

void ChannelProblem::sum_model(const ChannelState& state) {
  const std::size_t n = samples_.stride();
  const std::size_t bases = state.sizes.size();
  std::fill(square_.begin(), square_.end(), 0.0);
  std::fill(cross_.begin(), cross_.end(), 0.0);
  for (std::size_t i = 0; i < bases; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const double c = state.sizes[i] * state.sizes[j] * (i == j ? 1 : 2);
      add_product(square_.data(), c, samples_.weight.data(), &basis_gram_[(i * bases + j) * n], n);
    }
    add_product(cross_.data(), state.sizes[i], samples_.weight.data(), &basis_cross_[i * n], n);
  }
}

void ChannelProblem::set_cosines(const ChannelState& state) {
  cosine_.clear();
  for (std::size_t l = 0; l < samples_.lights.size(); ++l) {
    const double s = state.light_table.empty() ? 1 : state.light_table[samples_.light_of[l]];
    cosine_.push_back(samples_.lights[l].z * static_cast<float>(s));
  }
}

void ChannelProblem::fit_light_table(ChannelState& state) const {
  const LightSums sums = light_sums(samples_, channel_, lights_, state.shapes, state.sizes, state.table);
  DirectionTableSystem system = light_system_;
  system.factor(sums.square.data());
  state.light_table.resize(samples_.all_lights);
  system.solve(sums.cross.data(), state.light_table.data());
  for (double& s : state.light_table) s = std::max(s, 0.0);
}

double ChannelProblem::size_penalty(const ChannelState& state) const {
  double sum = 0;
  for (std::size_t i = 1; i < state.sizes.size(); ++i) sum += ridge_ * state.sizes[i] * state.sizes[i];
  return sum;
}

void ChannelProblem::evaluate(ChannelState& state, int turns) {
  set_cosines(state);
  moments_.compute(samples_, channel_, cosine_, lights_, state.shapes);
  gather_bases(state);
  if (!options_.view_table) turns = std::min(turns, 1);
  for (int i = 0; i < turns; ++i) {
    solve_sizes(state);
    if (!options_.view_table) break;
    sum_model(state);
    system_.factor(square_.data());
    system_.solve(cross_.data(), state.table.data());
  }
  if (turns == 0 || !options_.view_table) sum_model(state);
  state.error = energy_;
  for (std::size_t v = 0; v < samples_.views; ++v) {
    const double t = state.table[v];
    state.error += t * (t * square_[v] - 2 * cross_[v]);
  }
  state.error = std::max(state.error, 0.0);
  state.cost = state.error;
  state.cost += size_penalty(state);
  if (options_.view_table) state.cost += system_.penalty(state.table.data());
  if (!state.light_table.empty()) state.cost += light_system_.penalty(state.light_table.data());
}

void ChannelProblem::normal_equations(const ChannelState& state, std::vector<double>& matrix,
                                      std::vector<double>& gradient) {
  const std::size_t n = samples_.stride();
  const std::size_t columns = moments_.columns();
  const std::size_t bases = state.sizes.size();
  std::vector<double> table(n, 0);
  std::copy_n(state.table.begin(), samples_.views, table.begin());

  // w T^2 and the factors of two columns, for every pair of factors.
  const auto weight_of = [&](std::size_t p, std::size_t q) {
    const std::size_t low = std::min(p, q);
    const std::size_t high = std::max(p, q);
    return &weights_[(low * (7 - low) / 2 + high) * n];
  };
  for (std::size_t p = 0; p < 4; ++p) {
    for (std::size_t q = p; q < 4; ++q) {
      double* to = weight_of(p, q);
      for (std::size_t v = 0; v < n; ++v) {
        to[v] = samples_.weight[v] * table[v] * table[v] * factor_[p][v] * factor_[q][v];
      }
    }
  }
  std::vector<double> raw(columns * columns);
  for (std::size_t a = 0; a < columns; ++a) {
    for (std::size_t b = a; b < columns; ++b) {
      raw[a * columns + b] = dot(weight_of(factor_of(a), factor_of(b)), moments_.product(a, b), n);
    }
  }
  std::vector<double> raw_gradient(columns);
  std::vector<double> model(n);
  coupling_.assign(n * columns, 0);
  for (std::size_t a = 0; a < columns; ++a) {
    std::fill(model.begin(), model.end(), 0.0);
    for (std::size_t i = 0; i < bases; ++i) {
      add_scaled(model.data(), state.sizes[i], &products_[(a * bases + i) * n], n);
    }
    const double* f = factor_[factor_of(a)].data();
    const double* radiance = moments_.with_radiance(a);
    double sum = 0;
    for (std::size_t v = 0; v < samples_.views; ++v) {
      const double c = samples_.weight[v] * table[v] * f[v];
      sum += c * (table[v] * model[v] - radiance[v]);
      coupling_[v * columns + a] = c * model[v];
    }
    raw_gradient[a] = sum;
  }
  if (options_.view_table) system_.subtract_eliminated(coupling_, columns, raw);
  for (std::size_t a = 0; a < columns; ++a) {
    for (std::size_t b = 0; b < a; ++b) raw[a * columns + b] = raw[b * columns + a];
  }

  // Each unknown's derivative is a combination of few columns: matrix = C^T raw C.
  const auto combine = [&](std::size_t unknown, const auto& each) {
    if (unknown == 0) return each(std::size_t{0}, 1.0);
    const std::size_t lobe = (unknown - 1) / 4;
    const LobeShape& shape = state.shapes[lobe];
    const double scale = state.sizes[lobe + 1] * shape.exponent;
    const std::size_t first = 1 + 4 * lobe;
    const std::size_t which = (unknown - 1) % 4;
    if (which == 0) {
      for (std::size_t k = 0; k < 3; ++k) each(first + k, shape.direction[k]);
    } else {
      each(which == 3 ? first + 3 : first + (longest(shape) + which) % 3, scale);
    }
  };
  std::vector<double> half(columns * columns, 0);
  gradient.assign(columns, 0);
  matrix.assign(columns * columns, 0);
  for (std::size_t u = 0; u < columns; ++u) {
    combine(u, [&](std::size_t a, double c) {
      gradient[u] += c * raw_gradient[a];
      for (std::size_t b = 0; b < columns; ++b) half[u * columns + b] += c * raw[a * columns + b];
    });
  }
  for (std::size_t u = 0; u < columns; ++u) {
    for (std::size_t w = 0; w < columns; ++w) {
      combine(w, [&](std::size_t b, double c) { matrix[u * columns + w] += c * half[u * columns + b]; });
    }
  }
  for (std::size_t j = 1; j < bases; ++j) {
    const std::size_t u = 4 * j - 3;
    matrix[u * columns + u] += ridge_;
    gradient[u] += ridge_ * state.sizes[j];
  }
}

}  // namespace selvedge
