#include "converter/mesh/file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>

#include "converter/mesh/raw_mesh.h"
#include "format/base/atomic_file.h"
#include "format/fabric/fabric.h"

namespace selvedge {
namespace {

constexpr std::uintmax_t max_material_file = 16U << 20U;           // bytes
constexpr std::uintmax_t max_mesh_file = std::uintmax_t{1} << 30;  // bytes

/// The ending of a path in lower case, without the dot.
std::string ending_of(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending.empty() ? ending : ending.substr(1);
}

/// The sRGB transfer curve (IEC 61966-2-1).
float linear_of(float coded) {
  return coded <= 0.04045F ? coded / 12.92F : std::pow((coded + 0.055F) / 1.055F, 2.4F);
}

V3f albedo_of(const V3f& colour, bool coded, const V3f& fallback) {
  if (!(colour.x >= 0)) return fallback;  // not given, or not a number
  V3f albedo;
  for (unsigned i = 0; i < 3; ++i) {
    const float value = colour[i] >= 0 ? std::min(colour[i], 1.0F) : 0.0F;
    albedo[i] = coded ? linear_of(value) : value;
  }
  return albedo;
}

/// Area-weighted mean of the face normals around each vertex; +z if they cancel or there are no faces.
std::vector<V3f> normals_of(const std::vector<V3f>& positions, const std::vector<V3i>& triangles) {
  std::vector<V3d> sums(positions.size(), V3d(0));
  const auto position = [&](int v) { return V3d(positions[v]); };
  for (const V3i& t : triangles) {
    const V3d twice_area = (position(t.y) - position(t.x)).cross(position(t.z) - position(t.x));
    for (int k = 0; k < 3; ++k) sums[t[k]] += twice_area;
  }
  std::vector<V3f> normals;
  for (const V3d& sum : sums) normals.emplace_back(sum.length() > 0 ? sum.normalized() : V3d(0, 0, 1));
  return normals;
}

/// The material files of a mesh file with these bytes; files that are missing or elsewhere are skipped.
std::vector<std::string> files_of_materials(const std::string& bytes, const std::string& path) {
  std::vector<std::string> files;
  if (ending_of(path) != "obj") return files;
  for (const std::string& name : material_files(bytes)) {
    const auto file = std::filesystem::path(path).replace_filename(name);
    std::error_code none;
    if (std::filesystem::path(name).filename() == name && std::filesystem::exists(file, none))
      files.push_back(file.string());
  }
  return files;
}

MaterialColours materials_of(const std::string& bytes, const std::string& path) {
  MaterialColours colours;
  for (const std::string& file : files_of_materials(bytes, path)) {
    if (const auto text = read_file(file, max_material_file)) read_materials(*text, colours);
  }
  return colours;
}

struct CutFaces {
  std::vector<V3i> triangles;
  std::vector<std::size_t> face_of;  ///< of each triangle
};

Result<CutFaces> triangles_of(const RawMesh& raw, const std::string& path) {
  CutFaces cut;
  const auto count = static_cast<int>(raw.positions.size());
  for (std::size_t f = 0; f < raw.faces.size(); ++f) {
    const std::vector<int>& face = raw.faces[f];
    for (const int v : face) {
      if (v < 0 || v >= count) {
        return fail(Code::mesh_invalid, path, fmt::format("face {}", f),
                    fmt::format("refers to vertex {} of {} (counted from 0)", v, count));
      }
    }
    for (std::size_t k = 2; k < face.size(); ++k) {
      const V3i t(face[0], face[k - 1], face[k]);
      if (t.x == t.y || t.y == t.z || t.z == t.x) continue;
      cut.triangles.push_back(t);
      cut.face_of.push_back(f);
    }
  }
  return cut;
}

/// Sets the colours of triangles, splitting vertices whose triangles differ.
void paint_triangles(CellMesh& mesh, const std::vector<std::optional<V3f>>& albedo) {
  constexpr int none = -1;
  struct Copy {
    V3f albedo;
    int vertex;
    int next;  ///< the next copy of the same vertex
  };
  std::vector<Copy> copies;
  std::vector<int> first(mesh.positions.size(), none);
  const std::vector<V3f> vertex_albedo = mesh.albedo;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      int& vertex = mesh.triangles[t][k];
      const int original = vertex;
      const V3f colour = albedo[t] ? *albedo[t] : vertex_albedo[original];
      int copy = first[original];
      while (copy != none && copies[copy].albedo != colour) {
        copy = copies[copy].next;
      }
      if (copy == none) {
        copies.push_back({colour, vertex, first[original]});
        if (first[original] == none) {
          mesh.albedo[original] = colour;
        } else {
          copies.back().vertex = static_cast<int>(mesh.positions.size());
          mesh.positions.push_back(mesh.positions[original]);
          mesh.normals.push_back(mesh.normals[original]);
          mesh.albedo.push_back(colour);
        }
        copy = first[original] = static_cast<int>(copies.size()) - 1;
      }
      vertex = copies[copy].vertex;
    }
  }
}

/// Whether a mesh with these bounds lies so far from the origin (64 times its size) that float positions lose
/// six bits.
bool lies_far(const V3d& low, const V3d& high) {
  double size = 0;
  double distance = 0;
  for (int i = 0; i < 3; ++i) {
    size = std::max(size, high[i] - low[i]);
    distance = std::max({distance, std::abs(low[i]), std::abs(high[i])});
  }
  return distance > 64 * size && std::isfinite(distance);
}

/// Moves a mesh that is far from the origin towards it by whole periods, and its lowest point to height 0, in
/// double precision.
void move_near_origin(std::vector<V3d>& positions, const std::vector<V3i>& triangles, const V2d& period) {
  V3d low(std::numeric_limits<double>::max());
  V3d high(std::numeric_limits<double>::lowest());
  for (const V3i& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      const V3d& p = positions[t[k]];
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], p[i]);
        high[i] = std::max(high[i], p[i]);
      }
    }
  }
  if (triangles.empty() || !lies_far(low, high) || !(period.x > 0 && period.y > 0)) return;
  const V3d shift(std::floor(low.x / period.x) * period.x, std::floor(low.y / period.y) * period.y, low.z);
  for (V3d& p : positions) p -= shift;
}

std::string period_comment(const CellMesh& mesh) {
  return fmt::format("period {} x {} mm", mesh.period.x, mesh.period.y);
}

std::string obj_of(const CellMesh& mesh) {
  std::string out = "# " + period_comment(mesh) + "\n";
  auto end = std::back_inserter(out);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const V3f& p = mesh.positions[v];
    const V3f& c = mesh.albedo[v];
    fmt::format_to(end, "v {} {} {} {} {} {}\n", p.x, p.y, p.z, c.x, c.y, c.z);
  }
  for (const V3f& n : mesh.normals) fmt::format_to(end, "vn {} {} {}\n", n.x, n.y, n.z);
  for (const V3i& t : mesh.triangles) {
    fmt::format_to(end, "f {0}//{0} {1}//{1} {2}//{2}\n", t.x + 1, t.y + 1, t.z + 1);
  }
  return out;
}

/// Adds what a PLY file of Selvedge says of its yarns. Those of a mesh that lies otherwise than it was
/// written are left out.
Result<void> add_yarns(RawMesh& raw, const MeshChoices& choices, const std::string& path, CellMesh& mesh) {
  if (!raw.face_colours.empty()) return {};
  for (V3f& fibre : raw.fibres) fibre = turned(fibre, choices.up_axis);
  mesh.fibres = std::move(raw.fibres);
  mesh.gloss = std::move(raw.gloss);
  mesh.transmission = std::move(raw.transmission);
  if (choices.up_axis != UpAxis::z || choices.scale_to_mm != 1) return {};
  mesh.skins = std::move(raw.skins);
  mesh.places = std::move(raw.places);
  mesh.seed = raw.seed;
  mesh.hairs = std::move(raw.hairs);
  const auto skins = static_cast<int>(mesh.skins.size());
  for (const YarnPlace& place : mesh.places) {
    if (place.skin < -1 || place.skin >= skins || !std::isfinite(place.along) ||
        !std::isfinite(place.around)) {
      return fail(Code::file_damaged, path, "element vertex", "has places on yarns that there are not");
    }
  }
  for (const YarnSkin& skin : mesh.skins) {
    if (skin.strands < 0 || skin.pieces < 1 || skin.swells < 1 || !std::isfinite(skin.irregularity)) {
      return fail(Code::file_damaged, path, "element yarn_skin", "has counts out of range");
    }
  }
  YarnCounts counts = raw.yarn_counts;
  if (counts.curves == 0) return {};
  constexpr double max_stations = 1 << 20;
  double stations = 0;  // the second value of each curve
  const auto of_curves =
      static_cast<std::int64_t>(raw.yarn_values.size()) - std::int64_t{values_per_node} * counts.nodes;
  const std::int64_t fields = of_curves / counts.curves;
  const bool whole = fields >= fields_of_round_yarn && fields <= FabricLimits{}.fields &&
                     fields * counts.curves == of_curves;
  if (whole) counts.fields = static_cast<int>(fields);
  for (int c = 0; whole && c < counts.curves; ++c)
    stations += static_cast<double>(raw.yarn_values[counts.curves + c]);
  if (!whole || !(stations >= 1 && stations <= max_stations)) {
    return fail(Code::file_damaged, path, "element yarn_curves", "has not the values of its curves");
  }
  counts.stations = static_cast<int>(stations);
  const std::vector<float> dark(std::size_t{light_values_per_station} * counts.stations);
  auto yarns = yarns_from_values(raw.yarn_values, dark, counts, V2f(mesh.period));
  if (!yarns) return fail(Code::file_damaged, path, "element yarn_curves", yarns.error().message);
  mesh.yarns = std::move(*yarns);
  mesh.yarns.light.clear();
  return {};
}

Result<CellMesh> cell_from(const std::string& bytes, const std::string& path,
                           const MeshImportOptions& options, const MaterialColours& materials,
                           MeshChoices* chosen) {
  const std::string format = ending_of(path);
  if (format != "obj" && format != "ply") {
    return fail(Code::mesh_invalid, path, "", "the file's ending must be .obj or .ply");
  }
  if (options.scale_to_mm && (!(*options.scale_to_mm > 0) || !std::isfinite(*options.scale_to_mm))) {
    return fail(Code::option_out_of_range, path, "--unit",
                fmt::format("must be positive, is {}", *options.scale_to_mm));
  }
  auto raw = format == "ply" ? read_ply(bytes, path) : read_obj(bytes, path, materials);
  if (!raw) return tl::unexpected(raw.error());
  auto faces = triangles_of(*raw, path);
  if (!faces) return tl::unexpected(faces.error());
  auto& [triangles, face_of] = *faces;
  const MeshChoices choices = choose(*raw, bytes, options.period, options.scale_to_mm, options.up_axis);
  if (chosen != nullptr) *chosen = choices;
  if (!options.period && !triangles.empty() && !(choices.period.x > 0 && choices.period.y > 0)) {
    return fail(Code::mesh_invalid, path, "",
                "the mesh has no extent to guess its period from: give --period WxH in mm");
  }

  CellMesh mesh;
  mesh.period = choices.period;
  mesh.triangles = std::move(triangles);
  for (std::size_t v = 0; v < raw->positions.size(); ++v) {
    raw->positions[v] = turned(raw->positions[v], choices.up_axis) * choices.scale_to_mm;
    const V3f colour = raw->colours.empty() ? V3f(-1) : raw->colours[v];
    mesh.albedo.push_back(albedo_of(colour, raw->colours_8bit, options.albedo));
  }
  move_near_origin(raw->positions, mesh.triangles, mesh.period);
  for (const V3d& p : raw->positions) mesh.positions.emplace_back(p);
  if (raw->normals.empty()) {
    mesh.normals = normals_of(mesh.positions, mesh.triangles);
  } else {
    for (const V3f& n : raw->normals) {
      const V3f up = turned(n, choices.up_axis);
      // Unit normals stay as they are, to the bit.
      const bool unit = std::abs(up.length() - 1) < 1e-6F;
      mesh.normals.push_back(unit ? up : up.length() > 0 ? up.normalized() : V3f(0, 0, 1));
    }
  }
  if (!raw->face_colours.empty()) {
    std::vector<std::optional<V3f>> albedo;
    for (const std::size_t face : face_of) {
      const V3f& colour = raw->face_colours[face];
      albedo.push_back(colour.x >= 0
                           ? std::optional(albedo_of(colour, raw->face_colours_8bit, options.albedo))
                           : std::nullopt);
    }
    paint_triangles(mesh, albedo);
  }
  if (auto added = add_yarns(*raw, choices, path, mesh); !added) return tl::unexpected(added.error());
  if (auto sound = validate(mesh, path); !sound) return tl::unexpected(sound.error());
  return mesh;
}

}  // namespace

std::vector<std::string> material_files_of(const std::string& path) {
  const auto bytes = read_file(path, max_mesh_file);
  return bytes ? files_of_materials(*bytes, path) : std::vector<std::string>();
}

Result<CellMesh> read_mesh(const std::string& path, const MeshImportOptions& options, MeshChoices* chosen) {
  const auto bytes = read_file(path, max_mesh_file);
  if (!bytes) return tl::unexpected(bytes.error());
  return cell_from(*bytes, path, options, materials_of(*bytes, path), chosen);
}

Result<CellMesh> read_mesh(const std::string& bytes, const std::string& name,
                           const MeshImportOptions& options) {
  return cell_from(bytes, name, options, {}, nullptr);
}

Result<void> write_mesh(const std::string& path, const CellMesh& mesh) {
  const std::string format = ending_of(path);
  if (format != "obj" && format != "ply") {
    return fail(Code::file_unwritable, path, "", "the file's ending must be .obj or .ply");
  }
  if (auto sound = validate(mesh, path); !sound) return sound;
  return write_file(path, format == "obj" ? obj_of(mesh) : write_ply(mesh, period_comment(mesh)));
}

}  // namespace selvedge
