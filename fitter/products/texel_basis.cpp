#include "fitter/products/texel_basis.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <span>

#include "format/base/parallel.h"
#include "format/simd/wide.h"

namespace selvedge {
namespace {

constexpr double light_step = 1.0 / 1024;
constexpr double view_step = 1.0 / 256;

/// Adds weight * x x^T to the lower triangle.
SELVEDGE_WIDE
void add_outer(const float* x, std::size_t size, double weight, std::vector<double>& matrix) {
  for (std::size_t i = 0; i < size; ++i) {
    const double scaled = weight * static_cast<double>(x[i]);
    if (scaled == 0) continue;
    double* row = &matrix[i * size];
    for (std::size_t j = 0; j <= i; ++j) row[j] += scaled * static_cast<double>(x[j]);
  }
}

/// Sums of the products of `values` with each of `count` functions ([value][function]).
SELVEDGE_WIDE
void add_projections(std::span<const float> values, const float* functions, std::size_t count, double* sums) {
  for (const float value : values) {
    for (std::size_t b = 0; b < count; ++b) sums[b] += static_cast<double>(value * functions[b]);
    functions += count;
  }
}

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// At most `max_count` unit eigenvectors of a symmetric matrix (size * size, only the lower triangle is
/// read), the largest eigenvalue first; the component of largest magnitude is positive.
std::vector<std::vector<double>> principal_components(const std::vector<double>& matrix, std::size_t size,
                                                      std::size_t max_count) {
  const auto n = static_cast<Eigen::Index>(size);
  const Eigen::Map<const RowMajor> symmetric(matrix.data(), n, n);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  std::vector<std::vector<double>> vectors;
  for (Eigen::Index i = n - 1; i >= 0 && vectors.size() < max_count; --i) {
    const Eigen::VectorXd vector = solver.eigenvectors().col(i);
    Eigen::Index largest = 0;
    vector.cwiseAbs().maxCoeff(&largest);
    const double sign = vector[largest] < 0 ? -1 : 1;
    std::vector<double>& out = vectors.emplace_back(size);
    for (Eigen::Index k = 0; k < n; ++k) out[k] = sign * vector[k];
  }
  return vectors;
}

float rounded(double value, double step) { return static_cast<float>(step * std::round(value / step)); }

/// Functions rounded to multiples of a power of two, which half precision holds exactly up to 2048 steps. So
/// measured errors are the file's, except for rare larger values, and the file is smaller.
std::vector<std::vector<float>> stored(const std::vector<std::vector<double>>& vectors, double scale,
                                       double step) {
  std::vector<std::vector<float>> result;
  for (const auto& vector : vectors) {
    std::vector<float> out;
    for (const double value : vector) out.push_back(rounded(scale * value, step));
    result.push_back(std::move(out));
  }
  return result;
}

/// A matrix that is a sum over items, by blocks that are added in a fixed order, so that it does not depend
/// on the number of threads.
template <class AddItem>
std::vector<double> summed(std::size_t items, std::size_t size, const AddItem& add) {
  const std::size_t blocks = std::clamp<std::size_t>(items / 64, 1, 16);
  std::vector<std::vector<double>> parts(blocks);
  parallel_for(0, static_cast<int>(blocks), [&](std::size_t block) {
    std::vector<double>& part = parts[block];
    part.assign(size * size, 0);
    const std::size_t begin = items * block / blocks;
    const std::size_t end = items * (block + 1) / blocks;
    for (std::size_t item = begin; item < end; ++item) add(item, part);
  });
  std::vector<double> sum(size * size, 0);
  for (const auto& part : parts)
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += part[i];
  return sum;
}

/// alpha f of a texel: [view][3 * light + channel].
std::vector<float> premultiplied(const SampleLevel& level, std::size_t texel) {
  const std::size_t views = level.views;
  const std::size_t lights = level.lights;
  std::vector<float> result;
  result.reserve(views * lights * 3);
  for (std::size_t view = 0; view < views; ++view) {
    const float alpha = level.alpha[texel * views + view];
    const V3f* radiance = &level.radiance[(texel * views + view) * lights];
    for (std::size_t l = 0; l < lights; ++l)
      for (int c = 0; c < 3; ++c) result.push_back(alpha * radiance[l][c]);
  }
  return result;
}

/// Fits the coefficients of one texel, one row for each phi_a and one column for each psi_b.
/// `psi`: [value][b], here with the cosine and about unit.
RowMajor fit_texel(const SampleLevel& level, std::size_t texel, const std::vector<std::vector<float>>& phi,
                   const std::vector<float>& psi) {
  const std::vector<float> seen = premultiplied(level, texel);
  const std::size_t values = std::size_t{3} * level.lights;
  const std::size_t count = psi.size() / values;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(phi.size(), phi.size());
  RowMajor right = RowMajor::Zero(phi.size(), count);
  for (int view = 0; view < level.views; ++view) {
    const auto alpha = static_cast<double>(level.alpha[texel * level.views + view]);
    if (alpha == 0) continue;
    Eigen::RowVectorXd in_psi = Eigen::RowVectorXd::Zero(count);
    add_projections(std::span(seen).subspan(view * values, values), psi.data(), count, in_psi.data());
    in_psi = in_psi.cast<float>().cast<double>();
    for (std::size_t a = 0; a < phi.size(); ++a) {
      const double factor = alpha * static_cast<double>(phi[a][view]);
      right.row(a) += factor * in_psi;
      for (std::size_t other = 0; other < phi.size(); ++other)
        normal(a, other) += factor * alpha * static_cast<double>(phi[other][view]);
    }
  }
  double trace = 0;
  for (std::size_t a = 0; a < phi.size(); ++a) trace += normal(a, a);
  if (!(trace > 0)) return RowMajor::Zero(phi.size(), count);  // a hole from everywhere
  normal.diagonal().array() += 1e-3 * trace / static_cast<double>(phi.size());
  return normal.ldlt().solve(right);
}

}  // namespace

std::vector<BasisFit> texel_basis(const std::vector<SampleLevel>& levels, const DirectionGrid& lights,
                                  std::size_t max_view, std::size_t max_light) {
  const std::size_t views = levels.front().views;
  const std::size_t values = 3 * levels.front().lights;
  std::vector<double> of_views(views * views, 0);
  std::vector<double> of_lights(values * values, 0);
  for (const SampleLevel& level : levels) {
    const double weight = 1 / std::sqrt(static_cast<double>(level.texels()));
    const std::size_t texels = level.texels();
    const std::vector<double> across_lights = summed(texels, values, [&](std::size_t texel, auto& sum) {
      const std::vector<float> seen = premultiplied(level, texel);
      for (std::size_t view = 0; view < views; ++view) add_outer(&seen[view * values], values, weight, sum);
    });
    const std::vector<double> across = summed(texels, views, [&](std::size_t texel, auto& sum) {
      const std::vector<float> seen = premultiplied(level, texel);
      std::vector<float> column(views);
      for (std::size_t i = 0; i < values; ++i) {
        for (std::size_t view = 0; view < views; ++view) column[view] = seen[view * values + i];
        add_outer(column.data(), views, weight, sum);
      }
    });
    for (std::size_t i = 0; i < of_lights.size(); ++i) of_lights[i] += across_lights[i];
    for (std::size_t i = 0; i < of_views.size(); ++i) of_views[i] += across[i];
  }
  BasisFit shared;
  shared.view_functions = stored(principal_components(of_views, views, max_view),
                                 std::sqrt(static_cast<double>(views)), view_step);
  std::vector<double> cosine;  // l_z of each value of a function of the light, [3 * light + channel]
  for (const V3f& l : cell_directions(lights)) cosine.insert(cosine.end(), 3, static_cast<double>(l.z));
  std::vector<std::vector<double>> light = principal_components(of_lights, values, max_light);
  for (auto& psi : light)
    for (std::size_t i = 0; i < values; ++i) psi[i] /= cosine[i];
  shared.light_functions = stored(light, 1, light_step);
  std::vector<float> seen_light;  // l_z psi_b, [value][b]
  for (std::size_t i = 0; i < values; ++i)
    for (const auto& psi : shared.light_functions)
      seen_light.push_back(psi[i] * static_cast<float>(cosine[i]));
  for (std::size_t a = 0; a < shared.view_functions.size(); ++a)
    for (std::size_t b = 0; b < shared.light_functions.size(); ++b)
      shared.pairs.emplace_back(static_cast<int>(a), static_cast<int>(b));
  std::vector<BasisFit> result;
  for (const SampleLevel& level : levels) {
    BasisFit basis = shared;
    const std::size_t count = shared.pairs.size();
    basis.coefficient.resize(level.texels() * count);
    parallel_for(0, level.texels(), [&](std::size_t t) {
      const RowMajor fitted = fit_texel(level, t, shared.view_functions, seen_light);
      for (std::size_t m = 0; m < count; ++m)
        basis.coefficient[t * count + m] = static_cast<float>(fitted.data()[m]);
    });
    result.push_back(std::move(basis));
  }
  return result;
}

void scale_light(std::vector<BasisFit>& fits, const V3d& factor) {
  for (BasisFit& fit : fits)
    for (std::vector<float>& psi : fit.light_functions)
      for (std::size_t i = 0; i < psi.size(); ++i)
        psi[i] = rounded(static_cast<double>(psi[i]) * factor[static_cast<int>(i % 3)], light_step);
}

float coefficient_scale(const BasisFit& basis) {
  const std::size_t count = basis.pairs.size();
  double largest = 0;
  for (std::size_t m = 0; m < count; ++m) {
    double power = 0;
    double used = 0;
    for (std::size_t t = 0; t < basis.texel_count(); ++t) {
      const auto c = static_cast<double>(basis.coefficient[t * count + m]);
      power += c * c;
      used += c != 0 ? 1 : 0;
    }
    if (used > 0) largest = std::max(largest, std::sqrt(power / used));
  }
  return static_cast<float>(largest);
}

}  // namespace selvedge
