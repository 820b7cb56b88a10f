#include "viewer/scene/mesh.h"

#include <cmath>

#include "format/base/parallel.h"

namespace selvedge {
namespace {

constexpr std::size_t chunk_size = 4096;

/// Pixels by which a rasteriser may round a corner.
constexpr float rounding = 1.0F / 64;

/// The first and last pixel whose centres may lie between the corners of a triangle before the viewer, along
/// an axis of the frame; the first is beyond the last where it reaches no centre.
V2i pixels_between(const std::array<Group, 3>& corners, std::size_t axis, int size) {
  const auto projected = [&](std::size_t k) { return corners[k][axis] / corners[k][2]; };
  const auto [low, high] = std::minmax({projected(0), projected(1), projected(2)});
  const float length = static_cast<float>(size);
  const float first = std::ceil(low + 0.5F * length - 0.5F - rounding);
  const float last = std::floor(high + 0.5F * length - 0.5F + rounding);
  return {static_cast<int>(std::clamp(first, 0.0F, length)),
          static_cast<int>(std::clamp(last, -1.0F, length - 1))};
}

}  // namespace

MergedSurfaces merge(std::span<const Surface> surfaces) {
  MergedSurfaces mesh;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Surface& surface = surfaces[i];
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    for (const SurfaceVertex& v : surface.vertices) {
      mesh.positions.push_back(v.position);
      mesh.attributes.push_back(
          {{{v.normal.x, v.normal.y, v.normal.z, v.uv.x}, {v.tangent.x, v.tangent.y, v.tangent.z, v.uv.y}}});
    }
    for (std::size_t k = 0; k + 2 < surface.indices.size(); k += 3) {
      const std::uint32_t* corner = &surface.indices[k];
      mesh.triangles.push_back({{base + corner[0], base + corner[1], base + corner[2]},
                                static_cast<std::uint32_t>(i),
                                surface.vertices[corner[0]].tangent.w < 0 ? -1.0F : 1.0F,
                                surface.vertices[corner[0]].whole_repeats,
                                !surface.degenerate_uvs.empty() && surface.degenerate_uvs[k / 3] != 0});
    }
    mesh.extra_uvs.resize(std::max(mesh.extra_uvs.size(), surface.extra_uvs.size()));
    for (std::size_t m = 0; m < surface.extra_uvs.size(); ++m) {
      mesh.extra_uvs[m].resize(base, V2f(0, 0));
      mesh.extra_uvs[m].insert(mesh.extra_uvs[m].end(), surface.extra_uvs[m].begin(),
                               surface.extra_uvs[m].end());
    }
    if (!surface.colors.empty()) {
      mesh.colors.resize(base, V4f(1, 1, 1, 1));
      mesh.colors.insert(mesh.colors.end(), surface.colors.begin(), surface.colors.end());
    }
  }
  for (std::vector<V2f>& uvs : mesh.extra_uvs) uvs.resize(mesh.positions.size(), V2f(0, 0));
  if (!mesh.colors.empty()) mesh.colors.resize(mesh.positions.size(), V4f(1, 1, 1, 1));
  return mesh;
}

std::vector<TriangleSpan> spans_of(const MergedSurfaces& mesh) {
  std::vector<TriangleSpan> spans;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (spans.empty() || spans.back().surface != mesh.triangles[i].surface)
      spans.push_back({mesh.triangles[i].surface, i, i});
    ++spans.back().end;
  }
  return spans;
}

ProjectedVertices project(const MergedSurfaces& mesh, const M44d& clip, int width, int height) {
  ProjectedVertices projected{width, height, {}, {}};
  const std::size_t count = mesh.positions.size();
  projected.clip.resize(count);
  projected.screen.resize(count);
  parallel_each(count, chunk_size, [&](std::size_t i) {
    const V3d p(mesh.positions[i]);
    const auto row = [&](unsigned k) {
      return p.x * clip[0][k] + p.y * clip[1][k] + p.z * clip[2][k] + clip[3][k];
    };
    const double x = row(0);
    const double y = row(1);
    const double w = row(3);
    projected.clip[i] =
        V4f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(row(2)), static_cast<float>(w));
    projected.screen[i] = {static_cast<float>(x * 0.5 * width), static_cast<float>(y * 0.5 * height),
                           static_cast<float>(w), 0};
  });
  return projected;
}

double mean_depth_complexity(const MergedSurfaces& mesh, const ProjectedVertices& projected) {
  double area = 0;  // in frames
  for (const MergedTriangle& triangle : mesh.triangles) {
    std::array<V2d, 3> places;
    std::array<int, 5> outside{};  // corners beyond a side, or behind the viewer
    for (std::size_t k = 0; k < 3; ++k) {
      const Imath::V4d p(projected.clip[triangle.corners[k]]);
      places[k] = V2d(p.x, p.y) / p.w;
      outside[0] += p.x < -p.w ? 1 : 0;
      outside[1] += p.x > p.w ? 1 : 0;
      outside[2] += p.y < -p.w ? 1 : 0;
      outside[3] += p.y > p.w ? 1 : 0;
      outside[4] += p.w > 0 ? 0 : 1;
    }
    if (std::ranges::find(outside, 3) != outside.end()) continue;
    const double whole = std::abs((places[1] - places[0]).cross(places[2] - places[0])) / 8;
    V2d size(2, 2);
    for (int k = 0; k < 2 && outside[4] == 0; ++k) {
      const auto [low, high] = std::minmax({places[0][k], places[1][k], places[2][k]});
      size[k] = std::min(high, 1.0) - std::max(low, -1.0);
    }
    const double within = size.x * size.y / 4;
    area += outside[4] == 0 ? std::min(whole, within) : within;
  }
  return area;
}

std::vector<TriangleLists> list_bands(const MergedSurfaces& mesh, const ProjectedVertices& projected,
                                      std::span<const SurfaceMaterial> materials, int band_rows) {
  const std::size_t bands = (projected.height + band_rows - 1) / band_rows;
  std::vector<std::vector<TriangleLists>> parts((mesh.triangles.size() + chunk_size - 1) / chunk_size);
  parallel_chunks(mesh.triangles.size(), chunk_size, [&](std::size_t first, std::size_t end) {
    auto& part = parts[first / chunk_size];
    part.resize(bands);
    for (std::size_t i = first; i < end; ++i) {
      std::array<Group, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) corners[k] = projected.screen[mesh.triangles[i].corners[k]];
      V2i rows(0, projected.height - 1);
      if (corners[0][2] > 0 && corners[1][2] > 0 && corners[2][2] > 0) {
        rows = pixels_between(corners, 1, projected.height);
        const V2i columns = pixels_between(corners, 0, projected.width);
        if (columns.x > columns.y || rows.x > rows.y) continue;
      }
      const auto homogeneous = [&](std::size_t k) {
        return V3d(corners[k][0], corners[k][1], corners[k][2]);
      };
      // Twice the signed area, also valid for corners behind the viewer.
      const double facing = homogeneous(0).dot(homogeneous(1).cross(homogeneous(2)));
      const bool shows_back = facing < 0 && !materials[mesh.triangles[i].surface].culls_back;
      if (!(facing > 0 || shows_back)) continue;
      for (int band = rows.x / band_rows; band <= rows.y / band_rows; ++band)
        part[band][shows_back ? 1 : 0].push_back(static_cast<std::uint32_t>(i));
    }
  });
  std::vector<TriangleLists> lists(bands);
  for (const std::vector<TriangleLists>& part : parts)
    for (std::size_t band = 0; band < bands; ++band)
      for (std::size_t side = 0; side < 2; ++side)
        lists[band][side].insert(lists[band][side].end(), part[band][side].begin(), part[band][side].end());
  return lists;
}

}  // namespace selvedge
