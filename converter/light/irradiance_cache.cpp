#include "converter/light/irradiance_cache.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <numbers>

#include "converter/light/path_tracer.h"
#include "converter/light/shown_backs.h"
#include "converter/light/sobol.h"
#include "converter/light/yarn_brdf.h"
#include "format/base/parallel.h"
#include "format/simd/wide.h"

namespace selvedge {
namespace {

/// Directions per point: side x side. More make no visible difference, as the errors of neighbouring points
/// average out.
constexpr int side = 8;
constexpr int max_places = 8;  ///< from which a shared point sends 16 of them

/// target = sum of weight[k] * source[column[k]], vectors of `width` numbers; those that are all 0 are not
/// marked in `marked`. Element by element, so the result does not depend on the width of vector registers.
SELVEDGE_WIDE void sum_rows(const float* source, const char* marked, const int* column, const float* weight,
                            std::size_t count, std::size_t width, float* target) {
  std::fill(target, target + width, 0.0F);
  for (std::size_t k = 0; k < count; ++k) {
    if (marked[column[k]] == 0) continue;
    const float* row = source + column[k] * width;
    const float w = weight[k];
    for (std::size_t i = 0; i < width; ++i) target[i] += w * row[i];
  }
}

}  // namespace

std::optional<IrradianceCache> IrradianceCache::build(const RayScene& scene, std::uint64_t seed,
                                                      bool from_below) {
  IrradianceCache t;
  t.triangles_ = scene.mesh().triangles;
  t.sides_ = scene.is_translucent() || shows_backs(scene, 3, from_below) ? 2 : 1;
  t.place_points(scene);
  if (t.points() > max_cache_points) return std::nullopt;
  t.order_points(scene);
  t.gather(scene, seed);
  return t;
}

void IrradianceCache::gather(const RayScene& scene, std::uint64_t seed) {
  // Blocks of 4 x 4 neighbouring directions form a packet; each direction is jittered in its cell.
  const std::size_t count = points();
  std::vector<std::vector<std::pair<int, float>>> rows(count);
  std::atomic<std::uint64_t> rays{0};
  parallel_for(0, points(), [&](int p) {
    Random random(seed, p);
    std::uint64_t traced = 0;
    std::vector<std::pair<int, float>> entries;
    const auto front_count = static_cast<int>(behind_.size());
    const bool inside = sides_ == 2 && p >= front_count;
    const auto fronts = inside ? fronts_of(p) : std::span<const int>();
    // A block of directions for each of several fronts, or all of them from one place.
    const bool spread = fronts.size() > 1;
    const int blocks = spread ? std::min(max_places, static_cast<int>(fronts.size())) : side * side / 16;
    const int per_row = spread ? 4 : side;
    for (int block = 0; block < blocks; ++block) {
      const std::size_t place = spread ? fronts[block * fronts.size() / blocks] : p;
      SurfacePoint origin;
      origin.position = position_[place];
      origin.face_normal = spread ? -normal_[place] : normal_[place];
      if (origin.face_normal == V3f(0, 0, 0)) continue;
      traced += 16;
      const float share = 1.0F / static_cast<float>(16 * blocks);
      std::array<V3d, packet_size> directions;
      for (int k = 0; k < 16; ++k) {
        const int x = (spread ? 0 : block % (side / 4) * 4) + k % 4;
        const int y = (spread ? 0 : block / (side / 4) * 4) + k / 4;
        const double dx = random.uniform();
        directions[k] =
            cosine_direction(V3d(origin.face_normal), {(x + dx) / per_row, (y + random.uniform()) / per_row});
      }
      PointPacket met;
      for (std::uint32_t remaining = scene.trace(scene.leave(origin), directions, met); remaining != 0;
           remaining &= remaining - 1) {
        CacheTaps sent;
        if (!taps(met[std::countr_zero(remaining)], sent)) continue;
        for (std::size_t k = 0; k < 3; ++k) entries.emplace_back(sent.point[k], sent.weight[k] * share);
      }
    }
    rays += traced;
    std::sort(entries.begin(), entries.end());
    auto& merged = rows[p];
    for (const auto& [point, weight] : entries) {
      if (!merged.empty() && merged.back().first == point) {
        merged.back().second += weight;
      } else {
        merged.emplace_back(point, weight);
      }
    }
    merged.shrink_to_fit();
  });
  rays_ += rays;
  row_start_.assign(1, 0);
  for (const auto& row : rows) {
    for (const auto& [point, weight] : row) {
      column_.push_back(point);
      weight_.push_back(weight);
    }
    row_start_.push_back(column_.size());
  }
}

/// Cosine towards the light, 0 where it is occluded: [point][light].
std::vector<float> IrradianceCache::light_directly(const RayScene& scene, std::span<const V3f> lights) {
  const std::size_t n = lights.size();
  std::vector<float> direct(order_.size() * n, 0.0F);
  std::atomic<std::uint64_t> rays{0};
  const std::size_t packets = (order_.size() + packet_size - 1) / packet_size;
  parallel_for(0, static_cast<int>(packets), [&](int packet) {
    const auto indices = std::span(order_).subspan(packet * packet_size);
    const std::size_t size = std::min(packet_size, indices.size());
    PointPacket points;
    for (std::size_t i = 0; i < size; ++i) {
      points[i].position = position_[indices[i]];
      points[i].face_normal = normal_[indices[i]];
    }
    const LeavingPacket leaving = scene.leave(points, (1U << size) - 1);
    std::uint64_t traced = 0;
    for (std::size_t l = 0; l < n; ++l) {
      std::uint32_t lit = 0;
      for (std::size_t i = 0; i < size; ++i) {
        // Light reaches the inside of closed yarn only through its wall.
        const bool hidden =
            scene.is_translucent() && !scene.is_open() && indices[i] >= static_cast<int>(behind_.size());
        lit |= (!hidden && points[i].face_normal.dot(lights[l]) > 0 ? 1U : 0U) << i;
      }
      traced += static_cast<std::uint64_t>(std::popcount(lit));
      lit &= ~scene.occluded(leaving, lights[l], lit);
      for (; lit != 0; lit &= lit - 1) {
        const int i = std::countr_zero(lit);
        direct[indices[i] * n + l] = points[i].face_normal.dot(lights[l]);
      }
    }
    rays += traced;
  });
  rays_ += rays;
  return direct;
}

std::vector<float> IrradianceCache::solve(const RayScene& scene, std::span<const V3f> lights, int bounces) {
  // As many lights as stay in the processor's caches.
  constexpr std::size_t block_size = 64;
  const std::size_t n = lights.size();
  if (n <= block_size) return solve_block(scene, lights, bounces);
  const std::size_t rows = points() * 3;
  std::vector<float> all(rows * n);
  for (std::size_t first = 0; first < n; first += block_size) {
    const auto block = lights.subspan(first, std::min(block_size, n - first));
    const std::vector<float> part = solve_block(scene, block, bounces);
    for (std::size_t row = 0; row < rows; ++row) {
      std::copy_n(&part[row * block.size()], block.size(), &all[row * n + first]);
    }
  }
  return all;
}

std::vector<float> IrradianceCache::solve_block(const RayScene& scene, std::span<const V3f> lights,
                                                int bounces) {
  const std::size_t n = lights.size();
  const std::size_t width = 3 * n;
  const std::size_t count = points();
  std::vector<float> total(count * width, 0.0F);
  if (bounces == 0) return total;
  const std::vector<float> direct = light_directly(scene, lights);
  std::vector<float> sent(count * width);
  std::vector<char> sends(count);
  std::vector<float> next(count * width);

  // Converged if a further reflection adds less than this share. Without an end, what is left then is taken
  // for a geometric series: by then each colour falls by the same factor from reflection to reflection.
  const bool endless = bounces == unlimited_bounces;
  const double min_change = endless ? 1e-2 : 1e-4;
  constexpr int max_rounds = 1000;
  constexpr double max_factor = 0.98;
  constexpr std::size_t block_size = 256;
  const std::size_t blocks = (count + block_size - 1) / block_size;
  struct Sums {
    std::vector<double> changed, all;  ///< [colour][light]
  };
  std::vector<Sums> sums(blocks);
  std::vector<char> done(n, 0);
  std::vector<double> before(width, 0);  ///< what the reflection before changed
  std::vector<float> rest(width,
                          0.0F);  ///< of the last change: what follows it, of lights that have converged
  const int rounds = endless ? max_rounds : bounces;
  for (int round = 0; round < rounds; ++round) {
    parallel_for(0, points(), [&](int p) {
      const std::size_t point = p;
      float* const out = &sent[point * width];
      /// Adds shares of the light on a point.
      const auto add = [&](std::size_t from, const V3f& share) {
        for (std::size_t c = 0; c < 3; ++c) {
          for (std::size_t l = 0; l < n; ++l) {
            out[c * n + l] +=
                share[static_cast<int>(c)] * (direct[from * n + l] + total[from * width + c * n + l]);
          }
        }
      };
      std::fill(out, out + width, 0.0F);
      add(point, albedo_[point]);
      if (!through_.empty() && point < behind_.size()) {
        add(behind_[point], through_[point]);
      } else if (!through_.empty()) {
        const auto fronts = fronts_of(p);
        for (const int front : fronts) add(front, through_[point] / static_cast<float>(fronts.size()));
      }
      const float largest = *std::max_element(out, out + width);
      sends[point] = largest > 0 ? 1 : 0;
    });
    parallel_for(0, points(), [&](int p) {
      const std::size_t point = p;
      const std::size_t start = row_start_[point];
      sum_rows(sent.data(), sends.data(), column_.data() + start, weight_.data() + start,
               row_start_[point + 1] - start, width, &next[point * width]);
    });
    // Each light converges by itself, so that its result does not depend on the other lights.
    const auto each_value = [&](std::size_t block, const auto& visit) {
      const std::size_t first = block * block_size;
      for (std::size_t point = first; point < std::min(first + block_size, count); ++point) {
        for (std::size_t i = 0; i < width; ++i) {
          if (done[i % n] == 0) visit(i, point * width + i);
        }
      }
    };
    parallel_for(0, static_cast<int>(blocks), [&](int block) {
      Sums& sum = sums[block];
      sum.changed.assign(width, 0);
      sum.all.assign(width, 0);
      each_value(block, [&](std::size_t i, std::size_t at) {
        const float change = next[at] - total[at];
        sum.changed[i] += std::abs(static_cast<double>(change));
        sum.all[i] += static_cast<double>(next[at]);
        total[at] = next[at];
        next[at] = change;
      });
    });
    std::vector<char> ends(n, 0);
    for (std::size_t l = 0; l < n; ++l) {
      if (done[l] != 0) continue;
      double all_changed = 0;
      double all = 0;
      for (std::size_t i = l; i < width; i += n) {
        double changed = 0;
        for (const Sums& sum : sums) {
          changed += sum.changed[i];
          all += sum.all[i];
        }
        const double factor = before[i] > 0 ? std::min(max_factor, changed / before[i]) : 0;
        rest[i] = static_cast<float>(endless ? factor / (1 - factor) : 0);
        before[i] = changed;
        all_changed += changed;
      }
      ends[l] = all_changed <= min_change * all ? 1 : 0;
    }
    if (endless && std::find(ends.begin(), ends.end(), 1) != ends.end()) {
      parallel_for(0, static_cast<int>(blocks), [&](int block) {
        each_value(block, [&](std::size_t i, std::size_t at) {
          if (ends[i % n] != 0) total[at] += rest[i] * next[at];
        });
      });
    }
    for (std::size_t l = 0; l < n; ++l) done[l] = static_cast<char>(done[l] | ends[l]);
    if (std::find(done.begin(), done.end(), 0) == done.end()) break;
  }
  return total;
}

}  // namespace selvedge
