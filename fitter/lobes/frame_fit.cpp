#include "fitter/lobes/frame_fit.h"

#include <Imath/half.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/simd/powers.h"

namespace selvedge {
namespace {

struct Axes {
  V3d tangent;
  V3d normal;
};

/// The axes rotated about (tangent, binormal, normal) by the components of `turn`, rad.
Axes turned(const Axes& axes, const V3d& turn) {
  const V3d binormal = axes.normal.cross(axes.tangent);
  // `turn` rotates directions in the frame, so the frame rotates backwards.
  const V3d axis = -(axes.tangent * turn.x + binormal * turn.y + axes.normal * turn.z);
  const double angle = axis.length();
  if (!(angle > 0)) return axes;
  const V3d u = axis / angle;
  const auto rotate = [&](const V3d& d) {
    return d * std::cos(angle) + u.cross(d) * std::sin(angle) + u * (u.dot(d) * (1 - std::cos(angle)));
  };
  const V3d normal = rotate(axes.normal).normalized();
  const V3d tangent = rotate(axes.tangent);
  return {(tangent - normal * normal.dot(tangent)).normalized(), normal};
}

/// The axes rounded as in the file.
Axes stored(const Axes& axes) {
  const auto half = [](const V3d& d) {
    const auto rounded = [](double x) { return static_cast<double>(Imath::half(static_cast<float>(x))); };
    return V3d(rounded(d.x), rounded(d.y), rounded(d.z));
  };
  return {half(axes.tangent), half(axes.normal)};
}

struct Point {
  Axes axes;
  TexelSamples samples;
  std::array<ChannelFit, 3> fits;
  double cost = 0;
};

class FrameSearch {
 public:
  FrameSearch(const float* alpha, const V3f* radiance, const TexelDirections& directions,
              const LobeFitOptions& options)
      : alpha_(alpha), radiance_(radiance), directions_(directions), options_(options) {}

  /// Fits lobes in this frame, from `initial`, a fit in a similar frame, unless it is null.
  Point fit_at(const Axes& axes, const std::array<ChannelFit, 3>* initial) {
    Point point{axes, gather(axes), {}, 0};
    point.fits = initial == nullptr ? fit_texel(point.samples, options_)
                                    : refit_texel(point.samples, *initial, options_);
    for (std::size_t c = 0; c < 3; ++c) iterations_[c] += point.fits[c].iterations;
    point.cost = cost_in_frame(point.samples, point.fits);
    return point;
  }

  TexelSamples gather(const Axes& axes) const {
    return gather_texel(alpha_, radiance_, directions_, V3f(axes.normal), V3f(axes.tangent));
  }

  /// Of all fits so far, by channel.
  const std::array<int, 3>& iterations() const { return iterations_; }

 private:
  std::array<int, 3> iterations_{};
  const float* alpha_;
  const V3f* radiance_;
  const TexelDirections& directions_;
  const LobeFitOptions& options_;
};

using Rows = std::array<V3d, 3>;

V3d product(const Rows& m, const V3d& x) { return {m[0].dot(x), m[1].dot(x), m[2].dot(x)}; }

/// BFGS update of an inverse Hessian after a step s that changed the gradient by y.
void update(Rows& inverse, const V3d& s, const V3d& y) {
  const double sy = s.dot(y);
  // The update needs positive curvature along the step.
  if (!(sy > 1e-12 * std::sqrt(s.dot(s) * y.dot(y)))) return;
  const V3d hy = product(inverse, y);
  const double yhy = y.dot(hy);
  for (int i = 0; i < 3; ++i) {
    inverse[i] += (1 + yhy / sy) * s[i] * s / sy - (hy[i] * s + s[i] * hy) / sy;
  }
}

/// Descends to the nearest minimum. Rotations about the axes of different frames are added like vectors,
/// which is exact to first order, and steps become short.
void descend(FrameSearch& search, Point& point, double tolerance) {
  constexpr int max_steps = 20;
  constexpr int max_halvings = 6;
  constexpr double first_step = 0.1;
  constexpr double max_step_size = 0.4;
  V3d gradient = turning_gradient(point.samples, point.fits);
  Rows inverse;
  bool is_reset = true;  // the inverse Hessian has no curvature yet
  for (int step = 0; step < max_steps; ++step) {
    const double length = std::sqrt(gradient.dot(gradient));
    if (!(length > 0) || !std::isfinite(length)) return;
    if (is_reset) {
      const double h = first_step / length;
      inverse = {V3d(h, 0, 0), V3d(0, h, 0), V3d(0, 0, h)};
    }
    V3d turn = -product(inverse, gradient);
    double slope = turn.dot(gradient);
    const double size = std::sqrt(turn.dot(turn));
    if (!(slope < 0) || !std::isfinite(size)) return;
    if (size > max_step_size) {
      turn *= max_step_size / size;
      slope *= max_step_size / size;
    }
    std::optional<Point> next;
    for (int halving = 0; halving < max_halvings && !next; ++halving) {
      Point trial = search.fit_at(turned(point.axes, turn), &point.fits);
      if (trial.cost < point.cost + 1e-4 * slope) {
        next = std::move(trial);
        break;
      }
      turn /= 2;
      slope /= 2;
    }
    if (!next) {
      // The curvature may be invalid, because the cost jumps when a light rises above the horizon.
      if (is_reset) return;
      is_reset = true;
      continue;
    }
    const V3d next_gradient = turning_gradient(next->samples, next->fits);
    update(inverse, turn, next_gradient - gradient);
    is_reset = false;
    gradient = next_gradient;
    const bool done = point.cost - next->cost <= tolerance * point.cost;
    point = std::move(*next);
    if (done) return;
  }
}

double error_of(const TexelSamples& samples, const std::array<ChannelFit, 3>& fits) {
  double sum = samples.energy_below_horizon;
  for (const ChannelFit& fit : fits) sum += fit.error;
  return sum;
}

}  // namespace

double cost_in_frame(const TexelSamples& samples, const std::array<ChannelFit, 3>& fits) {
  double sum = samples.energy_below_horizon;
  for (const ChannelFit& fit : fits) sum += fit.cost;
  return sum;
}

V3d turning_gradient(const TexelSamples& samples, const std::array<ChannelFit, 3>& fits) {
  using L = Lanes<4>;
  const std::size_t stride = samples.stride();
  V3d gradient(0, 0, 0);
  for (std::size_t c = 0; c < 3; ++c) {
    const ChannelFit& fit = fits[c];
    const double scale = samples.scale[c];
    const ChannelState state = state_of(samples, static_cast<int>(c), fit);
    const auto rho = static_cast<float>(state.sizes[0]);
    std::vector<float> table(stride, 0);
    std::vector<float> weighted(stride, 0);
    for (std::size_t v = 0; v < samples.views; ++v) {
      table[v] = static_cast<float>(fit.table[v]);
      weighted[v] = static_cast<float>(fit.table[v] * samples.weight[v]);
    }
    for (std::size_t index = 0; index < samples.lights.size(); ++index) {
      const V3f& l = samples.lights[index];
      // Derivatives of l by rotations about each axis.
      const std::array<V3f, 3> dl{V3f(0, -l.z, l.y), V3f(l.z, 0, -l.x), V3f(-l.y, l.x, 0)};
      V3d sum(0, 0, 0);
      for (std::size_t v = 0; v < stride; v += L::count) {
        L::Floats x;
        L::Floats y;
        L::Floats z;
        L::Floats t;
        L::Floats wt;
        L::Floats r;
        L::load(&samples.view[0][v], x);
        L::load(&samples.view[1][v], y);
        L::load(&samples.view[2][v], z);
        L::load(&table[v], t);
        L::load(&weighted[v], wt);
        L::load(&samples.radiance[c][index * stride + v], r);
        L::Floats model = L::Floats{} + rho;
        std::array<L::Floats, 3> turns{};  // derivatives of the lobes by rotations
        for (std::size_t j = 0; j < state.shapes.size(); ++j) {
          const LobeShape& shape = state.shapes[j];
          const V3f d(static_cast<float>(shape.direction[0]), static_cast<float>(shape.direction[1]),
                      static_cast<float>(shape.direction[2]));
          const auto n = static_cast<float>(shape.exponent);
          const L::Floats base = d.x * l.x * x + d.y * l.y * y + d.z * l.z * z;
          L::Floats log;
          L::Floats power;
          L::log_and_power(base, n - 1, log, power);
          power *= static_cast<float>(state.sizes[j + 1]);
          model += power * base;
          power *= n;
          const std::array<std::array<L::Floats, 3>, 3> dv{
              {{L::Floats{}, -z, y}, {z, L::Floats{}, -x}, {-y, x, L::Floats{}}}};
          for (std::size_t k = 0; k < 3; ++k) {
            turns[k] += power * (d.x * (dl[k].x * x + l.x * dv[k][0]) + d.y * (dl[k].y * y + l.y * dv[k][1]) +
                                 d.z * (dl[k].z * z + l.z * dv[k][2]));
          }
        }
        const L::Floats residual = wt * (t * l.z * model - r);
        for (int k = 0; k < 3; ++k) {
          const L::Floats part = residual * (dl[k].z * model + l.z * turns[k]);
          for (std::size_t lane = 0; lane < L::count; ++lane) sum[k] += static_cast<double>(part[lane]);
        }
      }
      gradient += 2 * scale * scale * sum;
    }
  }
  return gradient;
}

FrameFit fit_frame(const float* alpha, const V3f* radiance, const TexelDirections& directions,
                   const V3f& normal, const V3f& tangent, const LobeFitOptions& options) {
  LobeFitOptions search_options = options;
  search_options.channel.light_table = false;
  FrameSearch search(alpha, radiance, directions, search_options);
  const Axes given{V3d(tangent), V3d(normal)};
  std::vector<Point> points{search.fit_at(given, nullptr)};
  FrameFit result;
  result.averaged_error = error_of(
      points[0].samples,
      options.channel.light_table ? refit_texel(points[0].samples, points[0].fits, options) : points[0].fits);

  // Lobes are aligned with the axes: a lobe between two axes needs a frame rotated by half their angle.
  const V3d eighth(0, 0, std::numbers::pi / 4);
  const V3d up(0, 0, 1);
  const Axes upright{V3d(tangent_of(V3f(up))), up};
  for (const Axes& axes : {turned(given, eighth), upright, turned(upright, eighth)}) {
    points.push_back(search.fit_at(axes, nullptr));
  }
  const auto cheaper = [](const Point& a, const Point& b) { return a.cost < b.cost; };
  std::stable_sort(points.begin(), points.end(), cheaper);
  points.resize(std::min<std::size_t>(points.size(), options.finalists));
  for (Point& point : points) descend(search, point, options.tolerance);
  const Point& best = *std::min_element(points.begin(), points.end(), cheaper);

  const Axes axes = stored(best.axes);
  const TexelSamples samples = search.gather(axes);
  result.normal = V3f(axes.normal);
  result.tangent = V3f(axes.tangent);
  result.fits = refit_texel(samples, best.fits, options);
  for (std::size_t c = 0; c < 3; ++c) result.fits[c].iterations += search.iterations()[c];
  result.error = error_of(samples, result.fits);
  return result;
}

}  // namespace selvedge
