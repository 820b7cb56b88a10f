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
constexpr double patches_per_period = 20;
/// Smallest cosine between a vertex's normal and a triangle's for which the vertex may stand for the
/// triangle.
constexpr float smooth = 0.8F;

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

std::size_t lattice_size(int parts) { return (parts + 1) * (parts + 2) / 2; }

/// Row j of a lattice has parts + 1 - j points.
int lattice_index(int parts, int i, int j) { return j * (parts + 1) - j * (j - 1) / 2 + i; }

}  // namespace

std::vector<float> light_column(const std::vector<float>& irradiance, std::size_t lights, std::size_t light) {
  std::vector<float> column(lights > 0 ? irradiance.size() / lights : 0);
  for (std::size_t i = 0; i < column.size(); ++i) column[i] = irradiance[i * lights + light];
  return column;
}

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

void IrradianceCache::place_points(const RayScene& scene) {
  const CellMesh& mesh = scene.mesh();
  const double longest = std::max(mesh.period.x, mesh.period.y) / patches_per_period;
  std::vector<SurfacePoint> points;  // points at which albedo and gloss are taken
  std::vector<V3f> normals;
  std::vector<V3f> positions;
  const auto corner_of = [&](std::size_t t, int k) { return triangles_[t][k]; };

  patches_.resize(triangles_.size());
  // Vertices first; small triangles need no further points.
  points.resize(mesh.positions.size());
  normals = mesh.normals;
  positions = mesh.positions;
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      SurfacePoint& point = points[corner_of(t, k)];
      point.triangle = static_cast<int>(t);
      point.u = k == 1 ? 1.0F : 0.0F;
      point.v = k == 2 ? 1.0F : 0.0F;
    }
  }
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const V3f& a = mesh.positions[corner_of(t, 0)];
    const V3f& b = mesh.positions[corner_of(t, 1)];
    const V3f& c = mesh.positions[corner_of(t, 2)];
    const double edge = static_cast<double>(std::max({(b - a).length(), (c - b).length(), (a - c).length()}));
    const V3f normal = (b - a).cross(c - a).normalized();
    const int parts = static_cast<int>(std::clamp(std::ceil(edge / longest - 1e-3), 1.0, 1e3));
    bool needs_points = parts > 1;
    // A vertex where yarns touch has the normal of one yarn and triangles of both.
    for (int k = 0; k < 3; ++k) needs_points |= std::abs(normal.dot(mesh.normals[corner_of(t, k)])) < smooth;
    if (!needs_points) continue;
    patches_[t] = {static_cast<int>(positions.size()), parts};
    if (positions.size() + lattice_size(parts) > max_cache_points) {
      position_.resize(max_cache_points + 1);  // too many
      return;
    }
    for (int j = 0; j <= parts; ++j) {
      for (int i = 0; i + j <= parts; ++i) {
        SurfacePoint point;
        point.triangle = static_cast<int>(t);
        point.u = static_cast<float>(i) / static_cast<float>(parts);
        point.v = static_cast<float>(j) / static_cast<float>(parts);
        point.face_normal = normal;
        points.push_back(point);
        normals.push_back(normal);
        // Slightly inwards: a point on the edge may lie in the wall of the next triangle.
        const float inwards = 0.1F / static_cast<float>(parts);
        const float u = point.u * (1 - inwards) + inwards / 3;
        const float v = point.v * (1 - inwards) + inwards / 3;
        positions.push_back(a * (1 - u - v) + b * u + c * v);
      }
    }
  }
  for (std::size_t p = 0; p < positions.size(); ++p) {
    for (int face = 0; face < sides_; ++face) {
      position_.push_back(positions[p]);
      const V3f outward = normals[p].normalized();
      normal_.push_back(face == 0 ? outward : -outward);
      points[p].face_normal = outward;
      points[p].back = face == 1 && scene.is_translucent();
      const YarnSurface surface = surface_at(scene, points[p]);
      const auto w = static_cast<double>(surface.gloss.weight);
      const double reflected = w > 0 ? w * mean_gloss_albedo(surface.gloss.roughness) : 0;
      if (scene.is_translucent()) {
        const DiffuseShares shares = diffuse_shares(surface);
        albedo_.push_back(shares.back);
        through_.push_back(shares.through);
      } else {
        albedo_.emplace_back(surface.albedo * (1 - w) + V3d(reflected));
      }
    }
  }
}

bool IrradianceCache::taps(const SurfacePoint& point, CacheTaps& taps) const {
  if (point.back && sides_ == 1) return false;
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
  if (sides_ == 2) {
    for (int& p : taps.point) p = 2 * p + (point.back ? 1 : 0);
  }
  return true;
}

void IrradianceCache::gather(const RayScene& scene, std::uint64_t seed) {
  // Blocks of 4 x 4 neighbouring directions form a packet; each direction is jittered in its cell.
  const std::size_t count = points();
  std::vector<std::vector<std::pair<int, float>>> rows(count);
  parallel_for(0, points(), [&](int p) {
    const std::size_t row = p;
    SurfacePoint origin;
    origin.position = position_[row];
    origin.face_normal = normal_[row];
    if (origin.face_normal == V3f(0, 0, 0)) return;
    Random random(seed, row);
    std::vector<std::pair<int, float>> entries;
    const float share = 1.0F / static_cast<float>(side * side);
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
        for (std::size_t k = 0; k < 3; ++k) entries.emplace_back(sent.point[k], sent.weight[k] * share);
      }
    }
    std::sort(entries.begin(), entries.end());
    auto& merged = rows[row];
    for (const auto& [point, weight] : entries) {
      if (!merged.empty() && merged.back().first == point) {
        merged.back().second += weight;
      } else {
        merged.emplace_back(point, weight);
      }
    }
    merged.shrink_to_fit();
  });
  rays_ += count * side * side;
  row_start_.assign(1, 0);
  for (const auto& row : rows) {
    for (const auto& [point, weight] : row) {
      column_.push_back(point);
      weight_.push_back(weight);
    }
    row_start_.push_back(column_.size());
  }
}

void IrradianceCache::order_points(const RayScene& scene) {
  // Ten bits of each coordinate, interleaved: neighbours on the curve are neighbours in space.
  const V2d period = scene.period();
  const V3d size(period.x, period.y, std::max(period.x, period.y));
  const auto curve = [&](std::size_t p) {
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double share = static_cast<double>(position_[p][axis]) / size[axis];
      const auto cell = static_cast<std::uint64_t>(std::clamp(share, 0.0, 1.0) * 1023);
      for (int bit = 0; bit < 10; ++bit) key |= (cell >> bit & 1U) << (3 * bit + axis);
      // Points with similar normals see the same lights.
      key |= (normal_[p][axis] < 0 ? std::uint64_t{1} : 0) << (30 + axis);
    }
    return key;
  };
  std::vector<std::pair<std::uint64_t, int>> keys;
  for (int p = 0; p < points(); ++p) keys.emplace_back(curve(p), p);
  std::sort(keys.begin(), keys.end());
  for (const auto& [key, point] : keys) order_.push_back(point);
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
        const bool hidden = scene.is_translucent() && !scene.is_open() && indices[i] % 2 == 1;
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

  // Converged if a further reflection adds less than this share.
  constexpr double min_change = 1e-4;
  constexpr int max_rounds = 1000;
  constexpr std::size_t block_size = 256;
  const std::size_t blocks = (count + block_size - 1) / block_size;
  struct Sums {
    std::vector<double> changed, all;
  };
  std::vector<Sums> sums(blocks);
  std::vector<char> done(n, 0);
  const int rounds = bounces == unlimited_bounces ? max_rounds : bounces;
  for (int round = 0; round < rounds; ++round) {
    parallel_for(0, points(), [&](int p) {
      const std::size_t point = p;
      float largest = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t l = 0; l < n; ++l) {
          const std::size_t i = point * width + c * n + l;
          sent[i] = albedo_[point][static_cast<int>(c)] * (direct[point * n + l] + total[i]);
          if (!through_.empty()) {
            const std::size_t other = other_side_of(p);
            sent[i] += through_[point][static_cast<int>(c)] *
                       (direct[other * n + l] + total[other * width + c * n + l]);
          }
          largest = std::max(largest, sent[i]);
        }
      }
      sends[point] = largest > 0 ? 1 : 0;
    });
    parallel_for(0, points(), [&](int p) {
      const std::size_t point = p;
      const std::size_t start = row_start_[point];
      sum_rows(sent.data(), sends.data(), column_.data() + start, weight_.data() + start,
               row_start_[point + 1] - start, width, &next[point * width]);
    });
    // Each light converges by itself, so that its result does not depend on the other lights.
    parallel_for(0, static_cast<int>(blocks), [&](int block) {
      Sums& sum = sums[block];
      sum.changed.assign(n, 0);
      sum.all.assign(n, 0);
      const std::size_t first = block * block_size;
      for (std::size_t row = 3 * first; row < 3 * std::min(first + block_size, count); ++row) {
        for (std::size_t l = 0; l < n; ++l) {
          if (done[l] != 0) continue;
          const float value = next[row * n + l];
          sum.changed[l] += std::abs(static_cast<double>(value) - static_cast<double>(total[row * n + l]));
          sum.all[l] += static_cast<double>(value);
          total[row * n + l] = value;
        }
      }
    });
    for (std::size_t l = 0; l < n; ++l) {
      double changed = 0;
      double all = 0;
      for (const Sums& sum : sums) {
        changed += sum.changed[l];
        all += sum.all[l];
      }
      if (done[l] == 0) done[l] = changed <= min_change * all ? 1 : 0;
    }
    if (std::find(done.begin(), done.end(), 0) == done.end()) break;
  }
  return total;
}

}  // namespace selvedge
