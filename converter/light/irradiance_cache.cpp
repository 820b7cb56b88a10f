#include "converter/light/irradiance_cache.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

#include "converter/light/path_tracer.h"
#include "converter/light/yarn_brdf.h"
#include "format/base/parallel.h"
#include "format/simd/wide.h"

namespace selvedge {
namespace {

/// Directions per point: side x side. More make no visible difference, as the errors of neighbouring points
/// average out.
constexpr int side = 8;

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

constexpr double patches_per_period = 20;
/// Smallest cosine between a vertex's normal and a triangle's for which the vertex may stand for the
/// triangle.
constexpr float smooth = 0.8F;

/// Row j of a lattice has parts + 1 - j points.
int lattice_index(int parts, int i, int j) { return j * (parts + 1) - j * (j - 1) / 2 + i; }

struct Sums {
  std::vector<double> changed, all;  ///< [colour][light]
};

/// Marks the lights that are not yet done and to which a further reflection adds less than a fraction.
/// Without an end, the rest is then taken for a geometric series: by then each colour falls by the same
/// factor from reflection to reflection. `before`: the change by the reflection before, replaced; `rest`:
/// receives the fraction of the change that follows it.
std::vector<char> converged(const std::vector<Sums>& sums, const std::vector<char>& done, bool endless,
                            std::vector<double>& before, std::vector<float>& rest) {
  const double min_change = endless ? 1e-2 : 1e-4;
  constexpr double max_factor = 0.98;
  const std::size_t n = done.size();
  const std::size_t width = 3 * n;
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
  return ends;
}

}  // namespace

std::optional<IrradianceCache> IrradianceCache::build(const RayScene& scene, std::uint64_t seed,
                                                      bool from_below) {
  IrradianceCache t;
  t.triangles_ = scene.mesh().triangles;
  const std::vector<SurfacePoint> points = t.spread_points(scene.mesh());
  if (points.empty()) return std::nullopt;
  t.fronts_ = points.size();
  for (const SurfacePoint& point : points) t.place(scene, point, false);
  if (scene.is_translucent() || shows_backs(scene, from_below))
    for (const SurfacePoint& point : points) t.place(scene, point, true);
  t.order_points(scene);
  t.gather(scene, seed);
  return t;
}

void IrradianceCache::gather(const RayScene& scene, std::uint64_t seed) {
  // Blocks of 4 x 4 neighbouring directions form a packet; each direction is jittered in its cell.
  constexpr float fraction = 1.0F / (side * side);
  std::vector<std::vector<std::pair<int, float>>> rows(points());
  std::atomic<std::uint64_t> rays{0};
  parallel_for(0, points(), [&](int p) {
    SurfacePoint origin;
    origin.position = position_[p];
    origin.face_normal = normal_[p];
    if (origin.face_normal == V3f(0, 0, 0)) return;
    Random random(seed, p);
    std::vector<std::pair<int, float>> entries;
    for (int block = 0; block < side * side / 16; ++block) {
      std::array<V3d, packet_size> directions;
      for (int k = 0; k < 16; ++k) {
        const int x = block % (side / 4) * 4 + k % 4;
        const int y = block / (side / 4) * 4 + k / 4;
        const double dx = random.uniform();
        directions[k] =
            cosine_direction(V3d(origin.face_normal), {(x + dx) / side, (y + random.uniform()) / side});
      }
      PointPacket met;
      for (std::uint32_t remaining = scene.trace(scene.leave(origin), directions, met); remaining != 0;
           remaining &= remaining - 1) {
        CacheTaps sent;
        if (!taps(met[std::countr_zero(remaining)], sent)) continue;
        for (std::size_t k = 0; k < 3; ++k) entries.emplace_back(sent.point[k], sent.weight[k] * fraction);
      }
    }
    rays += side * side;
    std::ranges::sort(entries);
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
    for (std::size_t l = 0; l < n; ++l) {
      std::uint32_t lit = 0;
      for (std::size_t i = 0; i < size; ++i) {
        // Light reaches the inside of closed yarn only through its wall.
        const bool hidden = scene.is_translucent() && indices[i] >= static_cast<int>(fronts_);
        lit |= (!hidden && points[i].face_normal.dot(lights[l]) > 0 ? 1U : 0U) << i;
      }
      rays += static_cast<std::uint64_t>(std::popcount(lit));
      lit &= ~scene.occluded(leaving, lights[l], lit);
      for (; lit != 0; lit &= lit - 1) {
        const int i = std::countr_zero(lit);
        direct[indices[i] * n + l] = points[i].face_normal.dot(lights[l]);
      }
    }
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

  const bool endless = bounces == unlimited_bounces;
  constexpr int max_rounds = 1000;
  constexpr std::size_t block_size = 256;
  const std::size_t blocks = (count + block_size - 1) / block_size;
  std::vector<Sums> sums(blocks);
  std::vector<char> done(n, 0);
  std::vector<double> before(width, 0);  ///< change by the reflection before
  std::vector<float> rest(
      width,
      0.0F);  ///< fraction of the last change that follows it, of lights that have converged
  const int rounds = endless ? max_rounds : bounces;
  for (int round = 0; round < rounds; ++round) {
    parallel_for(0, points(), [&](int p) {
      const std::size_t point = p;
      float* const out = &sent[point * width];
      /// Adds fractions of the light on a point.
      const auto add = [&](std::size_t from, const V3f& fraction) {
        for (std::size_t c = 0; c < 3; ++c) {
          for (std::size_t l = 0; l < n; ++l) {
            out[c * n + l] +=
                fraction[static_cast<int>(c)] * (direct[from * n + l] + total[from * width + c * n + l]);
          }
        }
      };
      std::fill(out, out + width, 0.0F);
      add(point, albedo_[point]);
      if (scene.is_translucent()) add(behind(p), through_[point]);
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
    const std::vector<char> ends = converged(sums, done, endless, before, rest);
    if (endless && std::ranges::find(ends, 1) != ends.end()) {
      parallel_for(0, static_cast<int>(blocks), [&](int block) {
        each_value(block, [&](std::size_t i, std::size_t at) {
          if (ends[i % n] != 0) total[at] += rest[i] * next[at];
        });
      });
    }
    for (std::size_t l = 0; l < n; ++l) done[l] = static_cast<char>(done[l] | ends[l]);
    if (std::ranges::find(done, 0) == done.end()) break;
  }
  return total;
}

std::vector<SurfacePoint> IrradianceCache::spread_points(const CellMesh& mesh) {
  const double longest = std::max(mesh.period.x, mesh.period.y) / patches_per_period;
  patches_.resize(triangles_.size());
  // Vertices first; small triangles need no further points.
  std::vector<SurfacePoint> points(mesh.positions.size());
  for (std::size_t p = 0; p < points.size(); ++p) {
    points[p].position = mesh.positions[p];
    points[p].face_normal = mesh.normals[p];
  }
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      SurfacePoint& point = points[triangles_[t][k]];
      point.triangle = static_cast<int>(t);
      point.u = k == 1 ? 1.0F : 0.0F;
      point.v = k == 2 ? 1.0F : 0.0F;
    }
  }
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const V3i& corner = triangles_[t];
    const V3f& a = mesh.positions[corner.x];
    const V3f& b = mesh.positions[corner.y];
    const V3f& c = mesh.positions[corner.z];
    const double edge = static_cast<double>(std::max({(b - a).length(), (c - b).length(), (a - c).length()}));
    const V3f normal = (b - a).cross(c - a).normalized();
    const int parts = static_cast<int>(std::clamp(std::ceil(edge / longest - 1e-3), 1.0, 1e3));
    bool needs_points = parts > 1;
    // A vertex where yarns touch has the normal of one yarn and triangles of both.
    for (int k = 0; k < 3; ++k) needs_points |= std::abs(normal.dot(mesh.normals[corner[k]])) < smooth;
    if (!needs_points) continue;
    patches_[t] = {static_cast<int>(points.size()), parts};
    for (int j = 0; j <= parts; ++j) {
      for (int i = 0; i + j <= parts; ++i) {
        SurfacePoint point;
        point.triangle = static_cast<int>(t);
        point.u = static_cast<float>(i) / static_cast<float>(parts);
        point.v = static_cast<float>(j) / static_cast<float>(parts);
        point.face_normal = normal;
        // Slightly inwards: a point on the edge may lie in the wall of the next triangle.
        const float inwards = 0.1F / static_cast<float>(parts);
        const float u = point.u * (1 - inwards) + inwards / 3;
        const float v = point.v * (1 - inwards) + inwards / 3;
        point.position = a * (1 - u - v) + b * u + c * v;
        points.push_back(point);
      }
    }
    if (points.size() > max_cache_points) break;
  }
  if (points.size() > max_cache_points) points.clear();
  return points;
}

void IrradianceCache::place(const RayScene& scene, SurfacePoint point, bool back) {
  point.face_normal.normalize();
  point.back = back && scene.is_translucent();
  position_.push_back(point.position);
  normal_.push_back(back ? -point.face_normal : point.face_normal);
  const DiffuseAlbedos fractions = diffuse_albedos(surface_at(scene, point));
  albedo_.push_back(fractions.back);
  through_.push_back(fractions.through);
}

bool IrradianceCache::taps(const SurfacePoint& point, CacheTaps& taps) const {
  if (point.back && !has_backs()) return false;
  const std::size_t t = point.triangle;
  const Patch& patch = patches_[t];
  if (patch.first < 0) {
    taps.point = {triangles_[t].x, triangles_[t].y, triangles_[t].z};
    taps.weight = {1 - point.u - point.v, point.u, point.v};
  } else {
    const int n = patch.parts;
    const float u = std::max(0.0F, point.u) * static_cast<float>(n);
    const float v = std::max(0.0F, point.v) * static_cast<float>(n);
    const int j = std::min(static_cast<int>(v), n - 1);
    const int i = std::min(static_cast<int>(u), n - 1 - j);
    const float fu = std::min(u - static_cast<float>(i), 1.0F);
    const float fv = std::min(v - static_cast<float>(j), 1.0F);
    const bool far = fu + fv > 1 && i + j + 2 <= n;
    const auto index = [&](int x, int y) { return patch.first + lattice_index(n, x, y); };
    if (far) {
      taps.point = {index(i + 1, j + 1), index(i, j + 1), index(i + 1, j)};
      taps.weight = {fu + fv - 1, 1 - fu, 1 - fv};
    } else {
      taps.point = {index(i, j), index(i + 1, j), index(i, j + 1)};
      taps.weight = {std::max(0.0F, 1 - fu - fv), fu, fv};
    }
  }
  if (has_backs()) {
    for (std::size_t k = 0; k < 3; ++k) taps.other_side[k] = behind(taps.point[k]);
    if (point.back) std::swap(taps.point, taps.other_side);
  }
  return true;
}

void IrradianceCache::order_points(const RayScene& scene) {
  // Ten bits of each coordinate, interleaved: neighbours on the curve are neighbours in space.
  const V2d period = scene.period();
  const V3d size(period.x, period.y, std::max(period.x, period.y));
  const auto curve = [&](std::size_t p) {
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double fraction = static_cast<double>(position_[p][axis]) / size[axis];
      const auto cell = static_cast<std::uint64_t>(std::clamp(fraction, 0.0, 1.0) * 1023);
      for (int bit = 0; bit < 10; ++bit) key |= (cell >> bit & 1U) << (3 * bit + axis);
      // Points with similar normals see the same lights.
      key |= (normal_[p][axis] < 0 ? std::uint64_t{1} : 0) << (30 + axis);
    }
    return key;
  };
  std::vector<std::pair<std::uint64_t, int>> keys;
  for (int p = 0; p < points(); ++p) keys.emplace_back(curve(p), p);
  std::ranges::sort(keys);
  for (const auto& [key, point] : keys) order_.push_back(point);
}

}  // namespace selvedge
