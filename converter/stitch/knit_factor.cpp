#include "converter/stitch/knit_factor.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace selvedge {
namespace {

/// Inverse of the lower triangle whose square this is. Rounding may leave less than nothing of a pivot.
Eigen::Matrix3f inverse_root(const Eigen::Matrix3f& square, float min_pivot) {
  Eigen::Matrix3f root = Eigen::Matrix3f::Zero();
  Eigen::Matrix3f inverse = Eigen::Matrix3f::Zero();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) {
      float sum = square(i, j);
      for (int k = 0; k < j; ++k) sum -= root(i, k) * root(j, k);
      root(i, j) = i > j ? sum / root(j, j) : std::sqrt(std::max(sum, min_pivot));
    }
    for (int j = 0; j <= i; ++j) {
      float sum = i == j ? 1.0F : 0.0F;
      for (int k = j; k < i; ++k) sum -= root(i, k) * inverse(k, j);
      inverse(i, j) = sum / root(i, i);
    }
  }
  return inverse;
}

}  // namespace

Eigen::Matrix3f& BlockMatrix::at(std::uint32_t i, std::uint32_t j) {
  if (i < j) std::swap(i, j);
  for (std::uint32_t e = first_[i]; e != none; e = entries_[e].next)
    if (entries_[e].column == j) return entries_[e].block;
  entries_.push_back({i, j, first_[i], Eigen::Matrix3f::Zero()});
  first_[i] = static_cast<std::uint32_t>(entries_.size() - 1);
  return entries_.back().block;
}

BlockCholesky::BlockCholesky(BlockMatrix matrix) {
  constexpr std::uint32_t none = BlockMatrix::none;
  const auto count = static_cast<std::uint32_t>(matrix.first_.size());
  const auto size = static_cast<int>(count);
  std::vector<Eigen::Triplet<float>> pattern;
  for (const BlockMatrix::Entry& e : matrix.entries_)
    pattern.emplace_back(static_cast<int>(e.row), static_cast<int>(e.column), 1.0F);
  Eigen::SparseMatrix<float> pairs(size, size);
  pairs.setFromTriplets(pattern.begin(), pattern.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> ordering;
  Eigen::AMDOrdering<int>()(pairs, ordering);
  order_.assign(ordering.indices().begin(), ordering.indices().begin() + size);
  std::vector<std::uint32_t> place(count);
  for (std::uint32_t k = 0; k < count; ++k) place[order_[k]] = k;
  std::ranges::fill(matrix.first_, none);
  for (std::uint32_t k = 0; k < matrix.entries_.size(); ++k) {
    BlockMatrix::Entry& e = matrix.entries_[k];
    std::tie(e.column, e.row) = std::minmax({place[e.row], place[e.column]});
    e.next = std::exchange(matrix.first_[e.row], k);
  }
  // The elimination tree, and with it the size of each column.
  std::vector<std::uint32_t> parents(count, none), seen(count, none), sizes(count, 0);
  for (std::uint32_t k = 0; k < count; ++k) {
    seen[k] = k;
    for (std::uint32_t e = matrix.first_[k]; e != none; e = matrix.entries_[e].next) {
      for (std::uint32_t i = matrix.entries_[e].column; seen[i] != k; i = parents[i]) {
        if (parents[i] == none) parents[i] = k;
        seen[i] = k;
        ++sizes[i];
      }
    }
  }
  begin_.assign(1, 0);
  for (const std::uint32_t column : sizes) begin_.push_back(begin_.back() + column);
  eliminate(matrix, parents);
}

/// Row by row: each one is solved for by the columns before it.
void BlockCholesky::eliminate(const BlockMatrix& matrix, const std::vector<std::uint32_t>& parents) {
  constexpr std::uint32_t none = BlockMatrix::none;
  constexpr float min_pivot = 1e-6F;  // of the diagonal
  const auto count = static_cast<std::uint32_t>(order_.size());
  blocks_.resize(begin_.back());
  inverse_.resize(count);
  std::vector<std::uint32_t> ends(begin_.begin(), begin_.end() - 1), seen(count, none), path, columns;
  std::vector<Eigen::Matrix3f> row(count, Eigen::Matrix3f::Zero());
  for (std::uint32_t k = 0; k < count; ++k) {
    columns.clear();
    seen[k] = k;
    for (std::uint32_t e = matrix.first_[k]; e != none; e = matrix.entries_[e].next) {
      row[matrix.entries_[e].column] = matrix.entries_[e].block;
      path.clear();
      for (std::uint32_t i = matrix.entries_[e].column; seen[i] != k; i = parents[i]) {
        path.push_back(i);
        seen[i] = k;
      }
      columns.insert(columns.end(), path.rbegin(), path.rend());
    }
    const float floor = min_pivot * row[k].trace();
    // Paths that were found later go before the ones that they lead to.
    for (auto column = columns.rbegin(); column != columns.rend(); ++column) {
      const Eigen::Matrix3f block = row[*column] * inverse_[*column].transpose();
      row[*column].setZero();
      for (std::uint32_t b = begin_[*column]; b < ends[*column]; ++b)
        row[blocks_[b].row].noalias() -= block * blocks_[b].block.transpose();
      row[k].noalias() -= block * block.transpose();
      blocks_[ends[*column]++] = {k, block};
    }
    inverse_[k] = inverse_root(row[k], floor);
    row[k].setZero();
  }
}

void BlockCholesky::solve(std::vector<Eigen::Vector3f>& x) const {
  std::vector<Eigen::Vector3f> y;
  for (const std::uint32_t point : order_) y.push_back(x[point]);
  for (std::size_t k = 0; k < y.size(); ++k) {
    y[k] = inverse_[k] * y[k];
    for (std::uint32_t b = begin_[k]; b < begin_[k + 1]; ++b)
      y[blocks_[b].row].noalias() -= blocks_[b].block * y[k];
  }
  for (std::size_t k = y.size(); k-- > 0;) {
    for (std::uint32_t b = begin_[k]; b < begin_[k + 1]; ++b)
      y[k].noalias() -= blocks_[b].block.transpose() * y[blocks_[b].row];
    y[k] = inverse_[k].transpose() * y[k];
    x[order_[k]] = y[k];
  }
}

}  // namespace selvedge
