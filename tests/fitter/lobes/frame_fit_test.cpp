// Normals and tangents as part of the fit.
#include "fitter/lobes/frame_fit.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "fitter/fit.h"
#include "format/base/random.h"
#include "format/fabric/lafortune.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

const DirectionGrid grid{8, 8};

/// A frame `tilt` rad off the cloth's own, its tangent turned by `spin`.
struct Axes {
  V3f tangent;
  V3f normal;
};
Axes axes_of(double tilt, double spin) {
  const V3d normal(std::sin(tilt) * 0.6, std::sin(tilt) * 0.8, std::cos(tilt));
  const V3d t(tangent_of(V3f(normal)));
  const V3d tangent = t * std::cos(spin) + normal.cross(t) * std::sin(spin);
  return {V3f(tangent), V3f(normal)};
}

/// Diffuse and an anisotropic lobe in that frame, seen from everywhere.
std::vector<V3f> radiance_in(const Axes& axes, const std::array<float, 5>& parameters) {
  const auto directions = directions_of(grid);
  const V3f binormal = axes.normal.cross(axes.tangent);
  const auto local = [&](const V3f& d) {
    return V3f(d.dot(axes.tangent), d.dot(binormal), d.dot(axes.normal));
  };
  std::vector<V3f> radiance;
  for (const V3f& v : directions) {
    for (const V3f& l : directions) {
      const V3f ll = local(l);
      const V3f lv = local(v);
      const float f = ll.z > 0 ? lafortune(parameters.data(), 1, &ll.x, &lv.x) : 0.0F;
      radiance.emplace_back(f, 0.5F * f, 0.25F * f);
    }
  }
  return radiance;
}

const std::array<float, 5> glossy{0.1F, -0.9F, -0.4F, 0.95F, 8};

}  // namespace

TEST_CASE(
    "a frame that is tilted and turned is found from the averaged one, and the error falls to a tenth") {
  const TexelDirections directions{directions_of(grid), directions_of(grid), grid, grid};
  const std::vector<float> alpha(64, 1);
  LobeFitOptions options;
  options.lobes = 1;
  options.channel.view_table = false;
  for (const double tilt : {0.2, 0.5, 0.8}) {
    for (const double spin : {0.0, 0.5, 1.2, 2.5}) {
      const Axes truth = axes_of(tilt, spin);
      const std::vector<V3f> radiance = radiance_in(truth, glossy);
      const Axes given = axes_of(0.5 * tilt, 0);
      const FrameFit fit =
          fit_frame(alpha.data(), radiance.data(), directions, given.normal, given.tangent, options);
      CAPTURE(tilt);
      CAPTURE(spin);
      CHECK(fit.error < 0.01 * fit.averaged_error);
      CHECK(fit.normal.dot(truth.normal) > std::cos(0.03F));
      CHECK(fit.normal.length() == doctest::Approx(1).epsilon(1e-3));
      CHECK(std::abs(fit.normal.dot(fit.tangent)) < 1e-3F);
    }
  }
}

TEST_CASE("the gradient by turns of the frame is that of the error") {
  const TexelDirections directions{directions_of(grid), directions_of(grid), grid, grid};
  std::vector<float> alpha;
  Random random(3);
  for (int v = 0; v < 64; ++v) alpha.push_back(static_cast<float>(random.uniform()));
  const std::vector<V3f> radiance = radiance_in(axes_of(0.4, 0.7), glossy);
  const Axes at = axes_of(0.3, 0.2);
  const TexelSamples samples = gather_texel(alpha.data(), radiance.data(), directions, at.normal, at.tangent);
  LobeFitOptions options;
  options.max_iterations = 3;  // not at a minimum: the partial derivative is meant
  const std::array<ChannelFit, 3> fits = fit_texel(samples, options);
  const V3d gradient = turning_gradient(samples, fits);

  // The directions as seen in the turned frame, the parameters as they are.
  const auto error_after = [&](const V3d& turn) {
    TexelSamples moved = samples;
    for (V3f& l : moved.lights) l = V3f(V3d(l) + turn.cross(V3d(l)));
    for (std::size_t v = 0; v < moved.views; ++v) {
      const V3d d(V3f(samples.view[0][v], samples.view[1][v], samples.view[2][v]));
      const V3d turned = d + turn.cross(d);
      for (int k = 0; k < 3; ++k) moved.view[k][v] = static_cast<float>(turned[k]);
    }
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
      ChannelProblem problem(moved, c, options.channel);
      ChannelState state = state_of(moved, c, fits[c]);
      problem.evaluate(state, 0);
      const double scale = moved.scale[c];
      sum += state.error * scale * scale;
    }
    return sum;
  };
  constexpr double h = 1e-3;
  const double size =
      std::sqrt(gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2]);
  CHECK(size > 0);
  for (int k = 0; k < 3; ++k) {
    V3d turn(0, 0, 0);
    turn[k] = h;
    const double slope = (error_after(turn) - error_after(-turn)) / (2 * h);
    CHECK(gradient[k] == doctest::Approx(slope).epsilon(0.01).scale(size));
  }
}

TEST_CASE("fitted frames give a valid fabric, a smaller error than averaged ones, and report the gain") {
  SamplesHeader header;
  header.width = 2;
  header.height = 2;
  SampleLevel level;
  level.width = level.height = 2;
  level.views = level.lights = grid.count();
  for (int t = 0; t < 4; ++t) {
    const std::vector<V3f> radiance = radiance_in(axes_of(0.5, 0.4 * t), glossy);
    level.radiance.insert(level.radiance.end(), radiance.begin(), radiance.end());
    level.alpha.insert(level.alpha.end(), 64, 1);
    level.normal.emplace_back(0, 0, 1);
  }
  FitOptions options;
  options.lobes = 1;
  const auto averaged = test::need(fit(level, header, options));
  options.frames = true;
  const auto found = test::need(fit(level, header, options));
  CHECK(validate(found.fabric));
  for (std::size_t k = 0; k < 2; ++k) {
    CHECK(found.levels[k].averaged_error == doctest::Approx(averaged.levels[k].training_error).epsilon(0.02));
    CHECK(found.levels[k].training_error < averaged.levels[k].training_error);
    CHECK(averaged.levels[k].averaged_error == 0);
  }
  CHECK(found.levels[0].training_error < 0.3 * averaged.levels[0].training_error);
}

TEST_CASE("the gain of frames is over averaged normals with the same layers") {
  const TexelDirections directions{directions_of(grid), directions_of(grid), grid, grid};
  const std::vector<float> alpha(64, 1);
  std::vector<V3f> radiance = radiance_in(axes_of(0.4, 0.6), glossy);
  // A shadow: the light's table explains it, whatever the frame.
  for (std::size_t i = 0; i < radiance.size(); ++i) {
    if (directions.lights[i % 64].x < 0) radiance[i] *= 0.1F;
  }
  LobeFitOptions options;
  options.lobes = 1;
  options.channel.light_table = true;
  const Axes given = axes_of(0.2, 0);
  const FrameFit fit =
      fit_frame(alpha.data(), radiance.data(), directions, given.normal, given.tangent, options);
  const TexelSamples samples =
      gather_texel(alpha.data(), radiance.data(), directions, given.normal, given.tangent);
  double averaged = samples.energy_below_horizon;
  for (const ChannelFit& channel : fit_texel(samples, options)) averaged += channel.error;
  CHECK(fit.averaged_error == doctest::Approx(averaged).epsilon(0.02));
  CHECK(fit.error < fit.averaged_error);
}

TEST_CASE("frames of texels that are black, holes or seen from one view stay finite") {
  const TexelDirections directions{directions_of(grid), directions_of(grid), grid, grid};
  const LobeFitOptions options;
  const std::vector<V3f> bright = radiance_in(axes_of(0.5, 0.4), glossy);
  const std::vector<V3f> black(bright.size(), V3f(0));
  std::vector<float> alpha(64, 0);
  const auto check = [&](const std::vector<V3f>& radiance) {
    const FrameFit fit =
        fit_frame(alpha.data(), radiance.data(), directions, V3f(0, 0, 1), V3f(1, 0, 0), options);
    CHECK(std::isfinite(fit.error));
    CHECK(fit.normal.length() == doctest::Approx(1).epsilon(1e-3));
    for (const ChannelFit& channel : fit.fits) {
      for (const double p : channel.parameters) CHECK(std::isfinite(p));
    }
  };
  check(bright);
  alpha[10] = 1;
  check(bright);
  check(black);
  std::vector<V3f> huge = bright;
  for (V3f& r : huge) r *= 1e30F;
  check(huge);
}
