#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <string_view>

#include "converter/mesh/raw_mesh.h"
#include "format/base/ply.h"

namespace selvedge {
namespace {

/// The slot of a property: 0 to 2 position, 3 to 5 normal, 6 to 8 colour, then what Selvedge writes; -1:
/// ignored.
int slot_of(const std::string& name) {
  static const std::map<std::string, int> slots{{"x", 0},
                                                {"y", 1},
                                                {"z", 2},
                                                {"nx", 3},
                                                {"ny", 4},
                                                {"nz", 5},
                                                {"red", 6},
                                                {"green", 7},
                                                {"blue", 8},
                                                {"r", 6},
                                                {"g", 7},
                                                {"b", 8},
                                                {"diffuse_red", 6},
                                                {"diffuse_green", 7},
                                                {"diffuse_blue", 8},
                                                {"yarn_red", 9},
                                                {"yarn_green", 10},
                                                {"yarn_blue", 11},
                                                {"yarn_gloss", 12},
                                                {"yarn_roughness", 13},
                                                {"yarn_fibre_x", 14},
                                                {"yarn_fibre_y", 15},
                                                {"yarn_fibre_z", 16},
                                                {"yarn_skin", 17},
                                                {"yarn_along", 18},
                                                {"yarn_around", 19},
                                                {"yarn_transmission", 20}};
  const auto found = slots.find(name);
  return found == slots.end() ? -1 : found->second;
}

constexpr int first_of_colour = 6;
constexpr int first_of_yarn = 9;
using Slots = std::array<double, 21>;

/// Whether `count` slots from `first` have been seen.
bool has_slots(unsigned seen, int first, int count) {
  const unsigned all = (1U << count) - 1;
  return (seen >> first & all) == all;
}

/// The largest colour of this type.
double full_scale(PlyType type) {
  if (type.kind == 'f') return 1;
  const auto bits = static_cast<int>(8 * type.size) - (type.kind == 'i' ? 1 : 0);
  return static_cast<double>((std::uint64_t{1} << bits) - 1);
}

int index_of(double value) {
  return value >= 0 && value <= std::numeric_limits<int>::max() ? static_cast<int>(value) : -1;
}

V3f vector_at(const Slots& values, std::size_t first) {
  return V3f(V3d(values[first], values[first + 1], values[first + 2]));
}

bool read_element(const PlyElement& element, PlyBody& body, RawMesh& mesh) {
  const bool vertices = element.name == "vertex";
  const bool faces = element.name == "face";
  unsigned seen = 0;
  std::vector<int> slots;
  for (const PlyProperty& property : element.properties) {
    int slot = (vertices || faces) && !property.length ? slot_of(property.name) : -1;
    if (faces && (slot < first_of_colour || slot >= first_of_yarn)) slot = -1;
    slots.push_back(slot);
    if (slot < 0) continue;
    seen |= 1U << slot;
    if (slot >= first_of_colour && slot < first_of_yarn) {
      (vertices ? mesh.colours_8bit : mesh.face_colours_8bit) = property.type.kind != 'f';
    }
  }
  if (vertices && !has_slots(seen, 0, 3)) return false;
  const bool normals = has_slots(seen, 3, 3);
  const bool exact = vertices && has_slots(seen, first_of_yarn, 3);
  const bool colours = exact || has_slots(seen, first_of_colour, 3);
  const bool glossy = has_slots(seen, 12, 5);
  const bool placed = has_slots(seen, 17, 3);
  const bool translucent = has_slots(seen, 20, 1);
  if (exact) mesh.colours_8bit = false;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    Slots values{};
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const PlyProperty& property = element.properties[p];
      double number = 0;
      if (!property.length) {
        if (!body.read(property.type, number)) return false;
        if (slots[p] >= first_of_colour && slots[p] < first_of_yarn) number /= full_scale(property.type);
        if (slots[p] >= 0) values[slots[p]] = number;
        continue;
      }
      if (!body.read(*property.length, number)) return false;
      if (!(number >= 0) || number > static_cast<double>(body.bytes_left())) return false;
      const bool is_face_list =
          faces && (property.name == "vertex_indices" || property.name == "vertex_index");
      std::vector<int> indices;
      for (auto remaining = static_cast<std::size_t>(number); remaining > 0; --remaining) {
        if (!body.read(property.type, number)) return false;
        if (is_face_list) indices.push_back(index_of(number));
      }
      if (is_face_list) mesh.faces.push_back(std::move(indices));
    }
    if (faces && colours) mesh.face_colours.push_back(vector_at(values, 6));
    if (!vertices) continue;
    mesh.positions.emplace_back(values[0], values[1], values[2]);
    if (normals) mesh.normals.push_back(vector_at(values, 3));
    if (colours) mesh.colours.push_back(vector_at(values, exact ? first_of_yarn : first_of_colour));
    if (glossy) {
      mesh.gloss.push_back({static_cast<float>(values[12]), static_cast<float>(values[13])});
      mesh.fibres.push_back(vector_at(values, 14));
    }
    if (translucent) mesh.transmission.push_back(static_cast<float>(values[20]));
    if (placed) {
      mesh.places.push_back(
          {static_cast<int>(values[17]), static_cast<float>(values[18]), static_cast<float>(values[19])});
    }
  }
  return true;
}

/// One item of an element: its numbers in order, those of lists without their length.
bool read_numbers(const PlyElement& element, PlyBody& body, std::vector<double>& numbers) {
  numbers.clear();
  for (const PlyProperty& property : element.properties) {
    double count = 1;
    if (property.length && !body.read(*property.length, count)) return false;
    if (!(count >= 0) || count > static_cast<double>(body.bytes_left())) return false;
    for (auto remaining = static_cast<std::size_t>(count); remaining > 0; --remaining) {
      double number = 0;
      if (!body.read(property.type, number)) return false;
      numbers.push_back(number);
    }
  }
  return true;
}

/// Elements that Selvedge writes beside vertices and faces.
bool read_yarn_element(const PlyElement& element, PlyBody& body, RawMesh& mesh) {
  std::vector<double> n;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    if (!read_numbers(element, body, n)) return false;
    const auto whole = [&](std::size_t k) { return index_of(n[k]); };
    if (element.name == "yarn_skin") {
      if (n.size() != 6) return false;
      mesh.skins.push_back({whole(0), static_cast<int>(n[1]), whole(2), whole(3), static_cast<float>(n[4])});
      mesh.seed = static_cast<std::uint64_t>(n[5]);
    } else if (element.name == "yarn_hair") {
      if (n.size() != 3 + 3 * Hairs::points_each) return false;
      mesh.hairs.roots.push_back(whole(0));
      mesh.hairs.radius.push_back(static_cast<float>(n[1]));
      mesh.hairs.passed.push_back(static_cast<float>(n[2]));
      for (std::size_t k = 3; k < n.size(); k += 3)
        mesh.hairs.points.emplace_back(V3d(n[k], n[k + 1], n[k + 2]));
    } else {
      constexpr int most = 1 << 24;
      if (n.size() < 2 || whole(0) < 1 || whole(0) > most || whole(1) < 1 || whole(1) > most) return false;
      mesh.yarn_counts = {whole(0), whole(1), 0};
      mesh.yarn_values.assign(n.begin() + 2, n.end());
    }
  }
  return true;
}

}  // namespace

Result<RawMesh> read_ply(const std::string& bytes, const std::string& file) {
  const auto header = read_ply_header(bytes, file);
  if (!header) return tl::unexpected(header.error());
  PlyBody body(std::string_view(bytes).substr(header->size), header->form);
  RawMesh mesh;
  for (const PlyElement& element : header->elements) {
    if (element.properties.empty()) continue;
    // Each takes at least a byte: a larger count must be damaged.
    const bool of_yarns =
        element.name == "yarn_skin" || element.name == "yarn_hair" || element.name == "yarn_curves";
    if (element.count > body.bytes_left() ||
        !(of_yarns ? read_yarn_element : read_element)(element, body, mesh)) {
      return fail(Code::file_damaged, file, "element " + element.name,
                  fmt::format("there are not {} of them to be read, with all they need", element.count));
    }
  }
  // A second element "vertex" may have other properties than the first.
  if (mesh.normals.size() != mesh.positions.size()) mesh.normals.clear();
  if (mesh.colours.size() != mesh.positions.size()) mesh.colours.clear();
  if (mesh.gloss.size() != mesh.positions.size()) {
    mesh.gloss.clear();
    mesh.fibres.clear();
  }
  if (mesh.transmission.size() != mesh.positions.size()) mesh.transmission.clear();
  if (mesh.face_colours.size() != mesh.faces.size()) mesh.face_colours.clear();
  return mesh;
}

}  // namespace selvedge
