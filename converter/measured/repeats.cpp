#include "converter/measured/repeats.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

#include "format/base/parallel.h"

namespace selvedge {
namespace {

/// Sums over the rectangles from the upper left corner, from which the sum of any rectangle follows.
class AreaSums {
 public:
  template <class Value>
  AreaSums(const V2i& size, const Value& value)
      : size_(size), sums_((std::size_t{1} + size.x) * (std::size_t{1} + size.y)) {
    for (int y = 0; y < size.y; ++y) {
      double row = 0;
      for (int x = 0; x < size.x; ++x) {
        row += value(std::size_t{1} * y * size.x + x);
        at(x + 1, y + 1) = at(x + 1, y) + row;
      }
    }
  }
  /// Sum over a rectangle within the picture, with parts of pixels.
  double over(const V2d& min, const V2d& max) const {
    return until(max.x, max.y) - until(min.x, max.y) - until(max.x, min.y) + until(min.x, min.y);
  }

 private:
  double& at(int x, int y) { return sums_[std::size_t{1} * y * (size_.x + 1) + x]; }
  double until(double x, double y) const {
    const int i = std::min(static_cast<int>(x), size_.x - 1);
    const int j = std::min(static_cast<int>(y), size_.y - 1);
    const double* low = &sums_[std::size_t{1} * j * (size_.x + 1) + i];
    const double* high = low + size_.x + 1;
    const double u = x - i;
    const double v = y - j;
    return (1 - v) * ((1 - u) * low[0] + u * low[1]) + v * ((1 - u) * high[0] + u * high[1]);
  }
  V2i size_;
  std::vector<double> sums_;
};

/// Sums over pairs of pixels that lie `shift` apart along an axis: a, b, a a, b b, a b. [shift], up to
/// `last`.
std::vector<std::array<double, 5>> sums_of_pairs(const Image& picture, int axis, int last) {
  const std::size_t length = axis == 0 ? picture.width : picture.height;
  const std::size_t lines = axis == 0 ? picture.height : picture.width;
  const std::size_t step = axis == 0 ? 1 : picture.width;
  const std::size_t next_line = axis == 0 ? picture.width : 1;
  // By the theorem of Wiener and Khinchin, products of all shifts follow from the sum of all lines' power
  // spectra; zeros behind a line keep its ends apart.
  const std::size_t padded = std::bit_ceil(length + last);
  Eigen::FFT<double> transform({}, Eigen::FFT<double>::HalfSpectrum);
  std::vector<double> line(padded);
  std::vector<std::complex<double>> spectrum;
  std::vector<std::complex<double>> power(padded / 2 + 1);
  std::vector<V2d> until(length + 1, V2d(0, 0));  // [p]: values and squares of all lines' first p pixels
  for (std::size_t l = 0; l < lines; ++l) {
    for (std::size_t p = 0; p < length; ++p) {
      const auto value = static_cast<double>(picture.pixels[l * next_line + p * step]);
      line[p] = value;
      until[p + 1] += V2d(value, value * value);
    }
    transform.fwd(spectrum, line);
    for (std::size_t k = 0; k < spectrum.size(); ++k) power[k] += std::norm(spectrum[k]);
  }
  for (std::size_t p = 0; p < length; ++p) until[p + 1] += until[p];
  std::vector<double> products;
  transform.inv(products, power);
  std::vector<std::array<double, 5>> sums;
  for (std::size_t shift = 0; shift <= static_cast<std::size_t>(last); ++shift) {
    const V2d a = until[length - shift];
    const V2d b = until[length] - until[shift];
    sums.push_back({a.x, b.x, a.y, b.y, products[shift]});
  }
  return sums;
}

/// Mean correlation of pictures with themselves, moved along an axis: [shift in pixels], up to 2/3 of the
/// picture; normalised by the overlap.
std::vector<double> autocorrelation(std::span<const Image> pictures, int axis) {
  const Image& first = pictures.front();
  const int last = (axis == 0 ? first.width : first.height) * 2 / 3;
  std::vector<std::vector<std::array<double, 5>>> sums(pictures.size());
  parallel_for(0, static_cast<int>(pictures.size()),
               [&](int i) { sums[i] = sums_of_pairs(pictures[i], axis, last); });
  std::vector<double> values;
  for (int shift = 0; shift <= last; ++shift) {
    const double count =
        axis == 0 ? 1.0 * (first.width - shift) * first.height : 1.0 * first.width * (first.height - shift);
    double together = 0;
    double alone = 0;
    for (const auto& of_picture : sums) {
      const auto& [a, b, aa, bb, ab] = of_picture[shift];
      const double variance_a = aa - a * a / count;
      const double variance_b = bb - b * b / count;
      // Less contrast comes from rounding.
      if (!(variance_a * count > 1e-5 * a * a)) continue;
      together += ab - a * b / count;
      alone += std::sqrt(std::max(variance_a * variance_b, 0.0));
    }
    values.push_back(alone > 0 ? together / alone : 0);
  }
  return values;
}

/// Highest point of the parabola through three values around `at`: where, and how high.
V2d peak_of(const std::vector<double>& values, int at) {
  const double left = values[at - 1];
  const double right = values[at + 1];
  const double bend = left - 2 * values[at] + right;
  const double offset = bend < 0 ? 0.5 * (left - right) / bend : 0;
  return {at + offset, values[at] - 0.25 * (left - right) * offset};
}

/// How much a repeat counts `u` periods from a border of a picture of `count` periods.
double fade(double u, double count) {
  const double ramp = std::min(count - 1, 0.5);
  return ramp > 1e-6 ? std::clamp(std::min(u, count - u) / ramp, 0.0, 1.0) : 1;
}

}  // namespace

Image luminance_of(const Image& picture) {
  Image out{picture.width, picture.height, 1, {}};
  out.pixels.reserve(picture.pixels.size() / picture.channels);
  for (std::size_t i = 0; i < picture.pixels.size(); i += picture.channels) {
    const float* p = &picture.pixels[i];
    out.pixels.push_back(0.2126F * p[0] + 0.7152F * p[1] + 0.0722F * p[2]);
  }
  return out;
}

std::optional<double> find_period(std::span<const Image> pictures, int axis) {
  constexpr int min_period = 4;
  constexpr double min_peak = 0.3;
  constexpr double alike = 0.95;
  const std::vector<double> values = autocorrelation(pictures, axis);
  std::vector<V2d> peaks;
  double highest = min_peak;
  for (int i = min_period; i + 1 < std::ssize(values); ++i) {
    if (values[i] < values[i - 1] || values[i] < values[i + 1]) continue;
    peaks.push_back(peak_of(values, i));
    highest = std::max(highest, peaks.back().y);
  }
  const auto first = std::ranges::find_if(peaks, [&](const V2d& peak) { return peak.y >= alike * highest; });
  if (first == peaks.end()) return std::nullopt;
  // The peaks of several periods are known as exactly, and their period is a fraction of the place.
  double period = first->x;
  for (int n = 2; n * period + 3 < static_cast<double>(values.size()); ++n) {
    const auto near = static_cast<int>(std::lround(n * period));
    const auto at = std::max_element(values.begin() + near - 1, values.begin() + near + 2) - values.begin();
    period = peak_of(values, static_cast<int>(at)).x / n;
  }
  return period;
}

RepeatAverage::RepeatAverage(const V2i& picture, const V2d& period, const V2i& texels, const Image& opacity)
    : picture_(picture),
      period_(period),
      texels_(texels),
      opacity_(std::size_t{1} * picture.x * picture.y, 1.0F) {
  for (std::size_t i = 0; i < opacity.pixels.size(); i += opacity.channels)
    opacity_[i / opacity.channels] = std::clamp(opacity.pixels[i], 0.0F, 1.0F);
}

/// add(min, max, weight) for the part of the picture that is a texel, of every repeat.
template <class Add>
void RepeatAverage::for_each_box(int texel, const Add& add) const {
  const V2d size(period_.x / texels_.x, period_.y / texels_.y);
  const V2d count = repeats();
  const int row = texel / texels_.x;
  const V2d centre((texel % texels_.x + 0.5) / texels_.x, (row + 0.5) / texels_.y);
  for (double v = centre.y; v < count.y; ++v) {
    for (double u = centre.x; u < count.x; ++u) {
      // Rows of a picture run downwards.
      const V2d at(u * period_.x, picture_.y - v * period_.y);
      const V2d min(std::max(at.x - size.x / 2, 0.0), std::max(at.y - size.y / 2, 0.0));
      const V2d max(std::min(at.x + size.x / 2, 1.0 * picture_.x),
                    std::min(at.y + size.y / 2, 1.0 * picture_.y));
      add(min, max, fade(u, count.x) * fade(v, count.y));
    }
  }
}

RepeatAverage::Cell RepeatAverage::average(const Image& picture) const {
  const AreaSums covered(picture_, [&](std::size_t i) { return static_cast<double>(opacity_[i]); });
  const auto channel = [&](std::size_t c) {
    return AreaSums(picture_, [&](std::size_t i) {
      return static_cast<double>(opacity_[i]) * static_cast<double>(picture.pixels[4 * i + c]);
    });
  };
  const std::array<AreaSums, 3> sums{channel(0), channel(1), channel(2)};
  Cell cell;
  const int count = texels_.x * texels_.y;
  for (int texel = 0; texel < count; ++texel) {
    double weights = 0;
    V3d mean(0, 0, 0);
    V3d square(0, 0, 0);
    for_each_box(texel, [&](const V2d& min, const V2d& max, double weight) {
      const double area = covered.over(min, max);
      if (!(area > 1e-6)) return;
      const V3d value(sums[0].over(min, max) / area, sums[1].over(min, max) / area,
                      sums[2].over(min, max) / area);
      weight *= area;
      weights += weight;
      mean += weight * value;
      square += weight * value * value;
    });
    if (weights > 0) {
      mean /= weights;
      const V3d spread = square / weights - mean * mean;
      cell.variance += (spread.x + spread.y + spread.z) / (3 * count);
      cell.mean_square += mean.length2() / (3 * count);
    }
    cell.values.emplace_back(mean);
  }
  return cell;
}

std::vector<float> RepeatAverage::alpha() const {
  const AreaSums covered(picture_, [&](std::size_t i) { return static_cast<double>(opacity_[i]); });
  std::vector<float> alpha;
  for (int texel = 0; texel < texels_.x * texels_.y; ++texel) {
    double weights = 0;
    double sum = 0;
    for_each_box(texel, [&](const V2d& min, const V2d& max, double weight) {
      weights += weight * (max.x - min.x) * (max.y - min.y);
      sum += weight * covered.over(min, max);
    });
    alpha.push_back(static_cast<float>(std::clamp(sum / weights, 0.0, 1.0)));
  }
  return alpha;
}

}  // namespace selvedge
