#include "fitter/slabs/slab_tables.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "format/base/parallel.h"
#include "format/fabric/slabs.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

/// Number of right-hand sides per solver, so that their columns of all entries stay in the caches.
constexpr std::size_t columns_at_once = 16;
/// More iterations would fit the noise of the samples.
constexpr int iterations = 8;
/// Weights of the penalties, as shares of the mean diagonal of the normal equations.
constexpr float pull_of_first = 0.03F;
constexpr float pull_of_others = 0.5F;

/// An unknown's contribution to a sample.
struct Term {
  std::uint32_t unknown = 0;
  std::uint32_t kind = 0;  // of its texel
  float weight = 0;
};

/// The sparse matrix, rows by texel and view.
struct Matrix {
  std::vector<std::size_t> first;  // of each row, then the end
  std::vector<Term> terms;
  std::vector<float> diagonal;  // of A^T A, by unknown
  std::vector<float> pull;      // weight of the penalty, by unknown
};

Matrix matrix_of(const SampleLevel& samples, const SlabRays& rays, std::size_t entries,
                 const std::vector<std::vector<float>>& phi, const SlabFactors* factors) {
  const std::size_t of_texel = entries / samples.texels();
  const std::size_t per_row = rays.rays;
  const float share = 1.0F / static_cast<float>(per_row);
  const std::size_t rows = rays.entries.size() / per_row;
  Matrix matrix;
  matrix.diagonal.assign(entries * phi.size(), 0);
  for (std::size_t row = 0; row < rows; ++row) {
    const std::size_t begin = matrix.terms.size();
    matrix.first.push_back(begin);
    const std::size_t view = row % samples.views;
    for (std::size_t i = row * per_row; i < (row + 1) * per_row; ++i) {
      if (rays.entries[i] == SlabRays::no_entry) continue;
      for (std::size_t a = 0; a < phi.size(); ++a) {
        const auto unknown = static_cast<std::uint32_t>(rays.entries[i] * phi.size() + a);
        const float weight = share * phi[a][view];
        std::size_t t = begin;
        while (t < matrix.terms.size() && matrix.terms[t].unknown != unknown) ++t;
        if (t == matrix.terms.size()) {
          const std::uint32_t kind = factors != nullptr ? factors->kind[rays.entries[i] / of_texel] : 0;
          matrix.terms.push_back({unknown, kind, 0});
        }
        matrix.terms[t].weight += weight;
      }
    }
    for (std::size_t t = begin; t < matrix.terms.size(); ++t) {
      matrix.diagonal[matrix.terms[t].unknown] += matrix.terms[t].weight * matrix.terms[t].weight;
    }
  }
  matrix.first.push_back(matrix.terms.size());
  double mean = 0;
  double count = 0;
  for (std::size_t u = 0; u < matrix.diagonal.size(); u += phi.size()) {
    mean += static_cast<double>(matrix.diagonal[u]);
    count += matrix.diagonal[u] > 0 ? 1 : 0;
  }
  const auto scale = static_cast<float>(count > 0 ? mean / count : 1);
  for (std::size_t u = 0; u < matrix.diagonal.size(); ++u) {
    matrix.pull.push_back(scale * (u % phi.size() == 0 ? pull_of_first : pull_of_others));
  }
  return matrix;
}

using Columns = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Row = Eigen::Array<float, 1, Eigen::Dynamic>;

/// Solves for some right-hand sides by conjugate gradients. Arrays have a row for each unknown and a column
/// for each right-hand side.
class Solver {
 public:
  Solver(const Matrix& matrix, const SampleLevel& samples, const SlabFactors* factors, std::size_t functions,
         std::size_t first_value, std::size_t columns)
      : matrix_(matrix),
        samples_(samples),
        functions_(functions),
        first_(first_value),
        n_(columns),
        views_(samples.views),
        pull_(matrix.pull.data(), matrix.pull.size()),
        with_factors_(factors != nullptr),
        inverse_(matrix.diagonal.size(), columns) {
    if (with_factors_) {
      set_factors(*factors);
    } else {
      factor_.assign(views_ * n_, 1);
      inverse_.colwise() = Eigen::Map<const Eigen::ArrayXf>(matrix.diagonal.data(), matrix.diagonal.size());
    }
    inverse_ = 1.0F / (inverse_.colwise() + pull_);
  }

  Columns solve() const {
    Columns x = Columns::Zero(inverse_.rows(), inverse_.cols());
    const Row mean = mean_of_samples();
    for (Eigen::Index u = 0; u < x.rows(); u += functions_) x.row(u) = mean;
    // r = A^T b + pull x0 - (A^T A + pull) x0 = A^T (b - A x0)
    Columns r = Columns::Zero(x.rows(), x.cols());
    Row sum(n_);
    for (std::size_t row = 0; row + 1 < matrix_.first.size(); ++row) {
      if (!apply_row(row, x, sum)) continue;
      sum = sample(row) - sum;
      scatter_row(row, sum, r);
    }
    Columns z = inverse_ * r;
    Columns p = z;
    Eigen::ArrayXd rz = inner(r, z);
    for (int i = 0; i < iterations; ++i) {
      const Columns ap = multiply(p);
      const Row step = quotient(rz, inner(p, ap));
      x += p.rowwise() * step;
      r -= ap.rowwise() * step;
      z = inverse_ * r;
      const Eigen::ArrayXd next = inner(r, z);
      p = z + p.rowwise() * quotient(next, rz);
      rz = next;
    }
    return x;
  }

 private:
  /// alpha r of a texel and view.
  Row sample(std::size_t row) const {
    Row result(n_);
    const V3f* radiance = &samples_.radiance[row * samples_.lights];
    for (std::size_t k = 0; k < n_; ++k) {
      result[k] = samples_.alpha[row] * radiance[(first_ + k) / 3][static_cast<int>((first_ + k) % 3)];
    }
    return result;
  }
  /// Sets the factors of these columns, and the diagonal of the normal equations with them.
  void set_factors(const SlabFactors& factors) {
    const std::size_t values = 3 * samples_.lights;
    factor_.resize(factors.value.size() / values * n_);
    for (std::size_t i = 0; i < factors.value.size() / values; ++i) {
      std::copy_n(&factors.value[i * values + first_], n_, &factor_[i * n_]);
    }
    inverse_.setZero();
    for (std::size_t row = 0; row + 1 < matrix_.first.size(); ++row) {
      for (std::size_t t = matrix_.first[row]; t < matrix_.first[row + 1]; ++t) {
        const Term& term = matrix_.terms[t];
        inverse_.row(term.unknown) += (term.weight * factor_of(term, row)).square();
      }
    }
  }
  Eigen::Map<const Row> factor_of(const Term& term, std::size_t row) const {
    return {&factor_[(term.kind * views_ + row % views_) * n_], static_cast<Eigen::Index>(n_)};
  }
  Row mean_of_samples() const {
    Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(n_);
    Eigen::ArrayXd weight = Eigen::ArrayXd::Zero(n_);
    for (std::size_t row = 0; row < samples_.alpha.size(); ++row) {
      sum += sample(row).transpose().cast<double>();
      if (!with_factors_) {
        weight += static_cast<double>(samples_.alpha[row]);
        continue;
      }
      for (std::size_t t = matrix_.first[row]; t < matrix_.first[row + 1]; t += functions_) {
        const Term& term = matrix_.terms[t];
        weight += (term.weight * factor_of(term, row)).transpose().cast<double>();
      }
    }
    return quotient(sum, weight);
  }
  /// a / b, or 0 if b is not positive.
  static Row quotient(const Eigen::ArrayXd& a, const Eigen::ArrayXd& b) {
    return (b > 0).select(a / b, 0).cast<float>().transpose();
  }
  bool apply_row(std::size_t row, const Columns& x, Row& sum) const {
    const std::size_t begin = matrix_.first[row];
    const std::size_t end = matrix_.first[row + 1];
    if (begin == end) return false;
    sum.setZero();
    for (std::size_t t = begin; t < end; ++t) {
      const Term& term = matrix_.terms[t];
      const float* from = &x(term.unknown, 0);
      const float* factor = factor_of(term, row).data();
      for (std::size_t k = 0; k < n_; ++k) sum[k] += term.weight * factor[k] * from[k];
    }
    return true;
  }
  void scatter_row(std::size_t row, const Row& sum, Columns& into) const {
    for (std::size_t t = matrix_.first[row]; t < matrix_.first[row + 1]; ++t) {
      const Term& term = matrix_.terms[t];
      float* to = &into(term.unknown, 0);
      const float* factor = factor_of(term, row).data();
      for (std::size_t k = 0; k < n_; ++k) to[k] += term.weight * factor[k] * sum[k];
    }
  }
  /// (A^T A + pull) x
  Columns multiply(const Columns& x) const {
    Columns out = x.colwise() * pull_;
    Row sum(n_);
    for (std::size_t row = 0; row + 1 < matrix_.first.size(); ++row) {
      if (apply_row(row, x, sum)) scatter_row(row, sum, out);
    }
    return out;
  }
  /// Inner products of the columns.
  Eigen::ArrayXd inner(const Columns& a, const Columns& b) const {
    Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(n_);
    for (Eigen::Index u = 0; u < a.rows(); ++u) {
      sum += (a.row(u) * b.row(u)).transpose().cast<double>();
    }
    return sum;
  }

  const Matrix& matrix_;
  const SampleLevel& samples_;
  std::size_t functions_;
  std::size_t first_;
  std::size_t n_;
  std::size_t views_;
  Eigen::Map<const Eigen::ArrayXf> pull_;
  bool with_factors_;
  std::vector<float> factor_;  // [(kind * views + view) * columns + column]
  Columns inverse_;            // of the diagonal
};

}  // namespace

SlabRays slab_rays(const FabricLevel& level, const Fabric& fabric, const std::vector<V3f>& directions) {
  const SlabShape& shape = level.cells;
  const V2d cells(level.width * shape.columns, level.height * shape.rows);
  SlabRays result;
  result.rays = shape.columns * shape.rows;
  const std::size_t per_texel = directions.size() * result.rays;
  result.entries.resize(level.texels() * per_texel);
  const SlabMarch march(level, fabric);
  parallel_for(0, level.texels(), [&](int texel) {
    std::size_t at = texel * per_texel;
    for (const V3f& direction : directions) {
      for (int row = 0; row < shape.rows; ++row) {
        for (int column = 0; column < shape.columns; ++column) {
          const V2i cell(texel % level.width * shape.columns + column,
                         texel / level.width * shape.rows + row);
          const V2d centre(cell.x + 0.5, cell.y + 0.5);
          const auto hit = march(centre / cells, direction);
          result.entries[at++] = hit ? static_cast<std::uint32_t>(hit->texel * shape.entries() + hit->entry)
                                     : SlabRays::no_entry;
        }
      }
    }
  });
  return result;
}

std::vector<std::vector<float>> smooth_view_functions(const DirectionGrid& views, int count) {
  const std::vector<V3f> directions = directions_of(views);
  std::vector<std::vector<double>> functions;
  for (int a = 0; a < count; ++a) {
    std::vector<double> values;
    for (const V3f& direction : directions) {
      const V3d v(direction);
      const std::array<double, 6> powers{1, v.x, v.y, v.z, v.x * v.x - v.y * v.y, v.x * v.y};
      values.push_back(powers[a]);
    }
    const auto mean_product = [&](const std::vector<double>& x, const std::vector<double>& y) {
      double sum = 0;
      for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * y[i];
      return sum / static_cast<double>(x.size());
    };
    const double whole = mean_product(values, values);
    for (const auto& other : functions) {
      const double share = mean_product(values, other);
      for (std::size_t i = 0; i < values.size(); ++i) values[i] -= share * other[i];
    }
    const double rest = mean_product(values, values);
    if (!(rest > 1e-6 * whole)) continue;  // linearly dependent on the others over the grid
    for (double& value : values) value /= std::sqrt(rest);
    functions.push_back(std::move(values));
  }
  std::vector<std::vector<float>> result;
  for (const auto& values : functions) {
    // Rounded to multiples of 1/256, which half precision holds exactly up to 8.
    std::vector<float> stored;
    for (const double value : values) stored.push_back(static_cast<float>(std::round(value * 256) / 256));
    result.push_back(std::move(stored));
  }
  return result;
}

SlabTables fit_slabs(const SampleLevel& samples, const SlabRays& rays, std::size_t entries,
                     const std::vector<std::vector<float>>& view_functions, const SlabFactors* factors) {
  const Matrix matrix = matrix_of(samples, rays, entries, view_functions, factors);
  SlabTables tables;
  tables.functions = view_functions.size();
  tables.values = 3 * samples.lights;
  tables.value.resize(entries * tables.functions * tables.values);
  const std::size_t blocks = (tables.values + columns_at_once - 1) / columns_at_once;
  parallel_for(0, static_cast<int>(blocks), [&](std::size_t block) {
    const std::size_t first = block * columns_at_once;
    const std::size_t columns = std::min(columns_at_once, tables.values - first);
    const Columns x = Solver(matrix, samples, factors, tables.functions, first, columns).solve();
    for (std::size_t u = 0; u < entries * tables.functions; ++u) {
      std::copy_n(&x(u, 0), columns, &tables.value[u * tables.values + first]);
    }
  });
  for (std::size_t entry = 0; entry < entries; ++entry) {
    tables.visibility.push_back(static_cast<double>(matrix.diagonal[entry * tables.functions]));
  }
  return tables;
}

HeightLayer pool_heights(const HeightLayer& fine, int width, int height) {
  return regrid_heights(fine, width, height, {level_size(width, 1), level_size(height, 1)}, fine.shape);
}

HeightLayer regrid_heights(const HeightLayer& fine, int width, int height, const V2i& texels,
                           const SlabShape& shape) {
  const SlabShape& from_shape = fine.shape;
  const int coarse_width = texels.x;
  const int coarse_height = texels.y;
  const auto columns = overlaps(width * from_shape.columns, coarse_width * shape.columns);
  const auto rows = overlaps(height * from_shape.rows, coarse_height * shape.rows);
  const auto index = [](const SlabShape& cells, int w, int x, int y, int slab) -> std::size_t {
    const int texel = y / cells.rows * w + x / cells.columns;
    const int entry = (slab * cells.rows + y % cells.rows) * cells.columns + x % cells.columns;
    return texel * cells.entries() + entry;
  };
  const std::size_t values = coarse_width * coarse_height * shape.entries();
  std::vector<float> top(values, 0);
  std::vector<float> bottom(values, 0);
  for (int y = 0; y < coarse_height * shape.rows; ++y) {
    for (int x = 0; x < coarse_width * shape.columns; ++x) {
      for (int slab = 0; slab < shape.slabs; ++slab) {
        double area = 0;
        double sum_top = 0;
        double sum_bottom = 0;
        for (const Overlap& row : rows[y]) {
          for (const Overlap& column : columns[x]) {
            const std::size_t from = index(from_shape, width, column.fine, row.fine, slab);
            if (!(fine.top[from] > fine.bottom[from])) continue;
            const double share = row.share * column.share;
            area += share;
            sum_top += share * static_cast<double>(fine.top[from]);
            sum_bottom += share * static_cast<double>(fine.bottom[from]);
          }
        }
        if (area < 0.5) continue;
        const std::size_t to = index(shape, coarse_width, x, y, slab);
        top[to] = static_cast<float>(sum_top / area);
        bottom[to] = static_cast<float>(sum_bottom / area);
      }
    }
  }
  return {shape, std::move(top), std::move(bottom)};
}

}  // namespace selvedge
