#include "converter/light/path_tracer.h"

#include <algorithm>
#include <bit>

namespace selvedge {
namespace {

/// Russian roulette spares paths this short: they carry most of the light.
constexpr int min_depth = 3;
/// Less than 1, so that a path caught in a pocket ends.
constexpr double max_survival = 0.98;

}  // namespace

std::optional<V3d> PathTracer::reflect(const SurfacePoint& point, const V3d& view, int depth,
                                       PathSampler& sampler, V3d& throughput) const {
  if (depth == bounces_) return std::nullopt;
  const YarnSurface surface = surface_at(scene_, point);
  const auto sample = sample_bsdf(surface, view, sampler.next());
  if (!sample) return std::nullopt;
  // A fibre may reflect into the yarn, where light goes on if the yarn lets any through.
  if (surface.transmission == 0 && sample->direction.dot(V3d(point.face_normal)) <= 0) return std::nullopt;
  throughput *= sample->weight;
  const double brightest = std::max({throughput.x, throughput.y, throughput.z});
  if (brightest <= 0) return std::nullopt;
  if (depth < min_depth) return sample->direction;
  const double survival = std::min(max_survival, brightest);
  if (sampler.next().x >= survival) return std::nullopt;
  throughput /= survival;
  return sample->direction;
}

std::uint64_t PathTracer::add_indirect(const SurfacePoint& point, const V3d& view,
                                       std::span<const V3f> lights, PathSampler& sampler,
                                       std::span<V3d> radiance) const {
  SurfacePoint vertex = point;
  V3d towards = view;
  V3d throughput(1, 1, 1);
  std::uint64_t rays = 0;
  for (int depth = 0;; ++depth) {
    const auto direction = reflect(vertex, towards, depth, sampler, throughput);
    if (!direction) return rays;
    ++rays;
    if (!scene_.trace(scene_.leave(vertex, *direction), *direction, vertex)) return rays;
    towards = -*direction;
    const YarnSurface surface = surface_at(scene_, vertex);
    for (std::size_t first = 0; first < lights.size(); first += packet_size) {
      const auto packet = lights.subspan(first, std::min(packet_size, lights.size() - first));
      std::uint32_t lit = 0;
      for (std::size_t l = 0; l < packet.size(); ++l)
        lit |= (vertex.face_normal.dot(packet[l]) > 0 ? 1U : 0U) << l;
      std::uint32_t through = 0;
      if (surface.transmission > 0) {
        const bool open = scene_.is_open();
        if (open || vertex.back) through = ~lit & ((1U << packet.size()) - 1);
        if (!open && vertex.back) lit = 0;
      }
      rays += static_cast<std::uint64_t>(std::popcount(lit) + std::popcount(through));
      lit &= ~scene_.occluded(vertex, packet, lit);
      if (through != 0) lit |= through & ~scene_.occluded(other_side(vertex), packet, through);
      for (; lit != 0; lit &= lit - 1) {
        const int l = std::countr_zero(lit);
        const V3d light(packet[l]);
        radiance[first + l] += throughput * reflectance(surface, light, towards) * incidence(surface, light);
      }
    }
  }
}

}  // namespace selvedge
