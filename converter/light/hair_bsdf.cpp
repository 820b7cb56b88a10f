#include "converter/light/hair_bsdf.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selvedge {
namespace {

using std::numbers::pi;

constexpr std::size_t paths = 4;

double root(double x) { return std::sqrt(std::max(0.0, x)); }

/// Share of unpolarised light that a dielectric reflects.
double fresnel(double cosine, double refraction) {
  const double inside = root(1 - (1 - cosine * cosine) / (refraction * refraction));
  const double s = (cosine - refraction * inside) / (cosine + refraction * inside);
  const double p = (refraction * cosine - inside) / (refraction * cosine + inside);
  return 0.5 * (s * s + p * p);
}

/// exp(-x) times the modified Bessel function of order 0, to 2e-7 (Abramowitz and Stegun 9.8.1 and 9.8.2).
double scaled_bessel(double x) {
  if (x < 3.75) {
    const double t = x / 3.75 * (x / 3.75);
    return std::exp(-x) *
           (1 + t * (3.5156229 +
                     t * (3.0899424 + t * (1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813))))));
  }
  const double t = 3.75 / x;
  const double tail = 0.02635537 + t * (-0.01647633 + t * 0.00392377);
  return (0.39894228 +
          t * (0.01328592 +
               t * (0.00225319 + t * (-0.00157565 + t * (0.00916281 + t * (-0.02057706 + t * tail)))))) /
         std::sqrt(x);
}

/// Density over the elevation, whose integral with the cosine is 1 (d'Eon et al. 2011).
double longitudinal(double sine_a, double cosine_a, double sine_b, double cosine_b, double variance) {
  const double x = cosine_a * cosine_b / variance;
  const double top = x - sine_a * sine_b / variance - 1 / variance;  // at most 0
  return scaled_bessel(x) * std::exp(top) / (variance * (1 - std::exp(-2 / variance)));
}

double logistic_up_to(double x, double s) { return 1 / (1 + std::exp(-x / s)); }

/// The logistic distribution, cut to a turn.
double azimuthal(double x, double s) {
  x -= 2 * pi * std::round(x / (2 * pi));
  const double e = std::exp(-std::abs(x) / s);
  return e / (s * (1 + e) * (1 + e)) / (logistic_up_to(pi, s) - logistic_up_to(-pi, s));
}

double sample_azimuthal(double u, double s) {
  const double low = logistic_up_to(-pi, s);
  const double part = low + u * (logistic_up_to(pi, s) - low);
  return std::clamp(-s * std::log(1 / part - 1), -pi, pi);
}

/// The standard deviation along the fibre is this polynomial of the roughness, but for its last term.
constexpr double linear_width = 0.726;
constexpr double square_width = 0.812;

}  // namespace

double hair_roughness(double width) {
  return (std::sqrt(linear_width * linear_width + 4 * square_width * width) - linear_width) /
         (2 * square_width);
}

HairOptics::HairOptics(double refraction, double along, double around, const V3d& colour)
    : refraction_(refraction) {
  const double width = along * (linear_width + square_width * along) + 3.7 * std::pow(along, 20);
  const double variance = std::max(1e-6, width * width);
  spread_ = {variance, 0.25 * variance, 4 * variance, 4 * variance};
  const double b = around;
  scale_ = std::sqrt(pi / 8) * (0.265 * b + 1.194 * b * b + 5.372 * std::pow(b, 22));
  const double fitted = 5.969 - 0.215 * b + b * b * (2.532 + b * (-10.73 + b * (5.574 + b * 0.245)));
  constexpr double darkest = 1e-4;
  for (int c = 0; c < 3; ++c) {
    const double root_of = std::log(std::clamp(colour[c], darkest, 1.0)) / fitted;
    absorption_[c] = root_of * root_of;
  }
}

HairBsdf::HairBsdf(const HairOptics& optics, double view_sine, double offset)
    : optics_(optics), sine_(view_sine), cosine_(root(1 - view_sine * view_sine)) {
  const double h = std::clamp(offset, -1.0, 1.0);
  const double n = optics.refraction_;
  const double bent = root(n * n - sine_ * sine_) / std::max(1e-9, cosine_);  // of the plane across
  out_ = std::asin(h);
  in_ = std::asin(h / bent);
  const double way = 2 * std::cos(in_) / root(1 - sine_ * sine_ / (n * n));  // inside, in radii
  const double f = std::min(1 - 1e-9, fresnel(cosine_ * root(1 - h * h), n));
  for (int c = 0; c < 3; ++c) {
    const double left = std::exp(-optics.absorption_[c] * way);
    share_[0][c] = f;
    share_[1][c] = (1 - f) * (1 - f) * left;
    share_[2][c] = share_[1][c] * left * f;
    share_[3][c] = share_[2][c] * left * f / (1 - left * f);
  }
  double all = 0;
  for (std::size_t p = 0; p < paths; ++p) all += chance_[p] = share_[p].x + share_[p].y + share_[p].z;
  for (double& chance : chance_) chance /= all;
}

/// Azimuth at which smooth fibres send all of a path.
double HairBsdf::turn_of(std::size_t path) const {
  const auto p = static_cast<double>(path);
  return 2 * p * in_ - 2 * out_ + p * pi;
}

template <class Value>
Value HairBsdf::sum(const HairDirection& light, const std::array<Value, 4>& shares) const {
  const double cosine = root(1 - light.sine * light.sine);
  Value value(0);
  for (std::size_t p = 0; p < paths; ++p) {
    const double around =
        p + 1 < paths ? azimuthal(light.azimuth - turn_of(p), optics_.scale_) : 1 / (2 * pi);
    value += shares[p] * (longitudinal(light.sine, cosine, sine_, cosine_, optics_.spread_[p]) * around);
  }
  return value;
}

V3d HairBsdf::scattered(const HairDirection& light) const { return sum(light, share_); }

double HairBsdf::density(const HairDirection& light) const { return sum(light, chance_); }

HairDirection HairBsdf::sample(const V2d& random, const V2d& more) const {
  double x = random.x;
  std::size_t p = 0;
  while (p + 1 < paths && x >= chance_[p]) x -= chance_[p++];
  const double v = optics_.spread_[p];
  const double u = 1 - more.x;  // in (0, 1]
  const double lean = std::max(-1.0, 1 + v * std::log(u + (1 - u) * std::exp(-2 / v)));
  HairDirection light;
  light.sine = -lean * sine_ + root(1 - lean * lean) * std::cos(2 * pi * more.y) * cosine_;
  light.sine = std::clamp(light.sine, -1.0, 1.0);
  light.azimuth = p + 1 < paths ? turn_of(p) + sample_azimuthal(random.y, optics_.scale_) : 2 * pi * random.y;
  return light;
}

}  // namespace selvedge
