#include "converter/light/path_tracer.h"

#include <algorithm>
#include <array>

namespace selvedge {
namespace {

std::uint32_t reverse_bits(std::uint32_t x) {
  x = ((x >> 1) & 0x55555555U) | ((x & 0x55555555U) << 1);
  x = ((x >> 2) & 0x33333333U) | ((x & 0x33333333U) << 2);
  x = ((x >> 4) & 0x0f0f0f0fU) | ((x & 0x0f0f0f0fU) << 4);
  return __builtin_bswap32(x);
}

/// Flips each bit by a hash of the bits below it.
std::uint32_t permute_from_below(std::uint32_t x, std::uint32_t seed) {
  x += seed;
  x ^= x * 0x6c50b47cU;
  x ^= x * 0xb82f1e52U;
  x ^= x * 0xc7afe638U;
  x ^= x * 0x8d22f6e6U;
  return x;
}

/// Owen's scrambling of a number whose bits are already reversed.
std::uint32_t scrambled(std::uint32_t reversed, std::uint32_t seed) {
  return reverse_bits(permute_from_below(reversed, seed));
}

/// The second dimension of Sobol's sequence, reversed: the columns of Pascal's triangle modulo 2.
std::uint32_t reversed_sobol_y(std::uint32_t index) {
  static constexpr auto columns = [] {
    std::array<std::uint32_t, 32> c{};
    std::uint32_t v = 1;
    for (auto& column : c) {
      column = v;
      v ^= v << 1;
    }
    return c;
  }();
  std::uint32_t y = 0;
  for (std::size_t bit = 0; index != 0; ++bit, index >>= 1)
    if ((index & 1U) != 0) y ^= columns[bit];
  return y;
}

/// Russian roulette spares paths this short: they carry most of the light.
constexpr int min_depth = 3;
/// Less than 1, so that a path caught in a pocket ends.
constexpr double max_survival = 0.98;

}  // namespace

V2d sobol_point(std::uint32_t index, std::uint64_t seed) {
  // The first dimension is the index with its bits reversed: reversed again, the index itself.
  const std::uint32_t x = scrambled(index, static_cast<std::uint32_t>(seed));
  const std::uint32_t y = scrambled(reversed_sobol_y(index), static_cast<std::uint32_t>(seed >> 32));
  return {x * 0x1.0p-32, y * 0x1.0p-32};
}

V2d PathSampler::next_pair() {
  if (pair_ >= spread_pairs) {
    const double x = random_.uniform();
    return {x, random_.uniform()};
  }
  const std::uint64_t hash = hash64(seed_ ^ hash64(++pair_));
  const std::uint32_t order =
      reverse_bits(permute_from_below(reverse_bits(index_), static_cast<std::uint32_t>(hash)));
  return sobol_point(order, hash64(hash));
}

std::optional<V3d> PathTracer::continue_path(const SurfacePoint& point, const V3d& view, int depth,
                                             PathSampler& sampler, V3d& throughput) const {
  if (depth == bounces_) return std::nullopt;
  YarnBrdf surface = brdf_at(scene_, point);
  if (depth > 0) surface.diffuse_factor = 1;
  const auto sample = sample_bsdf(surface, view, sampler.next_pair());
  if (!sample) return std::nullopt;
  // A fibre may reflect into the yarn, where light continues if the yarn lets any through.
  if (surface.transmission == 0 && sample->direction.dot(V3d(point.face_normal)) <= 0) return std::nullopt;
  throughput *= sample->weight;
  const double brightest = std::max({throughput.x, throughput.y, throughput.z});
  if (brightest <= 0) return std::nullopt;
  if (depth < min_depth) return sample->direction;
  const double survival = std::min(max_survival, brightest);
  if (sampler.next_pair().x >= survival) return std::nullopt;
  throughput /= survival;
  return sample->direction;
}

bool PathTracer::follow(const V3d& direction, SurfacePoint& point) const {
  int yarns = 0;  // that the ray is within
  if (scene_.is_translucent() && point.hair_point < 0)
    yarns = (direction.dot(V3d(point.face_normal)) > 0) == point.is_back ? 1 : 0;
  do {
    if (!scene_.trace(scene_.offset_origin(point, direction), direction, point)) return false;
    if (yarns == 0 || point.hair_point >= 0) return true;
    yarns += point.is_back ? -1 : 1;
  } while (yarns > 0);
  return true;
}

void PathTracer::add_indirect(const SurfacePoint& point, const V3d& view, std::span<const V3f> lights,
                              PathSampler& sampler, std::span<V3d> radiance) const {
  SurfacePoint vertex = point;
  V3d towards = view;
  V3d throughput(1, 1, 1);
  for (int depth = 0;; ++depth) {
    const auto direction = continue_path(vertex, towards, depth, sampler, throughput);
    if (!direction || !follow(*direction, vertex)) return;
    towards = -*direction;
    YarnBrdf surface = brdf_at(scene_, vertex);
    surface.diffuse_factor = 1;  // the mean over strands: no bounce creates light
    for (std::size_t l = 0; l < lights.size(); ++l)
      radiance[l] += throughput * direct_light(scene_, vertex, surface, lights[l], towards);
  }
}

}  // namespace selvedge
