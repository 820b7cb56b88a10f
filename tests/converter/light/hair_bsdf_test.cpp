#include "converter/light/hair_bsdf.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/light/sobol.h"

using namespace selvedge;

namespace {

using std::numbers::pi;

/// The integral over the sphere of value(light), by the midpoint rule over sine and azimuth: equal areas.
template <class F>
double over_sphere(const F& value, int rows = 400, int columns = 400) {
  double sum = 0;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      sum += value(HairDirection{2 * (i + 0.5) / rows - 1, 2 * pi * (j + 0.5) / columns});
    }
  }
  return sum * 4 * pi / (rows * columns);
}

/// What a fibre sends from `light` to a viewer at this elevation, a mean over all places across it.
double far_field(const HairOptics& optics, double view_sine, const HairDirection& light) {
  constexpr int places = 2000;
  double sum = 0;
  for (int i = 0; i < places; ++i) {
    sum += HairBsdf(optics, view_sine, 2 * (i + 0.5) / places - 1).scattered(light).x / places;
  }
  return sum;
}

}  // namespace

TEST_CASE("a clear fibre sends all light on, wherever it is met") {
  for (const double along : {0.15, 0.3, 0.6}) {
    const HairOptics clear(1.55, along, 0.3, V3d(1, 1, 1));
    for (const double sine : {0.0, 0.4, -0.8}) {
      for (const double offset : {0.0, 0.5, -0.9}) {
        const HairBsdf bsdf(clear, sine, offset);
        // The narrowest lobe is 0.06 wide along: a step of 1/200 is exact, but where it is cut at a pole.
        CHECK(over_sphere([&](const HairDirection& l) { return bsdf.scattered(l).x; }) ==
              doctest::Approx(1).epsilon(2e-3));
      }
    }
  }
}

TEST_CASE("sampling a fibre follows its density, which integrates to one") {
  const HairOptics red(1.55, 0.3, 0.3, V3d(0.6, 0.1, 0.05));
  const HairBsdf bsdf(red, 0.3, 0.6);
  CHECK(over_sphere([&](const HairDirection& l) { return bsdf.density(l); }) ==
        doctest::Approx(1).epsilon(2e-3));
  // Light of (1 + sine)(1 + cos azimuth) tells lobes apart.
  const auto sky = [](const HairDirection& l) { return (1 + l.sine) * (1 + std::cos(l.azimuth)); };
  const double exact = over_sphere([&](const HairDirection& l) { return bsdf.scattered(l).x * sky(l); });
  double sum = 0;
  double square = 0;
  constexpr std::uint32_t count = 1 << 16;
  for (std::uint32_t i = 0; i < count; ++i) {
    PathSampler sampler(i, 3);
    const V2d random = sampler.next();
    const HairDirection l = bsdf.sample(random, sampler.next());
    const double value = bsdf.scattered(l).x / bsdf.density(l) * sky(l);
    sum += value / count;
    square += value * value / count;
  }
  // Independent points would have this standard error; 3.3 of them at 1e-3.
  CHECK(std::abs(sum - exact) < 3.3 * std::sqrt((square - sum * sum) / count));
}

TEST_CASE("dark fibres absorb, and the more the longer the way") {
  const HairOptics black(1.55, 0.3, 0.3, V3d(0, 0, 0));
  const HairBsdf middle(black, 0, 0);
  // Next to only the surface's reflection is left: 0.0465 for index 1.55, straight on; and of colour 1e-4,
  // the darkest there is, exp(-2 (ln(1e-4) / 5.92)^2) = 0.0075 of the 0.909 that enter.
  CHECK(over_sphere([&](const HairDirection& l) { return middle.scattered(l).x; }) ==
        doctest::Approx(0.0465 + 0.909 * 0.0075).epsilon(0.01));
  const HairOptics grey(1.55, 0.3, 0.3, V3d(0.5, 0.5, 0.5));
  const auto kept = [&](double offset) {
    const HairBsdf bsdf(grey, 0, offset);
    return over_sphere([&](const HairDirection& l) { return bsdf.scattered(l).x; });
  };
  CHECK(kept(0) < kept(0.8));
}

TEST_CASE("a fibre as a whole is reciprocal between elevations of equal size, and nearly between others") {
  const HairOptics optics(1.55, 0.3, 0.3, V3d(0.5, 0.5, 0.5));
  for (const double azimuth : {0.3, 1.7, 3.0}) {
    for (const double sine : {0.2, 0.7}) {
      for (const double sign : {1.0, -1.0}) {
        CHECK(far_field(optics, sine, {sign * sine, azimuth}) ==
              doctest::Approx(far_field(optics, sign * sine, {sine, -azimuth})).epsilon(1e-6));
      }
    }
    // The kinds of path are shared out by the viewer's elevation alone: up to 6 % between 10 and 30 degrees.
    CHECK(far_field(optics, 0.17, {-0.5, azimuth}) ==
          doctest::Approx(far_field(optics, -0.5, {0.17, -azimuth})).epsilon(0.06));
  }
}

TEST_CASE("the roughness of a lobe gives its width") {
  for (const double width : {0.08, 0.25, 0.31}) {
    const HairOptics optics(1.0001, hair_roughness(width), 0.3, V3d(1, 1, 1));
    // Next to no refraction: all light passes, TT alone, half as wide as R.
    const HairBsdf bsdf(optics, 0, 0);
    const double square =
        over_sphere([&](const HairDirection& l) { return bsdf.scattered(l).x * l.sine * l.sine; });
    // The variance of the sine on a circle about the axis is a little less than that of the angle.
    CHECK(std::sqrt(square) == doctest::Approx(width / 2).epsilon(0.05));
  }
}
