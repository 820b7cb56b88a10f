#include "converter/mesh/ply_yarns.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "format/fabric/fabric.h"
#include "format/picture/image.h"

namespace selvedge {
namespace {

template <class T>
void append_bytes(std::string& out, T value) {
  static_assert(std::endian::native == std::endian::little);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append_vector(std::string& out, const V3f& v) {
  for (unsigned i = 0; i < 3; ++i) append_bytes(out, v[i]);
}

std::string properties(const char* type, std::initializer_list<const char*> names) {
  std::string text;
  for (const char* name : names) text += fmt::format("property {} {}\n", type, name);
  return text;
}

tl::unexpected<Error> damaged(const std::string& path, const char* element, std::string why) {
  return fail(Code::file_damaged, path, fmt::format("element {}", element), std::move(why));
}

int index_of(double value) {
  return value >= 0 && value <= std::numeric_limits<int>::max() ? static_cast<int>(value) : -1;
}

float single(const PlyProperty* column, std::size_t i) { return static_cast<float>(column->values[i]); }

void add_vertices(const PlyElement& vertices, const MeshChoices& choices, CellMesh& mesh) {
  const auto gloss =
      vertices.find({"yarn_gloss", "yarn_roughness", "yarn_fibre_x", "yarn_fibre_y", "yarn_fibre_z"});
  for (std::size_t i = 0; i < vertices.count && !gloss.empty(); ++i) {
    mesh.gloss.push_back({single(gloss[0], i), single(gloss[1], i)});
    const V3d fibre(gloss[2]->values[i], gloss[3]->values[i], gloss[4]->values[i]);
    mesh.fibres.push_back(turned(V3f(fibre), choices.up_axis));
  }
  const auto transmission = vertices.find({"yarn_transmission"});
  for (std::size_t i = 0; i < vertices.count && !transmission.empty(); ++i)
    mesh.transmission.push_back(single(transmission[0], i));
}

Result<void> add_skins(const PlyFile& ply, const std::string& path, CellMesh& mesh) {
  if (const PlyElement* skins = ply.find("yarn_skin")) {
    const auto columns = skins->find({"strands", "lays", "pieces", "swells", "irregularity", "seed"});
    if (columns.empty()) return damaged(path, "yarn_skin", "lacks properties");
    for (std::size_t i = 0; i < skins->count; ++i) {
      const auto whole = [&](std::size_t k) { return index_of(columns[k]->values[i]); };
      const double lays = columns[1]->values[i];
      const double seed = columns[5]->values[i];
      const bool is_whole = std::abs(lays) <= std::numeric_limits<int>::max();
      const YarnSkin skin{whole(0), is_whole ? static_cast<int>(lays) : 0, whole(2), whole(3),
                          single(columns[4], i)};
      if (!is_whole || skin.strands < 0 || skin.pieces < 1 || skin.swells < 1 ||
          !std::isfinite(skin.irregularity) ||
          !(seed >= 0 && seed <= std::numeric_limits<std::uint32_t>::max()))
        return damaged(path, "yarn_skin", "has counts out of range");
      mesh.skins.push_back(skin);
      mesh.seed = static_cast<std::uint64_t>(seed);
    }
  }
  const PlyElement* vertices = ply.find("vertex");
  const auto places = vertices->find({"yarn_skin", "yarn_along", "yarn_around"});
  for (std::size_t i = 0; i < vertices->count && !places.empty(); ++i) {
    const double skin = places[0]->values[i];
    mesh.places.push_back({skin < 0 ? -1 : index_of(skin), single(places[1], i), single(places[2], i)});
    const YarnPlace& place = mesh.places.back();
    if (!(skin >= -1 && skin < static_cast<double>(mesh.skins.size())) || !std::isfinite(place.along) ||
        !std::isfinite(place.around))
      return damaged(path, "vertex", "has places on yarns that do not exist");
  }
  return {};
}

Result<void> add_hairs(const PlyFile& ply, const std::string& path, CellMesh& mesh) {
  const PlyElement* hairs = ply.find("yarn_hair");
  if (hairs == nullptr) return {};
  const auto columns = hairs->find({"root", "radius", "passed"});
  const PlyProperty* points = hairs->find_list({"points"});
  if (columns.empty() || points == nullptr) return damaged(path, "yarn_hair", "lacks properties");
  constexpr std::size_t numbers = 3 * Hairs::points_each;
  for (std::size_t i = 0; i < hairs->count; ++i) {
    if (points->ends[i] != (i + 1) * numbers)
      return damaged(path, "yarn_hair", "has another number of points");
    mesh.hairs.roots.push_back(index_of(columns[0]->values[i]));
    mesh.hairs.radius.push_back(single(columns[1], i));
    mesh.hairs.passed.push_back(single(columns[2], i));
  }
  for (std::size_t k = 0; k < points->values.size(); k += 3)
    mesh.hairs.points.emplace_back(V3d(points->values[k], points->values[k + 1], points->values[k + 2]));
  return {};
}

Result<void> add_curves(const PlyFile& ply, const std::string& path, CellMesh& mesh) {
  const PlyElement* element = ply.find("yarn_curves");
  if (element == nullptr || element->count == 0) return {};
  const auto columns = element->find({"curves", "nodes"});
  const PlyProperty* list = element->find_list({"values"});
  constexpr double most = 1 << 24;
  const auto in_range = [&](std::size_t k) {
    return columns[k]->values[0] >= 1 && columns[k]->values[0] <= most;
  };
  if (element->count != 1 || columns.empty() || list == nullptr || !in_range(0) || !in_range(1))
    return damaged(path, "yarn_curves", "has no curves, or counts out of range");
  YarnCounts counts{index_of(columns[0]->values[0]), index_of(columns[1]->values[0]), 0};
  const std::vector<float> values(list->values.begin(), list->values.end());
  constexpr double max_stations = 1 << 20;
  double stations = 0;  // the second value of each curve
  const auto of_curves =
      static_cast<std::int64_t>(values.size()) - std::int64_t{values_per_node} * counts.nodes;
  const std::int64_t fields = of_curves / counts.curves;
  const bool whole =
      fields >= min_yarn_fields && fields <= FabricLimits{}.fields && fields * counts.curves == of_curves;
  if (whole) counts.fields = static_cast<int>(fields);
  for (int c = 0; whole && c < counts.curves; ++c) stations += static_cast<double>(values[counts.curves + c]);
  if (!whole || !(stations >= 1 && stations <= max_stations))
    return damaged(path, "yarn_curves", "has not the values of its curves");
  counts.stations = static_cast<int>(stations);
  const std::vector<float> dark(std::size_t{light_values_per_station} * counts.stations);
  auto yarns = yarns_from_values(values, dark, counts, V2f(mesh.period));
  if (!yarns) return damaged(path, "yarn_curves", yarns.error().message);
  mesh.yarns = std::move(*yarns);
  mesh.yarns.light.clear();
  return {};
}

}  // namespace

Result<void> add_yarns(const PlyFile& ply, const MeshChoices& choices, const std::string& path,
                       CellMesh& mesh) {
  const PlyElement* vertices = ply.find("vertex");
  if (vertices == nullptr) return {};
  add_vertices(*vertices, choices, mesh);
  if (choices.up_axis != UpAxis::z || choices.scale_to_mm != 1) return {};
  for (const auto add : {add_skins, add_hairs, add_curves}) {
    if (Result<void> ok = add(ply, path, mesh); !ok) return ok;
  }
  return {};
}

std::string write_ply(const CellMesh& mesh, const std::string& comment) {
  const bool glossy = !mesh.gloss.empty();
  const bool translucent = !mesh.transmission.empty();
  const bool placed = !mesh.places.empty();
  const YarnCounts counts = counts_of(mesh.yarns);
  std::string out = fmt::format("ply\nformat binary_little_endian 1.0\ncomment {}\nelement vertex {}\n",
                                comment, mesh.positions.size());
  out += properties("float", {"x", "y", "z", "nx", "ny", "nz"}) +
         properties("uchar", {"red", "green", "blue"}) +
         properties("float", {"yarn_red", "yarn_green", "yarn_blue"});
  if (glossy) {
    out +=
        properties("float", {"yarn_gloss", "yarn_roughness", "yarn_fibre_x", "yarn_fibre_y", "yarn_fibre_z"});
  }
  if (translucent) out += properties("float", {"yarn_transmission"});
  if (placed) out += properties("int", {"yarn_skin"}) + properties("float", {"yarn_along", "yarn_around"});
  out += fmt::format("element face {}\nproperty list uchar int vertex_indices\n", mesh.triangles.size());
  if (placed) {
    out += fmt::format("element yarn_skin {}\n", mesh.skins.size()) +
           properties("int", {"strands", "lays", "pieces", "swells"}) +
           properties("float", {"irregularity"}) + properties("uint", {"seed"}) +
           fmt::format("element yarn_hair {}\n", mesh.hairs.roots.size()) + properties("int", {"root"}) +
           properties("float", {"radius", "passed"}) + "property list uchar float points\n";
  }
  if (counts.curves > 0) {
    out += "element yarn_curves 1\n" + properties("int", {"curves", "nodes"}) +
           "property list int float values\n";
  }
  out += "end_header\n";
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    append_vector(out, mesh.positions[v]);
    append_vector(out, mesh.normals[v]);
    for (unsigned i = 0; i < 3; ++i) {
      append_bytes(out, static_cast<std::uint8_t>(std::lround(linear_to_srgb(mesh.albedo[v][i]) * 255)));
    }
    append_vector(out, mesh.albedo[v]);
    if (glossy) {
      append_bytes(out, mesh.gloss[v].weight);
      append_bytes(out, mesh.gloss[v].roughness);
      append_vector(out, mesh.fibres[v]);
    }
    if (translucent) append_bytes(out, mesh.transmission[v]);
    if (!placed) continue;
    append_bytes(out, static_cast<std::int32_t>(mesh.places[v].skin));
    append_bytes(out, mesh.places[v].along);
    append_bytes(out, mesh.places[v].around);
  }
  for (const V3i& t : mesh.triangles) {
    append_bytes(out, std::uint8_t{3});
    for (int k = 0; k < 3; ++k) append_bytes(out, static_cast<std::int32_t>(t[k]));
  }
  if (placed) {
    for (const YarnSkin& skin : mesh.skins) {
      for (const int value : {skin.strands, skin.lays, skin.pieces, skin.swells}) append_bytes(out, value);
      append_bytes(out, skin.irregularity);
      append_bytes(out, static_cast<std::uint32_t>(mesh.seed));
    }
    for (std::size_t h = 0; h < mesh.hairs.roots.size(); ++h) {
      append_bytes(out, mesh.hairs.roots[h]);
      append_bytes(out, mesh.hairs.radius[h]);
      append_bytes(out, mesh.hairs.passed[h]);
      append_bytes(out, static_cast<std::uint8_t>(3 * Hairs::points_each));
      for (int k = 0; k < Hairs::points_each; ++k)
        append_vector(out, mesh.hairs.points[h * Hairs::points_each + k]);
    }
  }
  if (counts.curves > 0) {
    const std::vector<float> values = curve_values(mesh.yarns);
    append_bytes(out, counts.curves);
    append_bytes(out, counts.nodes);
    append_bytes(out, static_cast<std::int32_t>(values.size()));
    for (const float value : values) append_bytes(out, value);
  }
  return out;
}

}  // namespace selvedge
