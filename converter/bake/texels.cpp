#include "converter/bake/texels.h"

#include <algorithm>
#include <bit>
#include <numbers>
#include <numeric>

#include "format/base/parallel.h"
#include "format/simd/wide.h"

namespace selvedge {
namespace {

using std::numbers::pi;

/// Reflectance of a packet's points under direct light, as one array per quantity.
struct Reflecting {
  alignas(64) std::array<float, packet_size> nx{}, ny{}, nz{};
  std::array<V3f, packet_size> diffuse;  // (1 - w) albedo / pi
  GlossPacket gloss;
};

}  // namespace

/// Sums over the rays of one texel and view.
struct TexelBaker::Gather {
  int rays = 0;
  int hits = 0;
  V3d normal{0, 0, 0};
  std::vector<double> radiance;  // sum over hits: [channel][light]
  std::vector<float> recent;     // partial sums in single precision that are still to be added to `radiance`

  explicit Gather(std::size_t lights) : radiance(3 * lights), recent(3 * lights) {}
  void clear() {
    rays = hits = 0;
    normal = V3d(0, 0, 0);
    std::ranges::fill(radiance, 0.0);
  }
  void settle() {
    for (std::size_t i = 0; i < recent.size(); ++i) radiance[i] += static_cast<double>(recent[i]);
    std::ranges::fill(recent, 0.0F);
  }
};

/// Up to 16 rays, and the sums that receive their radiance.
struct TexelBaker::Packet {
  std::size_t size = 0;
  std::array<V3d, packet_size> origin;
  std::array<Gather*, packet_size> gather;
  std::array<std::uint32_t, packet_size> index;  // of the ray in its texel
  std::array<std::uint64_t, packet_size> seed;   // of the texel's paths
};

struct TexelBaker::TexelRays {
  int x, y;
  std::uint32_t count, split;  // rays before `split` belong to the first half
  std::uint64_t seed;
  Gather* early;
  Gather* late;
};

void TexelBaker::sample(std::span<const TexelRays> texels, const V3f& view,
                        std::span<const V3f> lights) const {
  const V3d towards(view);
  const V2d period = scene_.period();
  // Rays begin beyond the cell, because the reference plane may lie within the yarn. From behind, the cell is
  // turned over.
  const auto thickness = static_cast<double>(scene_.bounds().max.z);
  const double plane_z = view.z > 0 ? plane_z_ : thickness - plane_z_;
  const double way = (thickness - plane_z_ + period.x) / std::abs(static_cast<double>(view.z));
  Packet packet;
  int packets = 0;
  const auto settle = [&] {
    for (const TexelRays& texel : texels) {
      texel.early->settle();
      texel.late->settle();
    }
  };
  // Number of packets that are summed in single precision before they are added in double.
  constexpr int packets_between = 8;
  for (const TexelRays& texel : texels) {
    texel.early->rays += static_cast<int>(texel.split);
    texel.late->rays += static_cast<int>(texel.count - texel.split);
    // Points whose indices are equal modulo a power of two lie in one strip of the texel, so the rays of a
    // packet meet the same few triangles.
    constexpr auto lanes = static_cast<std::uint32_t>(packet_size);
    const std::uint32_t packets_of_its_own = texel.count % lanes == 0 ? texel.count / lanes : 0;
    for (std::uint32_t k = 0; k < texel.count; ++k) {
      const std::uint32_t i = packets_of_its_own > 0 ? k % lanes * packets_of_its_own + k / lanes : k;
      const V2d within = sobol_point(i, texel.seed);
      // y points up, rows of texels go down.
      const V3d on_plane((texel.x + within.x) / texels_.x * period.x,
                         (1 - (texel.y + within.y) / texels_.y) * period.y, plane_z);
      packet.origin[packet.size] = on_plane + towards * way;
      packet.gather[packet.size] = i < texel.split ? texel.early : texel.late;
      packet.index[packet.size] = i;
      packet.seed[packet.size] = hash64(texel.seed);
      if (++packet.size < packet_size) continue;
      follow(packet, towards, lights);
      packet.size = 0;
      if (++packets % packets_between == 0) settle();
    }
  }
  if (packet.size > 0) follow(packet, towards, lights);
  settle();
}

void TexelBaker::follow(const Packet& packet, const V3d& view, std::span<const V3f> lights) const {
  PointPacket points;
  const std::uint32_t hits = scene_.trace(std::span(packet.origin).first(packet.size), -view, points);
  for (std::uint32_t remaining = hits; remaining != 0; remaining &= remaining - 1) {
    const int i = std::countr_zero(remaining);
    ++packet.gather[i]->hits;
    packet.gather[i]->normal += V3d(scene_.vertex_normal(points[i]));
  }
  light_directly(packet, points, hits, view, lights);
  const std::size_t n = lights.size();
  std::vector<V3d> radiance;
  for (std::uint32_t remaining = hits; remaining != 0; remaining &= remaining - 1) {
    const int i = std::countr_zero(remaining);
    Gather& gather = *packet.gather[i];
    PathSampler sampler(packet.index[i], packet.seed[i]);
    radiance.assign(n, V3d(0, 0, 0));
    tracer_.add_indirect(points[i], view, lights, sampler, radiance);
    for (std::size_t l = 0; l < n; ++l)
      for (std::size_t c = 0; c < 3; ++c) gather.radiance[c * n + l] += radiance[l][static_cast<int>(c)];
  }
}

void TexelBaker::light_directly(const Packet& packet, const PointPacket& points, std::uint32_t hits,
                                const V3d& view, std::span<const V3f> lights) const {
  if (hits == 0) return;
  Reflecting r;
  const bool glossy = !scene_.mesh().gloss.empty();
  const bool varied = !scene_.mesh().yarn_places.empty() || scene_.is_translucent();
  for (std::uint32_t remaining = hits; remaining != 0; remaining &= remaining - 1) {
    const int i = std::countr_zero(remaining);
    V3f normal = points[i].face_normal;
    V3f albedo;
    float diffuse = 1;
    if (glossy || varied) {
      const YarnBrdf surface = brdf_at(scene_, points[i]);
      normal = V3f(surface.normal);
      albedo = V3f(surface.albedo);
      diffuse -= surface.gloss.weight;
      if (surface.transmission > 0)
        diffuse =
            static_cast<float>(surface.diffuse_factor * diffuse_weight(surface) * (1 - surface.transmission));
      r.gloss.set_lane(i, surface, view);
    } else {
      albedo = scene_.albedo(points[i]);
    }
    r.nx[i] = normal.x;
    r.ny[i] = normal.y;
    r.nz[i] = normal.z;
    r.diffuse[i] = albedo * diffuse;
  }
  const std::size_t n = lights.size();
  const OffsetOrigins leaving = scene_.offset_origin(points, hits);
  for (std::size_t l = 0; l < n; ++l) {
    const V3f& light = lights[l];
    alignas(64) std::array<float, packet_size> cosine;
    std::uint32_t facing = 0;
    for (std::size_t i = 0; i < packet_size; ++i)
      cosine[i] = r.nx[i] * light.x + r.ny[i] * light.y + r.nz[i] * light.z;
    for (std::size_t i = 0; i < packet_size; ++i) facing |= (cosine[i] > 0 ? 1U : 0U) << i;
    facing &= hits;
    if (facing == 0) continue;
    const std::uint32_t lit = facing & ~scene_.is_occluded(leaving, light, facing);
    GlossPacket::Lanes gloss{};
    GlossPacket::Lanes body;
    body.fill(std::numbers::inv_pi_v<float>);
    if (glossy) r.gloss.reflectance(light, body, gloss);
    for (std::uint32_t remaining = lit; remaining != 0;) {
      // Lanes of the same half of a texel are adjacent and are summed before they are added to it.
      Gather* const owner = packet.gather[std::countr_zero(remaining)];
      V3f sum(0, 0, 0);
      for (; remaining != 0; remaining &= remaining - 1) {
        const int i = std::countr_zero(remaining);
        if (packet.gather[i] != owner) break;
        sum += (r.diffuse[i] * body[i] + V3f(gloss[i])) * cosine[i];
      }
      for (std::size_t c = 0; c < 3; ++c) owner->recent[c * n + l] += sum[static_cast<int>(c)];
    }
  }
}

ViewSamples TexelBaker::bake_view(const V3f& view, std::span<const V3f> lights, int samples,
                                  std::uint64_t seed, NoiseSum& noise) const {
  const std::size_t texels = texels_.x * texels_.y;
  const std::size_t n = lights.size();
  ViewSamples out{std::vector<float>(texels), std::vector<V3f>(texels, V3f(0, 0, 0)),
                  std::vector<V3f>(texels * n, V3f(0, 0, 0))};
  std::vector<NoiseSum> row_noise(texels_.y);
  // The number of texels that fill whole packets.
  const int at_once = static_cast<int>(packet_size) / std::gcd(static_cast<int>(packet_size), samples);
  parallel_for(0, texels_.y, [&](int y) {
    std::vector<Gather> gathers(2 * at_once, Gather(n));
    std::vector<TexelRays> rays;
    NoiseSum& sum = row_noise[y];
    for (int first = 0; first < texels_.x; first += at_once) {
      rays.clear();
      for (int x = first; x < std::min(first + at_once, texels_.x); ++x) {
        Gather* const halves = &gathers[2 * (x - first)];
        halves[0].clear();
        halves[1].clear();
        const auto count = static_cast<std::uint32_t>(samples);
        const auto texel = static_cast<std::uint64_t>(y * texels_.x + x);
        rays.push_back({x, y, count, count / 2, hash64(seed ^ hash64(texel)), halves, halves + 1});
      }
      sample(rays, view, lights);
      for (const TexelRays& r : rays) {
        const std::size_t texel = y * texels_.x + r.x;
        const Gather& early = *r.early;
        const Gather& late = *r.late;
        const int hits = early.hits + late.hits;
        if (hits == 0) continue;
        out.alpha[texel] = static_cast<float>(hits) / static_cast<float>(samples);
        out.normal[texel] = V3f((early.normal + late.normal) / samples);
        // If the means of the halves differ by d, the error of their mean is d/2 for equally large halves.
        const double fraction =
            static_cast<double>(early.rays) * late.rays / (static_cast<double>(samples) * samples);
        for (std::size_t l = 0; l < n; ++l) {
          V3f& radiance = out.radiance[l * texels + texel];
          for (std::size_t c = 0; c < 3; ++c) {
            const double a = early.radiance[c * n + l];
            const double b = late.radiance[c * n + l];
            radiance[static_cast<int>(c)] = static_cast<float>((a + b) / hits);
            const double d = a / std::max(1, early.rays) - b / late.rays;
            sum.squared_error += d * d * fraction;
            sum.squared_signal += (a + b) * (a + b) / (static_cast<double>(samples) * samples);
          }
        }
      }
    }
  });
  for (const NoiseSum& sum : row_noise) noise += sum;
  return out;
}

PairSamples TexelBaker::bake_pair(const DirectionPair& pair, int samples, std::uint64_t seed,
                                  NoiseSum& noise) const {
  NoiseSum within_halves;
  const std::span<const V3f> lights(&pair.light, 1);
  const ViewSamples a = bake_view(pair.view, lights, samples / 2, seed, within_halves);
  const ViewSamples b = bake_view(pair.view, lights, samples / 2, hash64(seed), within_halves);
  PairSamples out{.width = texels_.x, .height = texels_.y, .pairs = {pair}};
  for (std::size_t t = 0; t < a.alpha.size(); ++t) {
    const V3f of_a = a.radiance[t] * a.alpha[t];
    const V3f of_b = b.radiance[t] * b.alpha[t];
    const float alpha = (a.alpha[t] + b.alpha[t]) / 2;
    out.alpha.push_back(alpha);
    out.alpha_noise.push_back((a.alpha[t] - b.alpha[t]) / 2);
    out.noise.push_back((of_a - of_b) / 2);
    out.radiance.push_back(alpha > 0 ? (of_a + of_b) / (2 * alpha) : V3f(0, 0, 0));
    noise.squared_error += static_cast<double>(out.noise[t].length2());
    noise.squared_signal += static_cast<double>((of_a + of_b).length2()) / 4;
  }
  return out;
}

}  // namespace selvedge
