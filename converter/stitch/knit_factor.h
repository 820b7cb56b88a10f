// Cholesky factors of symmetric matrices of a 3 x 3 block for each pair of points, as the Hessian of a knit
// is (knit_cloth.h): blocks take a third of the order, and one index for nine numbers. Davis 2006, "Direct
// Methods for Sparse Linear Systems", 4.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace selvedge {

/// Sums blocks, each of them symmetric, of pairs of points.
class BlockMatrix {
 public:
  explicit BlockMatrix(std::uint32_t points) : first_(points, none) {}
  /// The block of both pairs. The order of the points does not matter.
  Eigen::Matrix3f& at(std::uint32_t i, std::uint32_t j);

 private:
  friend class BlockCholesky;
  static constexpr std::uint32_t none = ~0U;
  struct Entry {
    std::uint32_t row, column;  ///< not above the row
    std::uint32_t next;         ///< of the row
    Eigen::Matrix3f block;
  };
  std::vector<std::uint32_t> first_;  ///< entries of rows
  std::vector<Entry> entries_;
};

class BlockCholesky {
 public:
  BlockCholesky() = default;
  /// Precondition: a positive definite matrix, but for rounding.
  explicit BlockCholesky(BlockMatrix matrix);
  /// Multiplies by the inverse.
  void solve(std::vector<Eigen::Vector3f>& x) const;

 private:
  struct Block {
    std::uint32_t row;
    Eigen::Matrix3f block;
  };
  void eliminate(const BlockMatrix& matrix, const std::vector<std::uint32_t>& parents);

  std::vector<std::uint32_t> order_;      ///< points, the first eliminated first
  std::vector<std::uint32_t> begin_;      ///< of columns in blocks_, and the end
  std::vector<Block> blocks_;             ///< below the diagonal, by columns
  std::vector<Eigen::Matrix3f> inverse_;  ///< of the diagonal's triangles
};

}  // namespace selvedge
