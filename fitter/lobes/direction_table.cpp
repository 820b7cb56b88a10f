#include "fitter/lobes/direction_table.h"

#include <algorithm>

namespace selvedge {

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

void DirectionTableSystem::factor(const double* square) {
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

void DirectionTableSystem::subtract_eliminated(std::vector<double>& b, std::size_t count,
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

}  // namespace selvedge
