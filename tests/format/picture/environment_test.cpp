#include "format/picture/environment.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "format/base/random.h"
#include "format/picture/image.h"
#include "format/picture/probe_layout.h"
#include "format/picture/studio.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

/// An environment of a closed form.
template <class Radiance>
Environment made(int width, const Radiance& radiance) {
  Environment e{width, width / 2, {}, {}};
  for (int y = 0; y < e.height; ++y) {
    for (int x = 0; x < e.width; ++x) e.radiance.push_back(radiance(e.direction(x, y)));
  }
  return e;
}

V3f smooth_radiance(const SmoothLight& light, const V3d& d) {
  const auto basis = smooth_basis(d.x, d.y, d.z);
  V3f sum(0, 0, 0);
  for (int k = 0; k < smooth_functions; ++k) sum += light.factors[k] * static_cast<float>(basis[k]);
  return sum;
}

V3d any_unit(Random& random) {
  const double z = 2 * random.uniform() - 1;
  const double phi = 2 * std::numbers::pi * random.uniform();
  const double planar = std::sqrt(1 - z * z);
  return {planar * std::cos(phi), planar * std::sin(phi), z};
}

/// Irradiance of a surface that faces along `n`.
V3d irradiance(const EnvironmentLight& light, const V3d& n) {
  V3d sum(0, 0, 0);
  for (const Light& lamp : light.lamps) sum += V3d(lamp.irradiance) * std::max(0.0, lamp.direction.dot(n));
  constexpr int side = 200;
  for (int i = 0; i < side * side; ++i) {
    const double z = 2 * (i % side + 0.5) / side - 1;
    const double phi = 2 * std::numbers::pi * (i / side + 0.5) / side;
    const double planar = std::sqrt(1 - z * z);
    const V3d d(planar * std::cos(phi), planar * std::sin(phi), z);
    sum += V3d(smooth_radiance(light.rest, d)) *
           (std::max(0.0, d.dot(n)) * 4 * std::numbers::pi / (side * side));
  }
  return sum;
}

}  // namespace

TEST_CASE("an environment's pixels cover the sphere, and directions find them again") {
  Environment e = made(64, [](const V3d& d) { return V3f(V3d(2) + d); });
  double sum = 0;
  for (int y = 0; y < e.height; ++y) sum += e.solid_angle(y) * e.width;
  CHECK(sum == doctest::Approx(4 * std::numbers::pi));
  // glTF's layout: the middle is seen along -z, what is right of it along +x.
  CHECK(e.direction(31, 15).z < -0.99);
  CHECK(e.direction(47, 15).x > 0.99);
  CHECK(e.direction(0, 0).y > 0.99);
  Random random(3);
  for (const double turn : {0.0, 90.0, -200.0}) {
    e.options.turn = turn;
    const Environment turned_one = e;
    for (int i = 0; i < 200; ++i) {
      const int x = static_cast<int>(random.uniform() * 64);
      const int y = static_cast<int>(random.uniform() * 32);
      const V3f seen = turned_one.at(turned_one.direction(x, y));
      CHECK((seen - e.radiance[y * 64 + x]).length() < 1e-4F);
    }
  }
  // A turn by a quarter moves what was seen along -z to -x.
  e.options.turn = 90;
  CHECK((e.at({-1, 0, 0}) - V3f(2, 2, 1)).length() < 0.01F);
}

TEST_CASE("smooth light is the same seen from any axes") {
  Random random(5);
  SmoothLight light;
  for (V3f& f : light.factors)
    f = V3f(static_cast<float>(random.uniform()), static_cast<float>(random.uniform()), 0);
  for (int i = 0; i < 50; ++i) {
    const V3d n = any_unit(random);
    const V3d t = n.cross(any_unit(random)).normalized();
    const V3d b = n.cross(t) * (i % 2 == 0 ? 1.0 : -1.0);
    std::array<double, smooth_functions> red;
    for (int k = 0; k < smooth_functions; ++k) red[k] = static_cast<double>(light.factors[k].x);
    const auto in_axes = turned(red, t, b, n);
    const V3d d = any_unit(random);
    const auto basis = smooth_basis(d.x, d.y, d.z);
    double sum = 0;
    for (int k = 0; k < smooth_functions; ++k) sum += in_axes[k] * basis[k];
    CHECK(sum == doctest::Approx(smooth_radiance(light, t * d.x + b * d.y + n * d.z).x).epsilon(1e-5));
  }
}

TEST_CASE("constant light, a cosine and a step have the irradiance of closed forms") {
  Random random(7);
  const EnvironmentLight constant = divide(made(128, [](const V3d&) { return V3f(0.5F, 1, 2); }));
  const EnvironmentLight cosine =
      divide(made(128, [](const V3d& d) { return V3f(static_cast<float>(1 + d.y)); }));
  const EnvironmentLight step = divide(made(128, [](const V3d& d) { return V3f(d.y > 0 ? 1.0F : 0.0F); }));
  CHECK(constant.lamps.empty());
  CHECK(cosine.lamps.empty());
  CHECK(step.lamps.empty());
  for (int i = 0; i < 10; ++i) {
    const V3d n = any_unit(random);
    CHECK((irradiance(constant, n) - V3d(0.5, 1, 2) * std::numbers::pi).length() < 0.01);
    CHECK(irradiance(cosine, n).x == doctest::Approx(std::numbers::pi * (1 + 2.0 / 3 * n.y)).epsilon(0.002));
    // A half sphere of light: pi (1 + n.y) / 2. Degree 2 leaves at most 2 % of what a surface below it has.
    CHECK(std::abs(irradiance(step, n).x - std::numbers::pi * (1 + n.y) / 2) < 0.02 * std::numbers::pi);
  }
}

TEST_CASE("a sun becomes a lamp of its direction and irradiance, a second one another") {
  const V3d sun = V3d(0.3, 0.8, 0.5).normalized();
  const V3d second = V3d(-0.8, 0.2, -0.1).normalized();
  const double half_angle = 2 * std::numbers::pi / 180;
  const auto sky = [&](const V3d& d) {
    if (d.dot(sun) > std::cos(half_angle)) return V3f(2000, 1500, 1000);
    if (d.dot(second) > std::cos(half_angle)) return V3f(400, 500, 600);
    return V3f(0.5F, 0.6F, 0.7F);
  };
  const EnvironmentLight light = divide(made(512, sky));
  REQUIRE(light.lamps.size() == 2);
  const double cap = 2 * std::numbers::pi * (1 - std::cos(half_angle));
  CHECK(light.lamps[0].direction.dot(sun) > 0.9999);
  CHECK(light.lamps[1].direction.dot(second) > 0.9999);
  CHECK(light.lamps[0].irradiance.x == doctest::Approx(2000 * cap).epsilon(0.05));
  CHECK(light.lamps[1].irradiance.z == doctest::Approx(600 * cap).epsilon(0.05));
  // Nothing is lost: all light, whichever its part.
  V3d whole(0, 0, 0);
  for (const Light& lamp : light.lamps) whole += V3d(lamp.irradiance);
  whole += V3d(light.rest.factors[0]) * (4 * std::numbers::pi);
  const V3d all = V3d(0.5, 0.6, 0.7) * (4 * std::numbers::pi - 2 * cap) + V3d(2400, 2000, 1600) * cap;
  CHECK((whole - all).length() < 0.05 * all.length());
}

TEST_CASE("turned light is the turned environment's") {
  const Environment plain = studio();
  for (const EnvironmentOptions options : {EnvironmentOptions{30, 2}, {-170, 0.5}}) {
    const EnvironmentLight light = turned(divide(plain), options);
    const EnvironmentLight expected = divide(studio(options));
    REQUIRE(light.lamps.size() == expected.lamps.size());
    for (std::size_t i = 0; i < light.lamps.size(); ++i) {
      CHECK((light.lamps[i].direction - expected.lamps[i].direction).length() < 1e-9);
      CHECK((light.lamps[i].irradiance - expected.lamps[i].irradiance).length() < 1e-6);
    }
    for (int k = 0; k < smooth_functions; ++k)
      CHECK((light.rest.factors[k] - expected.rest.factors[k]).length() < 1e-5);
  }
}

TEST_CASE("the studio lights a white cloth from two sides, and leaves none dark") {
  const Environment room = studio();
  CHECK(divide(room).lamps.size() == 2);
  const std::vector<Light> pixels = lamps_of(room);
  const auto white_facing = [&](const V3d& normal) {
    double irradiance = 0;
    for (const Light& pixel : pixels) {
      CHECK(pixel.irradiance.x == pixel.irradiance.y);
      irradiance += std::max(0.0, pixel.direction.dot(normal)) * static_cast<double>(pixel.irradiance.x);
    }
    return irradiance / std::numbers::pi;
  };
  CHECK(white_facing(divide(room).lamps[0].direction) == doctest::Approx(1.75).epsilon(0.1));
  for (const V3d& normal : {V3d(0, 0, 1), V3d(0, 0, -1), V3d(1, 0, 0), V3d(-1, 0, 0), V3d(0, 1, 0)})
    CHECK(white_facing(normal) > 0.3);
}

TEST_CASE("crosses and balls are the environments whose directions they show") {
  // Directions of their pixels by the layouts' own definitions: a folded cube, and Debevec's rotation of -z
  // by pi r about the axis across.
  const auto on_cube = [](int column, int row, double x, double y, bool tall) {
    if (row == 0) return V3d(x, 1, -y);
    if (row == 2) return V3d(x, -1, y);
    if (row == 3) return V3d(x, y, 1);
    if (column == 0) return V3d(-1, -y, -x);
    if (column == 1) return V3d(x, -y, -1);
    return column == 2 ? V3d(1, -y, x) : V3d(-x, -y, tall ? 0 : 1);
  };
  struct Case {
    ProbeLayout layout;
    V2i size;
  };
  for (const Case& c : {Case{ProbeLayout::vertical_cross, V2i(192, 256)},
                        {ProbeLayout::horizontal_cross, V2i(256, 192)},
                        {ProbeLayout::ball, V2i(256, 256)}}) {
    CHECK(probe_layout(c.size) == c.layout);
    const bool tall = c.layout == ProbeLayout::vertical_cross;
    Image probe{c.size.x, c.size.y, 4, {}};
    for (int j = 0; j < c.size.y; ++j) {
      for (int i = 0; i < c.size.x; ++i) {
        V3d d(0, 0, 0);
        if (c.layout == ProbeLayout::ball) {
          const V2d uv((i + 0.5) / 128 - 1, 1 - (j + 0.5) / 128);
          const double phi = std::numbers::pi * uv.length();
          const double theta = std::atan2(uv.y, uv.x);
          if (uv.length() <= 1)
            d = V3d(std::sin(phi) * std::cos(theta), std::sin(phi) * std::sin(theta), -std::cos(phi));
        } else if (tall ? i / 64 == 1 || j / 64 == 1 : j / 64 == 1 || i / 64 == 1) {
          d = on_cube(i / 64, j / 64, (i % 64 + 0.5) / 32 - 1, (j % 64 + 0.5) / 32 - 1, tall).normalized();
        }
        for (int k = 0; k < 3; ++k) probe.pixels.push_back(static_cast<float>(0.5 + 0.5 * d[k]));
        probe.pixels.push_back(1);
      }
    }
    const Image flat = equirectangular(probe, c.layout);
    const Environment e{flat.width, flat.height, {}, {}};
    double largest = 0;
    for (int y = 0; y < e.height; ++y) {
      for (int x = 0; x < e.width; ++x) {
        const float* pixel = &flat.pixels[std::size_t{4} * (y * e.width + x)];
        const V3d seen = V3d(V3f(pixel[0], pixel[1], pixel[2])) * 2.0 - V3d(1);
        // The rim of a ball is all one direction, of which half pixels lie outside of the disc.
        if (c.layout != ProbeLayout::ball || e.direction(x, y).z < 0.99)
          largest = std::max(largest, (seen - e.direction(x, y)).length());
      }
    }
    CHECK(largest < 0.03);  // half a pixel of the coarsest, where faces meet
  }
  for (const V2i& size : {V2i(4, 4), V2i(100, 51), V2i(64, 128)}) CHECK_FALSE(probe_layout(size));
}

TEST_CASE("environments are read from files, and other pictures are refused") {
  const Folder folder;
  Image image{8, 4, 3, std::vector<float>(8 * 4 * 3, 1.0F)};
  image.pixels[3] = -1;
  need(write_exr(folder / "e.exr", image));
  const Environment e = need(read_environment(folder / "e.exr"));
  CHECK(e.width == 8);
  CHECK(e.radiance[1] == V3f(0, 1, 1));
  CHECK(e.radiance[2] == V3f(1, 1, 1));
  image.pixels[5] = std::numeric_limits<float>::infinity();
  need(write_exr(folder / "f.exr", image));
  CHECK(error_of(read_environment(folder / "f.exr")).code == Code::image_unreadable);
  need(write_exr(folder / "g.exr", {4, 4, 3, std::vector<float>(4 * 4 * 3, 1.0F)}));
  CHECK(error_of(read_environment(folder / "g.exr")).code == Code::image_unreadable);
}
