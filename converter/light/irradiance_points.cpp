// The points of an irradiance cache, and those around a place of the surface.
#include <algorithm>
#include <cmath>
#include <map>

#include "converter/light/irradiance_cache.h"
#include "converter/light/yarn_brdf.h"

namespace selvedge {
namespace {

constexpr double patches_per_period = 20;
/// Smallest cosine between a vertex's normal and a triangle's for which the vertex may stand for the
/// triangle.
constexpr float smooth = 0.8F;
/// About as many points of closed yarn share one on its inside.
constexpr double points_inside = 16;

std::size_t lattice_size(int parts) { return (parts + 1) * (parts + 2) / 2; }

/// Row j of a lattice has parts + 1 - j points.
int lattice_index(int parts, int i, int j) { return j * (parts + 1) - j * (j - 1) / 2 + i; }

}  // namespace

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
  std::map<std::array<int, 4>, std::vector<int>> backs;
  const auto place = [&](std::size_t p, bool back) {
    position_.push_back(positions[p]);
    normal_.push_back(back ? -normals[p].normalized() : normals[p].normalized());
    points[p].face_normal = normals[p].normalized();
    points[p].back = back && scene.is_translucent();
    add_shares(scene, points[p]);
  };
  for (std::size_t p = 0; p < positions.size(); ++p) place(p, false);
  if (sides_ == 1) return;
  // Neighbours that share a back lie in one cell of a lattice and face the same way, as those of one wall do:
  // what touches it faces it.
  const bool shared = scene.is_translucent() && !scene.is_open();
  double area = 0;
  for (const V3i& t : triangles_) {
    const V3f& a = mesh.positions[t.x];
    area += static_cast<double>((mesh.positions[t.y] - a).cross(mesh.positions[t.z] - a).length()) / 2;
  }
  const double cell = std::sqrt(points_inside * area / static_cast<double>(positions.size()));
  for (std::size_t p = 0; p < positions.size(); ++p) {
    std::array<int, 4> key{static_cast<int>(p), 0, 0, 0};
    if (shared) {
      const V3f& n = normal_[p];
      const V3f facing(std::abs(n.x), std::abs(n.y), std::abs(n.z));
      const int axis = facing.x >= std::max(facing.y, facing.z) ? 0 : facing.y >= facing.z ? 1 : 2;
      for (int k = 0; k < 3; ++k)
        key[k] = static_cast<int>(std::floor(static_cast<double>(positions[p][k]) / cell));
      key[3] = 2 * axis + (n[axis] < 0 ? 1 : 0);
    }
    backs[key].push_back(static_cast<int>(p));
  }
  behind_.resize(positions.size());
  for (const auto& [key, fronts] : backs) {
    for (const int front : fronts) behind_[front] = static_cast<int>(position_.size());
    fronts_.insert(fronts_.end(), fronts.begin(), fronts.end());
    first_front_.push_back(static_cast<int>(fronts_.size() - fronts.size()));
    place(fronts[fronts.size() / 2], true);
  }
  first_front_.push_back(static_cast<int>(fronts_.size()));
}

void IrradianceCache::add_shares(const RayScene& scene, const SurfacePoint& point) {
  const YarnSurface surface = surface_at(scene, point);
  if (scene.is_translucent()) {
    const DiffuseShares shares = diffuse_shares(surface);
    albedo_.push_back(shares.back);
    through_.push_back(shares.through);
    return;
  }
  const auto w = static_cast<double>(surface.gloss.weight);
  const double reflected = w > 0 ? w * mean_gloss_albedo(surface.gloss.roughness) : 0;
  albedo_.emplace_back(surface.albedo * (1 - w) + V3d(reflected));
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

}  // namespace selvedge
