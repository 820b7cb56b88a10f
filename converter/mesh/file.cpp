#include "converter/mesh/file.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <map>
#include <tuple>

#include "format/base/atomic_file.h"
#include "format/base/foreign.h"
#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/mesh/ply.h"
#include "format/picture/image.h"

namespace selvedge {
namespace {

/// Appends values as they lie in memory: of 4 bytes each, or bytes, without gaps.
template <class... Values>
void append_bytes(std::string& out, const Values&... values) {
  static_assert(std::endian::native == std::endian::little);
  (out.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
}

std::string properties(const char* type, std::initializer_list<const char*> names) {
  std::string text;
  for (const char* name : names) text += fmt::format("property {} {}\n", type, name);
  return text;
}

/// A binary PLY file: colours as linear floats, and as 8-bit sRGB for other programs.
std::string write_ply(const CellMesh& mesh, const std::string& comment) {
  std::string out = fmt::format("ply\nformat binary_little_endian 1.0\ncomment {}\nelement vertex {}\n",
                                comment, mesh.positions.size());
  out += properties("float", {"x", "y", "z", "nx", "ny", "nz"}) +
         properties("uchar", {"red", "green", "blue"}) +
         properties("float", {"yarn_red", "yarn_green", "yarn_blue"});
  out += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                     mesh.triangles.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    std::array<std::uint8_t, 3> coded;
    for (unsigned i = 0; i < 3; ++i)
      coded[i] = static_cast<std::uint8_t>(std::lround(linear_to_srgb(mesh.albedo[v][i]) * 255));
    append_bytes(out, mesh.positions[v], mesh.normals[v], coded, mesh.albedo[v]);
  }
  for (const V3i& t : mesh.triangles) append_bytes(out, std::uint8_t{3}, t);
  return out;
}

constexpr std::uintmax_t max_material_file = 16U << 20U;           // bytes
constexpr std::uintmax_t max_mesh_file = std::uintmax_t{1} << 30;  // bytes

/// The ending of a path in lower case, without the dot.
std::string ending_of(const std::string& path) {
  const std::string ending = lower_case(std::filesystem::path(path).extension().string());
  return ending.empty() ? ending : ending.substr(1);
}

V3f albedo_of(const V3f& colour, bool coded, const V3f& fallback) {
  if (!(colour.x >= 0)) return fallback;  // not given, or not a number
  V3f albedo;
  for (unsigned i = 0; i < 3; ++i) {
    const float value = colour[i] >= 0 ? std::min(colour[i], 1.0F) : 0.0F;
    albedo[i] = coded ? srgb_to_linear(value) : value;
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

/// The material files that lie beside the mesh file; others are skipped.
std::vector<std::string> files_of_materials(const MeshFile& mesh, const std::string& path) {
  std::vector<std::string> files;
  for (const std::string& name : mesh.material_files) {
    const auto file = std::filesystem::path(path).replace_filename(name);
    std::error_code none;
    if (std::filesystem::path(name).filename() == name && std::filesystem::exists(file, none))
      files.push_back(file.string());
  }
  return files;
}

/// Gives the faces the diffuse colours of their materials.
void read_materials(MeshFile& mesh, const std::string& path) {
  std::map<std::string, MtlMaterial> materials;
  for (const std::string& file : files_of_materials(mesh, path))
    if (const auto text = read_file(file, max_material_file)) read_mtl(*text, materials);
  bool any = false;
  std::vector<V3f> colours;
  for (const int number : mesh.face_materials) {
    const std::optional<V3d> colour = materials[mesh.materials[number]].diffuse;
    colours.push_back(colour ? V3f(*colour) : V3f(-1));
    any = any || colour;
  }
  if (any) mesh.face_colours.values = std::move(colours);
}

struct CutFaces {
  std::vector<V3i> triangles;
  std::vector<std::size_t> face_of;  ///< of each triangle
};

CutFaces triangles_of(const MeshFile& file) {
  CutFaces cut;
  for (std::size_t f = 0; f < file.face_ends.size(); ++f) {
    const auto face = file.face(f);
    for (std::size_t k = 2; k < face.size(); ++k) {
      const V3i t(face[0].position, face[k - 1].position, face[k].position);
      if (t.x == t.y || t.y == t.z || t.z == t.x) continue;
      cut.triangles.push_back(t);
      cut.face_of.push_back(f);
    }
  }
  return cut;
}

/// The normals of the file if it has one for each vertex of a face, else nothing. Unused vertices get +z.
std::vector<V3f> given_normals(const MeshFile& file) {
  constexpr int none = -1;
  std::vector<int> normal_of(file.positions.size(), none);
  for (const MeshCorner& corner : file.corners) {
    int& known = normal_of[corner.position];
    if (corner.normal < 0 || (known >= 0 && V3f(file.normals[known]) != V3f(file.normals[corner.normal])))
      return {};
    known = corner.normal;
  }
  std::vector<V3f> normals;
  for (const int n : normal_of) normals.push_back(n < 0 ? V3f(0, 0, 1) : V3f(file.normals[n]));
  return normals;
}

/// Sets the colours of triangles, splitting vertices whose triangles differ.
void paint_triangles(CellMesh& mesh, const std::vector<std::optional<V3f>>& albedo) {
  std::map<std::tuple<int, float, float, float>, int> copies;  // of a vertex, by its colour
  std::vector<bool> is_painted(mesh.positions.size(), false);
  const std::vector<V3f> vertex_albedo = mesh.albedo;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int vertex = mesh.triangles[t][k];
      const V3f colour = albedo[t] ? *albedo[t] : vertex_albedo[vertex];
      const auto [copy, fresh] = copies.try_emplace({vertex, colour.x, colour.y, colour.z}, vertex);
      if (fresh && is_painted[vertex]) {
        copy->second = static_cast<int>(mesh.positions.size());
        mesh.positions.push_back(V3f(mesh.positions[vertex]));
        mesh.normals.push_back(V3f(mesh.normals[vertex]));
        mesh.albedo.emplace_back();
      }
      is_painted[vertex] = true;
      mesh.albedo[copy->second] = colour;
      mesh.triangles[t][k] = copy->second;
    }
  }
}

/// Moves a mesh that lies so far from the origin (64 times its size) that float positions lose six bits
/// towards it by whole periods, and its lowest point to height 0, in double precision.
void move_near_origin(std::vector<V3d>& positions, const std::vector<V3i>& triangles, const V2d& period) {
  Imath::Box3d box;
  for (const V3i& t : triangles)
    for (int k = 0; k < 3; ++k) box.extendBy(positions[t[k]]);
  if (box.isEmpty() || !(period.x > 0 && period.y > 0)) return;
  const V3d size = box.size();
  double distance = 0;
  for (int i = 0; i < 3; ++i) distance = std::max({distance, std::abs(box.min[i]), std::abs(box.max[i])});
  if (!(distance > 64 * std::max({size.x, size.y, size.z})) || !std::isfinite(distance)) return;
  const V3d shift(std::floor(box.min.x / period.x) * period.x, std::floor(box.min.y / period.y) * period.y,
                  box.min.z);
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
  for (const V3i& t : mesh.triangles)
    fmt::format_to(end, "f {0}//{0} {1}//{1} {2}//{2}\n", t.x + 1, t.y + 1, t.z + 1);
  return out;
}

bool is_known(const std::string& ending) { return ending == "obj" || ending == "ply"; }

Result<CellMesh> cell_from(const std::string& bytes, const std::string& path,
                           const MeshImportOptions& options, bool with_materials, MeshChoices* chosen) {
  const std::string format = ending_of(path);
  if (const std::string_view kind = foreign_file_message(bytes); !kind.empty())
    return fail(Code::mesh_invalid, path, "", std::string(kind));
  if (!is_known(format))
    return fail(Code::mesh_invalid, path, "",
                fmt::format("files that end in \".{}\" are not read: .wif are drafts, .txt charts, .json "
                            "descriptions, .obj and .ply meshes",
                            format));
  if (options.scale_to_mm && (!(*options.scale_to_mm > 0) || !std::isfinite(*options.scale_to_mm)))
    return fail(Code::option_out_of_range, path, "--unit",
                fmt::format("must be positive, is {}", *options.scale_to_mm));
  for (int c = 0; c < 3; ++c)
    if (!(options.albedo[c] >= 0 && options.albedo[c] <= 1))
      return fail(Code::option_out_of_range, path, "--albedo",
                  fmt::format("must lie in 0 to 1, is {}", options.albedo[c]));
  auto file = value_or_throw(format == "obj" ? read_obj(bytes, path)
                                             : ply_to_mesh(value_or_throw(read_ply(bytes, path)), path));
  if (with_materials) read_materials(file, path);
  auto [triangles, face_of] = triangles_of(file);
  const MeshChoices choices =
      guess_mesh_choices(file, bytes, options.period, options.scale_to_mm, options.up_axis);
  if (chosen != nullptr) *chosen = choices;
  if (!options.period && !triangles.empty() && !(choices.period.x > 0 && choices.period.y > 0))
    return fail(Code::mesh_invalid, path, "",
                "the mesh has no extent to guess its period from: give --period WxH in mm");

  CellMesh mesh;
  mesh.period = choices.period;
  mesh.triangles = std::move(triangles);
  for (V3d& position : file.positions)
    position = to_cell_axes(position, choices.up_axis) * choices.scale_to_mm;
  for (std::size_t v = 0; v < file.positions.size(); ++v) {
    const V3f colour = file.colours.values.empty() ? V3f(-1) : file.colours.values[v];
    mesh.albedo.push_back(albedo_of(colour, file.colours.is_srgb, options.albedo));
  }
  move_near_origin(file.positions, mesh.triangles, mesh.period);
  for (const V3d& p : file.positions) mesh.positions.emplace_back(p);
  for (const V3f& n : given_normals(file)) {
    const V3f up = to_cell_axes(n, choices.up_axis);
    // Unit normals stay as they are, to the bit.
    const bool unit = std::abs(up.length() - 1) < 1e-6F;
    mesh.normals.push_back(unit ? up : up.length() > 0 ? up.normalized() : V3f(0, 0, 1));
  }
  if (mesh.normals.empty()) mesh.normals = normals_of(mesh.positions, mesh.triangles);
  if (const std::vector<V3f>& colours = file.face_colours.values; !colours.empty()) {
    std::vector<std::optional<V3f>> albedo;
    for (const std::size_t face : face_of)
      albedo.push_back(colours[face].x >= 0 ? std::optional(albedo_of(
                                                  colours[face], file.face_colours.is_srgb, options.albedo))
                                            : std::nullopt);
    paint_triangles(mesh, albedo);
  }
  value_or_throw(validate(mesh, path));
  return mesh;
}

/// Size of the bounding box of all used vertices, in the file's axes and units.
V3d extent_of(const MeshFile& file) {
  Imath::Box3d box;
  for (const MeshCorner& corner : file.corners) box.extendBy(file.positions[corner.position]);
  return box.isEmpty() ? V3d(0) : box.max - box.min;
}

/// The period that write_mesh keeps in a comment.
std::optional<V2d> period_in_comment(const std::string& bytes) {
  constexpr std::size_t searched = 4096;
  const std::string start = bytes.substr(0, searched);
  for (const char* mark : {"# period ", "comment period "}) {
    const std::size_t offset = start.find(mark);
    if (offset == std::string::npos) continue;
    V2d period;
    if (std::sscanf(start.c_str() + offset + std::strlen(mark), "%lf x %lf mm", &period.x, &period.y) == 2)
      return period;
  }
  return std::nullopt;
}

}  // namespace

const char* name_of(UpAxis axis) { return axis == UpAxis::x ? "x" : (axis == UpAxis::y ? "y" : "z"); }

std::vector<std::string> remarks_on(const MeshChoices& c) {
  std::vector<std::string> remarks;
  for (const auto& [remark, from] :
       {std::pair(fmt::format("period {:g} x {:g} mm", c.period.x, c.period.y), c.period_source),
        std::pair(fmt::format("{:g} mm per unit", c.scale_to_mm), c.scale_source),
        std::pair(fmt::format("axis {} out of the cloth", name_of(c.up_axis)), c.up_axis_source)})
    if (from != "given") remarks.push_back(fmt::format("{} ({})", remark, from));
  return remarks;
}

MeshChoices guess_mesh_choices(const MeshFile& file, const std::string& bytes,
                               const std::optional<V2d>& period, const std::optional<double>& scale_to_mm,
                               const std::optional<UpAxis>& up_axis) {
  constexpr double clearly = 0.9;      // ratio of extents
  constexpr double smallest_mm = 0.1;  // a smaller cell must be in metres
  const V3d extent = extent_of(file);
  MeshChoices choices{.period_source = "given", .scale_source = "given", .up_axis_source = "given"};
  const auto commented = period_in_comment(bytes);
  if (up_axis) {
    choices.up_axis = *up_axis;
  } else if (commented) {  // thick cloth of few stitches may be flattest along another
    choices.up_axis_source = "a comment in the file";
  } else if (std::min(extent.x, extent.y) < clearly * extent.z) {
    choices.up_axis = extent.y <= extent.x ? UpAxis::y : UpAxis::x;
    choices.up_axis_source = "guessed: the mesh is flattest along it";
  } else {
    choices.up_axis_source = "guessed: no other axis is flatter";
  }
  const V3d size = to_cell_axes(extent, choices.up_axis);
  const V2d plane(std::abs(size.x), std::abs(size.y));
  if (scale_to_mm) {
    choices.scale_to_mm = *scale_to_mm;
  } else if (!period && !commented && std::max(plane.x, plane.y) < smallest_mm) {
    choices.scale_to_mm = 1000;
    choices.scale_source = "guessed: metres, as it is too small for millimetres";
  } else {
    choices.scale_source = "guessed: millimetres";
  }
  if (period) {
    choices.period = *period;
  } else if (commented) {
    choices.period = *commented;
    choices.period_source = "a comment in the file";
  } else {
    choices.period = plane * choices.scale_to_mm;
    choices.period_source = "guessed: the extent of the mesh";
  }
  return choices;
}

std::vector<std::string> material_files_of(const std::string& path) {
  const auto bytes = read_file(path, max_mesh_file);
  const auto mesh = bytes && ending_of(path) == "obj" ? read_obj(*bytes, path) : MeshFile();
  return mesh ? files_of_materials(*mesh, path) : std::vector<std::string>();
}

Result<CellMesh> read_mesh(const std::string& path, const MeshImportOptions& options, MeshChoices* chosen) {
  return catch_failure(
      [&] { return cell_from(value_or_throw(read_file(path, max_mesh_file)), path, options, true, chosen); });
}

Result<CellMesh> read_mesh(const std::string& bytes, const std::string& name,
                           const MeshImportOptions& options) {
  return catch_failure([&] { return cell_from(bytes, name, options, false, nullptr); });
}

Result<void> write_mesh(const std::string& path, const CellMesh& mesh) {
  const std::string format = ending_of(path);
  if (!is_known(format))
    return fail(Code::file_unwritable, path, "", "the file's ending must be .obj or .ply");
  if (auto sound = validate(mesh, path); !sound) return sound;
  return write_file(path, format == "obj" ? obj_of(mesh) : write_ply(mesh, period_comment(mesh)));
}

}  // namespace selvedge
