#include "format/gltf/geometry.h"

#include <Imath/ImathMatrix.h>
#include <Imath/ImathQuat.h>
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "format/gltf/names.h"

namespace selvedge {
namespace {

enum Mode { triangles = 4, strip = 5, fan = 6 };

int mode_of(const Json& primitive) {
  const Json& mode = member(primitive, "mode");
  return mode.is_null() ? triangles : index_of(mode);
}

/// Reads an array of exactly `count` numbers; `out` stays as it is if the member is absent.
template <std::size_t count>
bool numbers(const Json& value, std::array<double, count>& out) {
  if (value.is_null()) return true;
  if (!value.is_array() || value.size() != count) return false;
  for (std::size_t i = 0; i < count; ++i) {
    if (!value[i].is_number()) return false;
    out[i] = value[i].get<double>();
  }
  return true;
}

/// COLOR_0 has three or four numbers.
std::vector<V4f> read_colors(GltfReader& reader, const Json& attributes, std::size_t count,
                             const std::string& place) {
  if (component_count(root_entry(reader.document, "accessors", index_of(member(attributes, "COLOR_0")))) == 4)
    return reader.attribute<V4f>(attributes, "COLOR_0", count, place);
  std::vector<V4f> colors;
  for (const V3f& c : reader.attribute<V3f>(attributes, "COLOR_0", count, place))
    colors.emplace_back(c.x, c.y, c.z, 1.0F);
  return colors;
}

template <class V>
void expand(std::vector<V>& values, const std::vector<std::uint32_t>& indices) {
  if (values.empty()) return;
  std::vector<V> own(indices.size());
  std::ranges::transform(indices, own.begin(), [&](std::uint32_t i) { return values[i]; });
  values = std::move(own);
}

/// glTF 2.0 section 3.7.2.1: without normals, flat ones; given tangents are then ignored.
void make_flat(ScenePrimitive& primitive) {
  expand(primitive.positions, primitive.indices);
  for (std::vector<V2d>& set : primitive.tex_coords) expand(set, primitive.indices);
  expand(primitive.colors, primitive.indices);
  primitive.tangents.clear();
  std::iota(primitive.indices.begin(), primitive.indices.end(), 0U);
  primitive.normals.resize(primitive.positions.size());
  for (std::size_t t = 0; t + 2 < primitive.positions.size(); t += 3) {
    const V3d a(primitive.positions[t]);
    const V3d b(primitive.positions[t + 1]);
    const V3d c(primitive.positions[t + 2]);
    V3d normal = (b - a).cross(c - a).normalized();
    if (normal.length2() == 0) normal = V3d(0, 0, 1);  // no area, nothing to see
    for (std::size_t k = 0; k < 3; ++k) primitive.normals[t + k] = V3f(normal);
  }
}

}  // namespace

bool replace_invalid_normals(ScenePrimitive& primitive) {
  const auto is_zero = [&](std::uint32_t i) { return primitive.normals[i] == V3f(0, 0, 0); };
  if (std::ranges::none_of(primitive.indices, is_zero)) return false;
  if (std::ranges::all_of(primitive.indices, is_zero)) {
    make_flat(primitive);
    return true;
  }
  std::vector<V3d> sums(primitive.normals.size(), V3d(0, 0, 0));
  for (std::size_t k = 0; k + 2 < primitive.indices.size(); k += 3) {
    const std::uint32_t* const corner = &primitive.indices[k];
    const V3d a(primitive.positions[corner[0]]);
    const V3d normal =
        (V3d(primitive.positions[corner[1]]) - a).cross(V3d(primitive.positions[corner[2]]) - a);
    for (std::size_t i = 0; i < 3; ++i) sums[corner[i]] += normal;
  }
  bool any = false;
  for (std::uint32_t i = 0; i < sums.size(); ++i) {
    if (!is_zero(i) || !(sums[i].length() > 0)) continue;
    primitive.normals[i] = V3f(sums[i].normalized());
    any = true;
  }
  return any;
}

std::vector<std::uint32_t> read_triangles(GltfReader& reader, const Json& primitive, const std::string& place,
                                          std::size_t vertices) {
  const int mode = mode_of(primitive);
  if (mode < triangles || mode > fan) reader.fail(Code::gltf_malformed, place + "/mode", "unknown mode");
  std::vector<std::uint32_t> list;
  if (const Json& accessor = member(primitive, "indices"); accessor.is_null()) {
    list.resize(vertices);
    std::iota(list.begin(), list.end(), 0U);
  } else {
    list = reader.indices(index_of(accessor), place + "/indices");
  }
  const auto bad = std::ranges::find_if(list, [&](std::uint32_t i) { return i >= vertices; });
  if (bad != list.end())
    reader.fail(Code::gltf_accessor, place + "/indices",
                fmt::format("index {} of {} vertices", *bad, vertices));
  if (mode == triangles) {
    list.resize(list.size() / 3 * 3);
    return list;
  }
  std::vector<std::uint32_t> expanded;
  for (std::size_t i = 2; i < list.size(); ++i) {
    if (mode == fan) {
      expanded.insert(expanded.end(), {list[i - 1], list[i], list[0]});
    } else {
      const std::size_t odd = i % 2;
      expanded.insert(expanded.end(), {list[i - 2], list[i - 1 + odd], list[i - odd]});
    }
  }
  return expanded;
}

std::optional<ScenePrimitive> read_primitive(GltfReader& reader, const Json& primitive,
                                             const std::string& place, std::size_t vertex_limit,
                                             const Pose& pose) {
  const Json& attributes = member(primitive, "attributes");
  const std::string where = place + "/attributes";
  const int mode = mode_of(primitive);
  if (member(attributes, "POSITION").is_null() || (mode >= 0 && mode < triangles)) return std::nullopt;
  ScenePrimitive result;
  result.material = index_of(member(primitive, "material"));
  result.positions = reader.attribute<V3f>(attributes, "POSITION", 0, where);
  const std::size_t vertices = result.positions.size();
  if (vertices > vertex_limit) reader.fail(Code::file_too_large, place, "too many vertices");
  result.indices = read_triangles(reader, primitive, place, vertices);
  result.normals = reader.attribute<V3f>(attributes, "NORMAL", vertices, where);
  result.tangents = reader.attribute<V4f>(attributes, "TANGENT", vertices, where);
  result.tex_coords[0] = reader.attribute<V2d>(attributes, "TEXCOORD_0", vertices, where);
  result.tex_coords[1] = reader.attribute<V2d>(attributes, "TEXCOORD_1", vertices, where);
  result.colors = read_colors(reader, attributes, vertices, where);
  apply_pose(reader, primitive, place, pose, result);
  if (result.normals.empty()) {
    if (result.indices.size() > vertex_limit) reader.fail(Code::file_too_large, place, "too many vertices");
    make_flat(result);
  }
  return result;
}

bool is_visible(const Json& node) {
  return member(member(member(node, "extensions"), names::gltf::node_visibility), "visible") != false;
}

std::optional<M44d> local_transform(const Json& node) {
  if (const Json& value = member(node, "matrix"); !value.is_null()) {
    std::array<double, 16> m{};
    if (!numbers(value, m)) return std::nullopt;
    M44d matrix;
    std::ranges::copy(m, &matrix[0][0]);
    return matrix;
  }
  std::array<double, 3> t{0, 0, 0};
  std::array<double, 4> r{0, 0, 0, 1};
  std::array<double, 3> s{1, 1, 1};
  if (!numbers(member(node, "translation"), t) || !numbers(member(node, "rotation"), r) ||
      !numbers(member(node, "scale"), s))
    return std::nullopt;
  const M44d rotation = Imath::Quatd(r[3], r[0], r[1], r[2]).toMatrix44();
  return M44d().setScale(V3d(s[0], s[1], s[2])) * rotation * M44d().setTranslation(V3d(t[0], t[1], t[2]));
}

}  // namespace selvedge
