#include "converter/mesh/cell_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace selvedge {
namespace {

bool is_finite(const V3f& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

Imath::Box3f bounds_of(const CellMesh& mesh) {
  Imath::Box3f box;
  for (const V3i& triangle : mesh.triangles) {
    for (const int v : {triangle.x, triangle.y, triangle.z}) box.extendBy(mesh.positions[v]);
  }
  return box;
}

Result<void> validate(const CellMesh& mesh, const std::string& name) {
  const auto invalid = [&](std::string place, std::string why) {
    return fail(Code::mesh_invalid, name, std::move(place), std::move(why));
  };
  for (unsigned i = 0; i < 2; ++i) {
    if (!(mesh.period[i] > 0) || !std::isfinite(mesh.period[i])) {
      return invalid(i == 0 ? "period x" : "period y",
                     fmt::format("must be positive, is {}", mesh.period[i]));
    }
  }
  if (mesh.triangles.empty()) return fail(Code::mesh_empty, name, "", "the mesh has no triangles");
  const std::size_t count = mesh.positions.size();
  const std::size_t glossy = mesh.gloss.empty() ? 0 : count;
  for (const auto& [what, size, wanted] :
       {std::tuple("normals", mesh.normals.size(), count), std::tuple("albedos", mesh.albedo.size(), count),
        std::tuple("fibres", mesh.fibres.size(), glossy),
        std::tuple("values of gloss", mesh.gloss.size(), glossy),
        std::tuple("values of transmission", mesh.transmission.size(), mesh.transmission.empty() ? 0 : count),
        std::tuple("places on yarns", mesh.places.size(), mesh.places.empty() ? 0 : count)}) {
    if (size != wanted) return invalid("", fmt::format("{} positions, but {} {}", count, size, what));
  }
  for (std::size_t v = 0; v < count; ++v) {
    const auto place = [&] { return fmt::format("vertex {}", v); };
    const char* infinite = !is_finite(mesh.positions[v])                       ? "position"
                           : !is_finite(mesh.normals[v])                       ? "normal"
                           : !mesh.gloss.empty() && !is_finite(mesh.fibres[v]) ? "fibre direction"
                                                                               : nullptr;
    if (infinite != nullptr)
      return fail(Code::mesh_not_finite, name, place(), fmt::format("the {} is NaN or infinite", infinite));
    const Gloss gloss = mesh.gloss.empty() ? Gloss() : mesh.gloss[v];
    if (!(gloss.roughness > 0)) return invalid(place(), "the roughness of the gloss must be above 0");
    if (!(gloss.lustre >= 0 && gloss.lustre <= max_lustre))
      return invalid(place(), fmt::format("the lustre must lie in [0, {}]", max_lustre));
    for (const auto& [what, value] :
         {std::pair("red of the albedo", mesh.albedo[v].x),
          std::pair("green of the albedo", mesh.albedo[v].y),
          std::pair("blue of the albedo", mesh.albedo[v].z), std::pair("gloss", gloss.weight),
          std::pair("roughness of the gloss", gloss.roughness),
          std::pair("transmission", mesh.transmission.empty() ? 0 : mesh.transmission[v])}) {
      if (!(value >= 0 && value <= 1))
        return invalid(place(), fmt::format("the {} must lie in [0, 1], is {}", what, value));
    }
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int v = mesh.triangles[t][k];
      if (v < 0 || v >= static_cast<int>(count))
        return invalid(fmt::format("triangle {}", t), fmt::format("refers to vertex {} of {}", v, count));
    }
  }
  const Hairs& hairs = mesh.hairs;
  const std::size_t hair_count = hairs.roots.size();
  if (hairs.points.size() != hair_count * Hairs::points_each || hairs.radius.size() != hair_count ||
      hairs.passed.size() != hair_count)
    return invalid("", fmt::format("{} hairs, but {} points", hair_count, hairs.points.size()));
  for (std::size_t h = 0; h < hair_count; ++h) {
    const V3f* const first = &hairs.points[h * Hairs::points_each];
    if (hairs.roots[h] < 0 || hairs.roots[h] >= static_cast<int>(mesh.triangles.size()) ||
        !(hairs.radius[h] > 0) || !std::all_of(first, first + Hairs::points_each, is_finite))
      return invalid(fmt::format("hair {}", h), "has no root, no thickness or points that are not finite");
  }
  const bool has_area = std::ranges::any_of(mesh.triangles, [&](const V3i& t) {
    const auto position = [&](int v) { return V3d(mesh.positions[v]); };
    return (position(t.y) - position(t.x)).cross(position(t.z) - position(t.x)).length2() > 0;
  });
  if (!has_area) return fail(Code::mesh_empty, name, "", "no triangle of the mesh has an area");
  return {};
}

}  // namespace selvedge
