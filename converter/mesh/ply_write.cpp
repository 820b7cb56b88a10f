#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>

#include "converter/mesh/raw_mesh.h"

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

/// The inverse of the sRGB transfer curve (IEC 61966-2-1).
float coded_of(float linear) {
  return linear <= 0.0031308F ? linear * 12.92F : 1.055F * std::pow(linear, 1 / 2.4F) - 0.055F;
}

std::string properties(const char* type, std::initializer_list<const char*> names) {
  std::string text;
  for (const char* name : names) text += fmt::format("property {} {}\n", type, name);
  return text;
}

}  // namespace

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
      append_bytes(out, static_cast<std::uint8_t>(std::lround(coded_of(mesh.albedo[v][i]) * 255)));
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
