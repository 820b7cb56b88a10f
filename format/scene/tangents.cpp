#include "format/scene/tangents.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

namespace selvedge {
namespace {

constexpr std::uint32_t none = ~std::uint32_t{0};

/// A triangle, as in MikkTSpace.
struct Face {
  std::array<std::uint32_t, 3> vertex{};                  ///< after join_vertices()
  std::array<std::uint32_t, 3> across{none, none, none};  ///< the face beyond the edge from corner k to k + 1
  std::array<std::uint32_t, 3> group{none, none, none};
  V3d du{0, 0, 0};  ///< unit; zero without UV area
  int sign = 0;     ///< -1 for a mirrored texture, else +1; without UV area, the first group's
  bool has_uv_area = false;
  bool has_size = true;  ///< no two corners at the same place
  /// Squares of changes of place along u and v, and the texture's area for an area of 1.
  std::array<double, 2> stretch{0, 0};
  double density = 0;
  double size = 0;  ///< twice the area
};

/// Change of place for a change of texture coordinates, as a multiple of the usual one, from which on
/// textures show nothing.
constexpr double max_stretch = 32;
constexpr double min_stretch = 1e-3;

struct Group {
  std::uint32_t vertex = 0;
  int sign = 0;
  V3d sum{0, 0, 0};
};

/// `direction` without its part along the unit vector `normal`, unit or zero.
V3d flattened(const V3d& direction, const V3d& normal) {
  const V3d flat = direction - normal * direction.dot(normal);
  const double length = flat.length();
  return std::isfinite(length) && length > 0 ? flat / length : V3d(0, 0, 0);
}

class TangentBuilder {
 public:
  TangentBuilder(std::span<const V3d> positions, std::span<const V3d> normals,
                 std::span<const V2d> tex_coords, std::span<const std::uint32_t> indices, Facing facing)
      : positions_(positions), normals_(normals), tex_coords_(tex_coords), indices_(indices) {
    join_vertices();
    faces_.resize(indices.size() / 3);
    for (std::size_t f = 0; f < faces_.size(); ++f) faces_[f] = face_of(f, facing);
    if (facing == Facing::normals) drop_streaks();
    connect();
    for (std::uint32_t f = 0; f < faces_.size(); ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Face& face = faces_[f];
        if (face.has_size && face.has_uv_area && face.group[k] == none) grow_group(f, k);
      }
    }
    sum_directions();
  }

  Tangents tangents() const {
    Tangents result;
    result.indices.assign(indices_.begin(), indices_.end());
    for (const Face& face : faces_) result.degenerate_uvs.push_back(face.has_uv_area ? 0 : 1);
    std::vector<std::uint32_t> first(positions_.size(), none);  // group of the vertex itself
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> copies;
    std::vector<std::uint32_t> group_of(positions_.size(), none);
    for (std::size_t c = 0; c < indices_.size() / 3 * 3; ++c) {
      const std::uint32_t group = faces_[c / 3].group[c % 3];
      const std::uint32_t vertex = indices_[c];
      if (group == none) continue;
      if (first[vertex] == none) first[vertex] = group;
      if (first[vertex] == group) continue;
      const auto next = static_cast<std::uint32_t>(positions_.size() + result.copy_sources.size());
      const auto [entry, is_new] = copies.try_emplace({vertex, group}, next);
      if (is_new) {
        result.copy_sources.push_back(vertex);
        group_of.push_back(group);
      }
      result.indices[c] = entry->second;
    }
    std::ranges::copy(first, group_of.begin());
    // A vertex that only faces without size use takes the group of another vertex at the same place.
    std::vector<std::uint32_t> joined_group(positions_.size(), none);
    for (const Face& face : faces_) {
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint32_t& group = joined_group[face.vertex[k]];
        if (group == none) group = face.group[k];
      }
    }
    for (std::size_t v = 0; v < positions_.size(); ++v)
      if (group_of[v] == none) group_of[v] = joined_group[joined_[v]];
    for (const std::uint32_t group : group_of) {
      const V3d t = group == none ? V3d(0, 0, 0) : groups_[group].sum;
      const double sign = group == none ? 1 : groups_[group].sign;
      // If faces cancel each other, only rounding errors are left: then there is no direction.
      const double length = t.length();
      const V3f unit = length > 1e-9 ? V3f(t / length) : V3f(0, 0, 0);
      result.tangents.emplace_back(unit.x, unit.y, unit.z, static_cast<float>(sign));
    }
    return result;
  }

 private:
  void join_vertices() {
    const auto key = [&](std::uint32_t v) {
      const V3d& p = positions_[v];
      const V3d& n = normals_[v];
      const V2d& t = tex_coords_[v];
      return std::tuple(p.x, p.y, p.z, n.x, n.y, n.z, t.x, t.y);
    };
    std::vector<std::uint32_t> order(positions_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::sort(
        order, [&](std::uint32_t a, std::uint32_t b) { return std::pair(key(a), a) < std::pair(key(b), b); });
    joined_.resize(positions_.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
      joined_[order[i]] = same ? joined_[order[i - 1]] : order[i];
    }
  }

  Face face_of(std::size_t f, Facing facing) const {
    Face face;
    std::array<V3d, 3> p;
    std::array<V2d, 3> uv;
    V3d normal(0, 0, 0);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = indices_[3 * f + k];
      face.vertex[k] = joined_[vertex];
      p[k] = positions_[vertex];
      uv[k] = tex_coords_[vertex];
      normal += normals_[vertex];
    }
    face.has_size = p[0] != p[1] && p[1] != p[2] && p[2] != p[0];
    const V3d e1 = p[1] - p[0];
    const V3d e2 = p[2] - p[0];
    const V2d d1 = uv[1] - uv[0];
    const V2d d2 = uv[2] - uv[0];
    const double area = d1.x * d2.y - d1.y * d2.x;
    if (area == 0 || !std::isfinite(area)) return face;
    // dP/du x dP/dv has the sign of the area times the face normal, and v falls where the picture rises.
    face.sign = area > 0 ? -1 : 1;
    if (facing == Facing::normals && e1.cross(e2).dot(normal) < 0) face.sign = -face.sign;
    const V3d du = (e1 * d2.y - e2 * d1.y) * (area > 0 ? 1.0 : -1.0);
    const V3d dv = e2 * d1.x - e1 * d2.x;
    const double length = du.length();
    if (!std::isfinite(length) || length == 0 || dv.length() == 0) return face;
    face.du = du / length;
    face.has_uv_area = true;
    face.size = e1.cross(e2).length();
    face.density = std::abs(area) / face.size;
    face.stretch = {du.length2() / (area * area), dv.length2() / (area * area)};
    return face;
  }

  /// Takes UV area from faces whose texture is stretched or squeezed far more than the median of the surface.
  void drop_streaks() {
    std::vector<std::pair<double, double>> densities;  // and sizes
    double whole = 0;
    for (const Face& face : faces_) {
      if (!face.has_uv_area || !(face.size > 0) || !std::isfinite(face.density)) continue;
      densities.emplace_back(face.density, face.size);
      whole += face.size;
    }
    std::ranges::sort(densities);
    double usual = 0;
    double sum = 0;
    for (const auto& [density, size] : densities) {
      usual = density;
      if ((sum += size) >= whole / 2) break;
    }
    for (Face& face : faces_) {
      const auto [low, high] = std::minmax({face.stretch[0] * usual, face.stretch[1] * usual});
      if (face.size > 0 && low >= min_stretch * min_stretch && high <= max_stretch * max_stretch) continue;
      face.has_uv_area = false;
      face.sign = 0;
      face.du = V3d(0, 0, 0);
    }
  }

  /// Two faces are neighbours if they have an edge in opposite directions.
  void connect() {
    struct Edge {
      std::uint32_t low, high, face, corner;
    };
    std::vector<Edge> edges;
    edges.reserve(faces_.size() * 3);
    for (std::uint32_t f = 0; f < faces_.size(); ++f) {
      if (!faces_[f].has_size) continue;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax(faces_[f].vertex[k], faces_[f].vertex[(k + 1) % 3]);
        edges.push_back({low, high, f, k});
      }
    }
    std::ranges::sort(edges, [](const Edge& a, const Edge& b) {
      return std::tie(a.low, a.high, a.face, a.corner) < std::tie(b.low, b.high, b.face, b.corner);
    });
    const auto starts_low = [&](const Edge& e) { return faces_[e.face].vertex[e.corner] == e.low; };
    for (std::size_t i = 0, end = 0; i < edges.size(); i = end) {
      while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high) ++end;
      std::size_t up = i;
      std::size_t down = i;
      // Pairs the first edge of one direction with the first of the other, the second with the second.
      while (true) {
        while (up < end && !starts_low(edges[up])) ++up;
        while (down < end && starts_low(edges[down])) ++down;
        if (up == end || down == end) break;
        faces_[edges[up].face].across[edges[up].corner] = edges[down].face;
        faces_[edges[down].face].across[edges[down].corner] = edges[up].face;
        ++up;
        ++down;
      }
    }
  }

  /// Starts a group at a corner, and adds the faces around its vertex that edges connect.
  void grow_group(std::uint32_t first_face, std::size_t first_corner) {
    const auto id = static_cast<std::uint32_t>(groups_.size());
    const std::uint32_t vertex = faces_[first_face].vertex[first_corner];
    const int sign = faces_[first_face].sign;
    groups_.push_back({vertex, sign, V3d(0, 0, 0)});
    std::vector<std::uint32_t> open{first_face};
    while (!open.empty()) {
      Face& face = faces_[open.back()];
      open.pop_back();
      const auto at = std::ranges::find(face.vertex, vertex);
      if (at == face.vertex.end()) continue;
      const auto k = at - face.vertex.begin();
      if (face.group[k] != none) continue;
      // A face without UV area takes the orientation of the first group that reaches it (as MikkTSpace).
      if (!face.has_uv_area && face.group == std::array{none, none, none}) face.sign = sign;
      if (face.sign != sign) continue;
      face.group[k] = id;
      for (const std::uint32_t next : {face.across[(k + 2) % 3], face.across[k]})
        if (next != none) open.push_back(next);
    }
  }

  void sum_directions() {
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      const Face& face = faces_[f];
      if (!face.has_uv_area) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        if (face.group[k] == none) continue;
        const std::uint32_t* corner = &indices_[3 * f];
        const V3d& n = normals_[corner[k]];
        const V3d& p = positions_[corner[k]];
        const V3d a = flattened(positions_[corner[(k + 1) % 3]] - p, n);
        const V3d b = flattened(positions_[corner[(k + 2) % 3]] - p, n);
        const double angle = std::acos(std::clamp(a.dot(b), -1.0, 1.0));
        groups_[face.group[k]].sum += flattened(face.du, n) * angle;
      }
    }
  }

  std::span<const V3d> positions_;
  std::span<const V3d> normals_;
  std::span<const V2d> tex_coords_;
  std::span<const std::uint32_t> indices_;
  std::vector<std::uint32_t> joined_;
  std::vector<Face> faces_;
  std::vector<Group> groups_;
};

}  // namespace

Tangents compute_tangents(std::span<const V3d> positions, std::span<const V3d> normals,
                          std::span<const V2d> tex_coords, std::span<const std::uint32_t> indices,
                          Facing facing) {
  return TangentBuilder(positions, normals, tex_coords, indices, facing).tangents();
}

}  // namespace selvedge
