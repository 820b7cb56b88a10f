// The unknowns of one lobe in a search, their bounds, and steps within these; and sums over the lights, view
// by view, of products of a model's columns, from which all least squares of a search are computed. Only
// these loops of a search read the samples.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "fitter/solve/texel_samples.h"

namespace selvedge {

/// A lobe without its size: max(0, d . (l * v))^n.
struct LobeShape {
  std::array<double, 3> direction{0, 0, 1};
  double exponent = 1;
};

/// Per view, sums over lights of products of columns. With c the cosine of a light and b = d . (l * v) > 0
/// the base of lobe j, the columns are:
///   column 0           c
///   column 1 + 4 j + k c b^(n-1) l_k,  k = x, y, z;  times n v_k it is the derivative by d_k
///   column 4 + 4 j     c b^n ln b,                   the derivative by n
/// Every sum is [stride] long.
class LobeMoments {
 public:
  /// `cosine`: c of every light of the samples. Sums are in single precision over 16 lights at a time, and in
  /// double precision over these, with the same bits for any number of threads and any width of vectors.
  void compute(const TexelSamples& samples, int channel, std::span<const float> cosine,
               std::span<const LobeShape> shapes);

  std::size_t columns() const { return columns_; }
  /// sum over lights of column a times column b
  const double* column_moment(std::size_t a, std::size_t b) const {
    return sums_.data() + (a <= b ? index(a, b) : index(b, a)) * stride_;
  }
  /// sum over lights of column a times radiance
  const double* radiance_moment(std::size_t a) const { return sums_.data() + index(a, columns_) * stride_; }

 private:
  std::size_t index(std::size_t a, std::size_t b) const { return a * (2 * columns_ + 3 - a) / 2 + b - a; }

  std::size_t columns_ = 0;
  std::size_t stride_ = 0;
  std::vector<double> sums_;    ///< [upper triangle of columns and radiance][view]
  std::vector<float> scratch_;  ///< columns of some lights
};

/// Sum of a b over `count` views, a multiple of 8: eight partial sums, then their sum, so that the bits are
/// the same on every processor.
double dot(const double* a, const double* b, std::size_t count);

/// to += c a b
void add_product(double* to, double c, const double* a, const double* b, std::size_t count);

/// to += c a
void add_scaled(double* to, double c, const double* a, std::size_t count);

/// Bounds of a lobe's size and exponent.
struct LobeBounds {
  double max_size = 0;
  double min_exponent = 1;
  double max_exponent = 200;  ///< sharper than 64 x 64 directions can resolve
};

/// A step of one lobe, or derivatives by its unknowns, which vectors of all unknowns have in this order.
struct LobeStep {
  static constexpr std::size_t unknowns = 4;
  double size = 0;
  std::array<double, 2> direction{};  ///< the two components after the longest, cyclic; the longest is fixed
  double log_exponent = 0;

  static LobeStep from_values(const double* values) { return {values[0], {values[1], values[2]}, values[3]}; }
};

/// The direction's component of largest magnitude.
std::size_t longest_component(const LobeShape& shape);

/// Applies the step within the bounds, and normalises the direction, whose length goes into the size.
void move_lobe(const LobeStep& step, const LobeBounds& bounds, LobeShape& shape, double& size);

/// Whether an unknown of the lobe, by its index in LobeStep, is at a bound and descent would move it
/// outwards.
bool is_at_bound(std::size_t unknown, double gradient, const LobeBounds& bounds, const LobeShape& shape,
                 double size);

/// Solves matrix x = b by Cholesky's factorisation, with x = 0 for unknowns that are `fixed`. `matrix`:
/// row-major, symmetric; it is overwritten, b becomes x. False if the matrix is not positive definite.
bool solve_symmetric(std::vector<double>& matrix, std::vector<double>& b, const std::vector<char>& fixed);

}  // namespace selvedge
