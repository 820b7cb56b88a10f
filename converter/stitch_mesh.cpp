#include "converter/stitch_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "converter/implicit_surface.h"
#include "converter/marching_cubes.h"

namespace selvedge {
namespace {

constexpr double max_grid_points = 1 << 24;

Result<MarchingGrid> grid_for(const StitchPattern& pattern, const MeshOptions& options, double low,
                              double high) {
  const double longer = std::max(pattern.period_mm.x, pattern.period_mm.y);
  const double step = longer / options.cells_across;
  const auto cells = [&](double extent) { return std::max(1.0, std::round(extent / step)); };
  const double x = cells(pattern.period_mm.x);
  const double y = cells(pattern.period_mm.y);
  const double z = std::ceil((high - low) / step) + 2;  // a cube of air below and above
  const auto refuse = [&](std::string why) {
    return fail(Code::option_out_of_range, pattern.name, "--grid", std::move(why));
  };
  if ((x + 1) * (y + 1) * (z + 1) >= max_grid_points) {
    return refuse(fmt::format("{} make a grid of {:.0f} points, at most {:.0f}", options.cells_across,
                              (x + 1) * (y + 1) * (z + 1), max_grid_points));
  }
  double thinnest = pattern.yarns.front().radius_mm;
  for (const Yarn& yarn : pattern.yarns) thinnest = std::min(thinnest, yarn.radius_mm);
  if (step > thinnest) {
    return refuse(fmt::format("{} are too few for a yarn of radius {} mm, at least {:.0f}",
                              options.cells_across, thinnest, std::ceil(longer / thinnest)));
  }
  MarchingGrid grid;
  grid.period = pattern.period_mm;
  grid.cells = {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)};
  grid.z_step = step;
  grid.z_min = 0.5 * (low + high - z * step);
  return grid;
}

}  // namespace

Result<CellMesh> mesh_stitch(const StitchPattern& pattern, const MeshOptions& options) {
  if (auto sound = validate(pattern, pattern.name); !sound) return tl::unexpected(sound.error());
  if (options.cells_across < 4 || options.cells_across > 1024) {
    return fail(Code::option_out_of_range, pattern.name, "--grid",
                fmt::format("must lie in 4 to 1024, are {}", options.cells_across));
  }
  // Signs need no reach at all; the search along an edge does, and no edge is longer than this.
  const double reach = std::max(pattern.period_mm.x, pattern.period_mm.y) / options.cells_across * 2;
  const auto surface = ImplicitSurface::build(pattern, reach, pattern.name);
  if (!surface) return tl::unexpected(surface.error());
  const auto grid = grid_for(pattern, options, surface->low(), surface->high());
  if (!grid) return tl::unexpected(grid.error());
  const MarchedSurface marched = march(*grid, [&](const V3d& p) { return surface->distance(p); });
  if (marched.triangles.empty()) {
    return fail(Code::mesh_empty, pattern.name, "", "the yarns enclose no grid point");
  }

  CellMesh mesh;
  mesh.period = pattern.period_mm;
  mesh.triangles = marched.triangles;
  mesh.positions.reserve(marched.positions.size());
  for (std::size_t v = 0; v < marched.positions.size(); ++v) {
    mesh.positions.emplace_back(marched.positions[v]);
    const auto original = static_cast<std::size_t>(marched.original[v]);
    if (original != v) {  // made before its copies
      mesh.normals.push_back(mesh.normals[original]);
      mesh.albedo.push_back(mesh.albedo[original]);
      continue;
    }
    const SurfaceSample sample = surface->sample(marched.positions[v]);
    mesh.normals.emplace_back(sample.gradient);
    mesh.albedo.push_back(pattern.yarns[static_cast<std::size_t>(sample.yarn)].albedo);
  }
  return mesh;
}

}  // namespace selvedge
