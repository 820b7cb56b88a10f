// Rectified pictures of a sample, made from the traced pairs of a samples file, with faults of known size.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "format/base/atomic_file.h"
#include "format/base/guard.h"
#include "format/base/random.h"
#include "format/picture/image.h"
#include "format/samples/samples.h"

namespace selvedge::test {

struct PhotographOptions {
  V2d period{21.3, 19.6};  ///< of the cloth in a picture, pixels
  V2i size{64, 56};        ///< of a picture, pixels
  double noise = 0.01;     ///< standard deviation, as a fraction of the value and of a hundredth of white
  double shift = 0.3;      ///< of each picture, pixels, standard deviation along each axis
};

/// Normally distributed (Box and Muller 1958).
inline double normal(Random& random) {
  const double radius = std::sqrt(-2 * std::log(1 - random.uniform()));
  return radius * std::cos(2 * std::numbers::pi * random.uniform());
}

/// The cell at a place in periods, y upwards, that repeats: bilinear between the centres of its texels.
inline V3d cell_at(const PairSamples& samples, std::size_t pair, const V2d& place) {
  const auto wrapped = [](double at, int count) { return at - std::floor(at / count) * count; };
  const double x = wrapped(place.x * samples.width - 0.5, samples.width);
  const double y = wrapped(place.y * samples.height - 0.5, samples.height);
  V3d sum(0, 0, 0);
  for (const int j : {0, 1}) {
    for (const int i : {0, 1}) {
      const int column = (static_cast<int>(x) + i) % samples.width;
      const int row = (static_cast<int>(y) + j) % samples.height;
      const std::size_t texel =
          (pair * samples.height + row) * static_cast<std::size_t>(samples.width) + column;
      const double u = x - std::floor(x);
      const double v = y - std::floor(y);
      sum += (i == 0 ? 1 - u : u) * (j == 0 ? 1 - v : v) * static_cast<double>(samples.alpha[texel]) *
             V3d(samples.radiance[texel]);
    }
  }
  return sum;
}

/// Writes the first `count` pairs of `samples` as `folder`/N.exr, before black, each with an exposure of its
/// own, and their table `folder`/table.csv.
inline Result<void> photograph(const PairSamples& samples, std::size_t count, const std::string& folder,
                               const PhotographOptions& o = {}) {
  return catch_exceptions(folder, [&]() -> Result<void> {
    std::filesystem::create_directories(folder);
    std::string table = "file,light_x,light_y,light_z,view_x,view_y,view_z,exposure\n";
    constexpr int finer = 2;  // points a pixel along each axis
    for (std::size_t p = 0; p < count; ++p) {
      Random random(17, p);
      const double exposure = std::exp2(2 * random.uniform() - 1);
      const V2d shift(o.shift * normal(random), o.shift * normal(random));
      Image picture{o.size.x, o.size.y, 3, {}};
      for (int y = 0; y < o.size.y; ++y) {
        for (int x = 0; x < o.size.x; ++x) {
          V3d value(0, 0, 0);
          for (int k = 0; k < finer * finer; ++k) {
            const int row = k / finer;
            const V2d at(x + (k % finer + 0.5) / finer, o.size.y - y - (row + 0.5) / finer);
            value += cell_at(samples, p, (at + shift) / o.period) * (std::numbers::pi / (finer * finer));
          }
          for (int c = 0; c < 3; ++c) {
            const double noise = o.noise * std::hypot(value[c], 0.01) * normal(random);
            picture.pixels.push_back(static_cast<float>((value[c] + noise) * exposure));
          }
        }
      }
      value_or_throw(write_exr(fmt::format("{}/{}.exr", folder, p), picture));
      const V3f& l = samples.pairs[p].light;
      const V3f& v = samples.pairs[p].view;
      table += fmt::format("{}.exr,{},{},{},{},{},{},{}\n", p, l.x, l.y, l.z, v.x, v.y, v.z, exposure);
    }
    return write_file(folder + "/table.csv", table);
  });
}

}  // namespace selvedge::test
