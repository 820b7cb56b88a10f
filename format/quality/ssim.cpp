#include "format/quality/ssim.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

namespace selvedge {
namespace {

constexpr int window = 11;
constexpr double deviation = 1.5;
constexpr int rows_at_once = 64;
constexpr double c1 = 0.01 * 0.01;  // (K L)^2
constexpr double c2 = 0.03 * 0.03;

std::array<double, window> gaussian() {
  std::array<double, window> weight{};
  for (int i = 0; i < window; ++i) {
    const double d = (i - (window - 1) / 2.0) / deviation;
    weight[i] = std::exp(-d * d / 2);
  }
  const double sum = std::accumulate(weight.begin(), weight.end(), 0.0);
  for (double& w : weight) w /= sum;
  return weight;
}

/// Weighted means over all windows within a picture of width x height.
std::vector<double> means(const std::vector<double>& values, int width, int height) {
  static const std::array<double, window> weight = gaussian();
  const int columns = width - window + 1;
  const int rows = height - window + 1;
  const auto at = [](int x, int y, int row) { return std::size_t{1} * y * row + x; };
  std::vector<double> across(at(0, height, columns));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < columns; ++x) {
      for (int k = 0; k < window; ++k) across[at(x, y, columns)] += weight[k] * values[at(x + k, y, width)];
    }
  }
  std::vector<double> result(at(0, rows, columns));
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      for (int k = 0; k < window; ++k) result[at(x, y, columns)] += weight[k] * across[at(x, y + k, columns)];
    }
  }
  return result;
}

/// The mean SSIM index of one channel: equations 13 to 16 of the paper.
double similarity(const Image& a, const Image& b, int channel) {
  double sum = 0;
  const int rows = a.height - window + 1;
  // Some rows of windows at a time: all of them would take four times the memory of the pictures.
  for (int first = 0; first < rows; first += rows_at_once) {
    const int height = std::min(rows_at_once, rows - first) + window - 1;
    const std::size_t pixels = std::size_t{1} * height * a.width;
    std::vector<double> x(pixels);
    std::vector<double> y(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::size_t at = (std::size_t{1} * first * a.width + i) * a.channels + channel;
      x[i] = static_cast<double>(a.pixels[at]);
      y[i] = static_cast<double>(b.pixels[at]);
    }
    const auto product = [&](const std::vector<double>& p, const std::vector<double>& q) {
      std::vector<double> result(pixels);
      for (std::size_t i = 0; i < pixels; ++i) result[i] = p[i] * q[i];
      return means(result, a.width, height);
    };
    const std::vector<double> xx = product(x, x);
    const std::vector<double> yy = product(y, y);
    const std::vector<double> xy = product(x, y);
    const std::vector<double> mx = means(x, a.width, height);
    const std::vector<double> my = means(y, a.width, height);
    for (std::size_t i = 0; i < mx.size(); ++i) {
      const double variances = xx[i] - mx[i] * mx[i] + yy[i] - my[i] * my[i];
      const double covariance = xy[i] - mx[i] * my[i];
      sum += (2 * mx[i] * my[i] + c1) * (2 * covariance + c2) /
             ((mx[i] * mx[i] + my[i] * my[i] + c1) * (variances + c2));
    }
  }
  return sum / (static_cast<double>(rows) * (a.width - window + 1));
}

}  // namespace

Result<std::optional<double>> structural_similarity(const Image& a, const Image& b) {
  if (const auto same = check_same_size(a, b); !same) return tl::unexpected(same.error());
  if (a.width < window || a.height < window) return std::optional<double>();
  const int colours = has_alpha(a) ? a.channels - 1 : a.channels;
  double sum = 0;
  for (int channel = 0; channel < colours; ++channel) sum += similarity(a, b, channel);
  return std::optional(sum / colours);
}

}  // namespace selvedge
