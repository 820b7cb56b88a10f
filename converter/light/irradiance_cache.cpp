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
constexpr int max_places = 8;             ///< from which a shared point sends 16 of them
constexpr std::size_t shared_places = 4;  ///< of a shared front: as many as blocks of 16 directions

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
/// About as many points of closed yarn share one on its inside; of points that are shared themselves, fewer.
constexpr double points_inside = 16;
constexpr double shared_points_inside = 4;

/// Row j of a lattice has parts + 1 - j points.
int lattice_index(int parts, int i, int j) { return j * (parts + 1) - j * (j - 1) / 2 + i; }

/// Points in groups, one after the other.
struct Groups {
  std::vector<int> members;
  std::vector<int> first{};  ///< of each group, and the end
  std::size_t count() const { return first.size() - 1; }
  std::span<const int> group(std::size_t g) const {
    return std::span(members).subspan(first[g], first[g + 1] - first[g]);
  }
};

/// A group lies in one cell of a lattice and faces the same way, as points of one wall do: a wall that
/// touches it faces it. `cell`: mm; 0: each point by itself.
Groups groups_of(std::span<const SurfacePoint> points, double cell) {
  std::vector<std::pair<std::array<int, 4>, int>> keys;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const int index = static_cast<int>(p);
    keys.push_back({{index, 0, 0, 0}, index});
    if (cell == 0) continue;
    auto& key = keys.back().first;
    const V3f& n = points[p].face_normal;
    const V3f facing(std::abs(n.x), std::abs(n.y), std::abs(n.z));
    const int axis = facing.x >= std::max(facing.y, facing.z) ? 0 : facing.y >= facing.z ? 1 : 2;
    for (int k = 0; k < 3; ++k)
      key[k] = static_cast<int>(std::floor(static_cast<double>(points[p].position[k]) / cell));
    key[3] = 2 * axis + (n[axis] < 0 ? 1 : 0);
  }
  std::ranges::sort(keys);
  Groups groups;
  for (const auto& [key, point] : keys) {
    if (groups.members.empty() || key != keys[groups.members.size() - 1].first)
      groups.first.push_back(static_cast<int>(groups.members.size()));
    groups.members.push_back(point);
  }
  groups.first.push_back(static_cast<int>(groups.members.size()));
  return groups;
}

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
                                                      bool from_below, std::size_t max_points) {
  IrradianceCache t;
  t.triangles_ = scene.mesh().triangles;
  t.sides_ = scene.is_translucent() || shows_backs(scene, 3, from_below) ? 2 : 1;
  if (!t.place_points(scene, max_points)) return std::nullopt;
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
      const std::size_t at = place * places_ + block % places_;
      SurfacePoint origin;
      origin.position = position_[at];
      origin.face_normal = spread ? -normal_[at] : normal_[at];
      if (origin.face_normal == V3f(0, 0, 0)) continue;
      traced += 16;
      const float fraction = 1.0F / static_cast<float>(16 * blocks);
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
        for (std::size_t k = 0; k < 3; ++k) entries.emplace_back(sent.point[k], sent.weight[k] * fraction);
      }
    }
    rays += traced;
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
    std::uint64_t traced = 0;
    for (std::size_t place = 0; place < places_; ++place) {
      PointPacket points;
      for (std::size_t i = 0; i < size; ++i) {
        points[i].position = position_[indices[i] * places_ + place];
        points[i].face_normal = normal_[indices[i] * places_ + place];
      }
      const LeavingPacket leaving = scene.leave(points, (1U << size) - 1);
      for (std::size_t l = place; l < n; l += places_) {
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

std::optional<double> IrradianceCache::spread_points(const CellMesh& mesh, std::vector<SurfacePoint>& points,
                                                     std::vector<double>& areas) {
  const double longest = std::max(mesh.period.x, mesh.period.y) / patches_per_period;
  patches_.resize(triangles_.size());
  // Vertices first; small triangles need no further points.
  points.resize(mesh.positions.size());
  areas.resize(points.size());
  double whole_area = 0;
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
    const double area = static_cast<double>((b - a).cross(c - a).length()) / 2;
    const V3f normal = (b - a).cross(c - a).normalized();
    whole_area += area;
    const int parts = static_cast<int>(std::clamp(std::ceil(edge / longest - 1e-3), 1.0, 1e3));
    bool needs_points = parts > 1;
    // A vertex where yarns touch has the normal of one yarn and triangles of both.
    for (int k = 0; k < 3; ++k) needs_points |= std::abs(normal.dot(mesh.normals[corner[k]])) < smooth;
    if (!needs_points) {
      for (int k = 0; k < 3; ++k) areas[corner[k]] += area / 3;
      continue;
    }
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
    areas.resize(points.size(), 2 * area / ((parts + 1) * (parts + 2)));
    if (points.size() > max_shared_points) return std::nullopt;
  }
  return whole_area;
}

bool IrradianceCache::place_points(const RayScene& scene, std::size_t max_points) {
  std::vector<SurfacePoint> points;
  std::vector<double> areas;
  const std::optional<double> whole_area = spread_points(scene.mesh(), points, areas);
  if (!whole_area) return false;
  Groups groups = groups_of(points, 0);
  for (double fraction = 1; groups.count() > max_points; fraction *= 1.3)
    groups = groups_of(points, std::sqrt(fraction * *whole_area / static_cast<double>(max_points)));
  if (groups.count() < points.size()) {
    places_ = shared_places;
    shared_.resize(points.size());
  }
  std::vector<SurfacePoint> fronts;  // [point][place]
  for (std::size_t g = 0; g < groups.count(); ++g) {
    const auto group = groups.group(g);
    double area = 0;
    for (const int p : group) area += areas[p];
    double passed = areas[group[0]];
    std::size_t member = 0;
    for (std::size_t k = 0; k < places_; ++k) {
      const double at = area * (static_cast<double>(k) + 0.5) / static_cast<double>(places_);
      while (passed < at && member + 1 < group.size()) passed += areas[group[++member]];
      fronts.push_back(points[group[member]]);
    }
    if (!shared_.empty())
      for (const int p : group) shared_[p] = static_cast<int>(g);
    place(scene, std::span(fronts).last(places_), false);
  }
  if (sides_ == 1) return true;
  // A point inside has the places of one of its fronts.
  const std::size_t count = groups.count();
  std::vector<SurfacePoint> firsts;
  for (std::size_t p = 0; p < count; ++p) firsts.push_back(fronts[p * places_]);
  const bool even = scene.is_translucent() && !scene.is_open();
  const double inside = shared_.empty() ? points_inside : shared_points_inside;
  groups = groups_of(firsts, even ? std::sqrt(inside * *whole_area / static_cast<double>(count)) : 0);
  behind_.resize(count);
  for (std::size_t g = 0; g < groups.count(); ++g) {
    const auto group = groups.group(g);
    for (const int front : group) behind_[front] = static_cast<int>(count + g);
    place(scene, std::span(fronts).subspan(group[group.size() / 2] * places_, places_), true);
  }
  fronts_ = groups.members;
  first_front_ = groups.first;
  return true;
}

void IrradianceCache::place(const RayScene& scene, std::span<const SurfacePoint> places, bool back) {
  V3f albedo(0, 0, 0);
  V3f through(0, 0, 0);
  for (SurfacePoint point : places) {
    point.face_normal.normalize();
    point.back = back && scene.is_translucent();
    position_.push_back(point.position);
    normal_.push_back(back ? -point.face_normal : point.face_normal);
    const YarnBrdf surface = surface_at(scene, point);
    if (scene.is_translucent()) {
      const DiffuseAlbedos fractions = diffuse_albedos(surface);
      albedo += fractions.back;
      through += fractions.through;
      continue;
    }
    const auto w = static_cast<double>(surface.gloss.weight);
    const double reflected = w > 0 ? w * mean_gloss_albedo(static_cast<double>(surface.gloss.roughness)) : 0;
    albedo += V3f(surface.albedo * (1 - w) + V3d(reflected));
  }
  albedo_.push_back(albedo / static_cast<float>(places.size()));
  if (scene.is_translucent()) through_.push_back(through / static_cast<float>(places.size()));
}

std::span<const int> IrradianceCache::fronts_of(int back) const {
  const std::size_t b = back - behind_.size();
  return std::span(fronts_).subspan(first_front_[b], first_front_[b + 1] - first_front_[b]);
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
  if (!shared_.empty())
    for (int& p : taps.point) p = shared_[p];
  if (sides_ == 2) {
    for (std::size_t k = 0; k < 3; ++k) taps.other_side[k] = behind_[taps.point[k]];
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
      const double fraction = static_cast<double>(position_[p * places_][axis]) / size[axis];
      const auto cell = static_cast<std::uint64_t>(std::clamp(fraction, 0.0, 1.0) * 1023);
      for (int bit = 0; bit < 10; ++bit) key |= (cell >> bit & 1U) << (3 * bit + axis);
      // Points with similar normals see the same lights.
      key |= (normal_[p * places_][axis] < 0 ? std::uint64_t{1} : 0) << (30 + axis);
    }
    return key;
  };
  std::vector<std::pair<std::uint64_t, int>> keys;
  for (int p = 0; p < points(); ++p) keys.emplace_back(curve(p), p);
  std::ranges::sort(keys);
  for (const auto& [key, point] : keys) order_.push_back(point);
}

}  // namespace selvedge
