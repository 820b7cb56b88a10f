#include "format/gltf/geometry.h"

#include <Imath/ImathMatrix.h>
#include <Imath/ImathQuat.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "format/gltf/access.h"

namespace selvedge {
namespace {

enum Mode { triangles = 4, strip = 5, fan = 6 };

int mode_of(const Json& primitive) {
  const Json& mode = member(primitive, "mode");
  return mode.is_null() ? triangles : index_of(mode);
}

/// Numbers of an array of exactly `count`, or of `otherwise` where the member is absent.
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

/// The attribute's values; empty where it is absent.
template <class V>
Result<std::vector<V>> read_attribute(const GltfDocument& document, const Json& primitive,
                                      const char* semantic, std::size_t count, const std::string& place) {
  const Json& accessor = member(member(primitive, "attributes"), semantic);
  if (accessor.is_null()) return std::vector<V>();
  return read_vectors<V>(document, index_of(accessor), count,
                         fmt::format("{}/attributes/{}", place, semantic));
}

/// COLOR_0 has three or four numbers.
Result<std::vector<V4f>> read_colors(const GltfDocument& document, const Json& primitive, std::size_t count,
                                     const std::string& place) {
  const Json& accessor = member(member(primitive, "attributes"), "COLOR_0");
  const Result<AccessorShape> shape = shape_of(document, index_of(accessor), place + "/attributes/COLOR_0");
  if (accessor.is_null() || (shape && shape->components == 4))
    return read_attribute<V4f>(document, primitive, "COLOR_0", count, place);
  const auto opaque = read_attribute<V3f>(document, primitive, "COLOR_0", count, place);
  if (!opaque) return tl::unexpected<Error>(opaque.error());
  std::vector<V4f> colors;
  colors.reserve(opaque->size());
  for (const V3f& c : *opaque) colors.emplace_back(c.x, c.y, c.z, 1.0F);
  return colors;
}

template <class V>
void unshare(std::vector<V>& values, const std::vector<std::uint32_t>& indices) {
  if (values.empty()) return;
  std::vector<V> own(indices.size());
  std::transform(indices.begin(), indices.end(), own.begin(), [&](std::uint32_t i) { return values[i]; });
  values = std::move(own);
}

/// glTF 2.0 section 3.7.2.1: without normals, flat ones; given tangents are then ignored.
void make_flat(ScenePrimitive& primitive) {
  unshare(primitive.positions, primitive.indices);
  for (std::vector<V2d>& set : primitive.tex_coords) unshare(set, primitive.indices);
  unshare(primitive.colors, primitive.indices);
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

Result<std::vector<std::uint32_t>> read_triangles(const GltfDocument& document, const Json& primitive,
                                                  const std::string& place, std::size_t vertices) {
  const int mode = mode_of(primitive);
  if (mode < triangles || mode > fan)
    return fail(Code::gltf_malformed, document.file, place + "/mode", "unknown mode");
  std::vector<std::uint32_t> list(vertices);
  std::iota(list.begin(), list.end(), 0U);
  if (const Json& accessor = member(primitive, "indices"); !accessor.is_null()) {
    const std::string where = place + "/indices";
    Result<std::vector<std::uint32_t>> read = read_indices(document, index_of(accessor), where);
    if (!read) return read;
    list = std::move(*read);
    const auto bad = std::find_if(list.begin(), list.end(), [&](std::uint32_t i) { return i >= vertices; });
    if (bad != list.end()) {
      return fail(Code::gltf_accessor, document.file, where,
                  fmt::format("index {} of {} vertices", *bad, vertices));
    }
  }
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

Result<std::optional<ScenePrimitive>> read_primitive(const GltfDocument& document, const Json& primitive,
                                                     const std::string& place, std::size_t vertex_limit,
                                                     const Pose& pose) {
  const int mode = mode_of(primitive);
  if (member(member(primitive, "attributes"), "POSITION").is_null() || (mode >= 0 && mode < triangles))
    return std::optional<ScenePrimitive>{};
  ScenePrimitive result;
  result.material = index_of(member(primitive, "material"));
  auto positions = read_attribute<V3f>(document, primitive, "POSITION", 0, place);
  if (!positions) return tl::unexpected<Error>(std::move(positions.error()));
  const std::size_t vertices = positions->size();
  if (vertices > vertex_limit) return fail(Code::file_too_large, document.file, place, "too many vertices");
  result.positions = std::move(*positions);

  auto indices = read_triangles(document, primitive, place, vertices);
  if (!indices) return tl::unexpected<Error>(std::move(indices.error()));
  result.indices = std::move(*indices);

  const auto fill = [&](auto& values, auto read) -> std::optional<Error> {
    if (!read) return std::move(read.error());
    values = std::move(*read);
    return std::nullopt;
  };
  const auto attribute = [&]<class V>(std::vector<V>& values, const char* semantic) {
    return fill(values, read_attribute<V>(document, primitive, semantic, vertices, place));
  };
  for (std::optional<Error> error :
       {attribute(result.normals, "NORMAL"), attribute(result.tangents, "TANGENT"),
        attribute(result.tex_coords[0], "TEXCOORD_0"), attribute(result.tex_coords[1], "TEXCOORD_1"),
        fill(result.colors, read_colors(document, primitive, vertices, place))}) {
    if (error) return tl::unexpected<Error>(std::move(*error));
  }
  if (Result<void> good = apply_pose(document, primitive, place, pose, result); !good) {
    return tl::unexpected<Error>(std::move(good.error()));
  }
  if (result.normals.empty()) {
    if (result.indices.size() > vertex_limit) {
      return fail(Code::file_too_large, document.file, place, "too many vertices");
    }
    make_flat(result);
  }
  return std::optional(std::move(result));
}

std::optional<M44d> local_transform(const Json& node) {
  if (const Json& value = member(node, "matrix"); !value.is_null()) {
    std::array<double, 16> m{};
    if (!numbers(value, m)) return std::nullopt;
    M44d matrix;
    std::copy(m.begin(), m.end(), &matrix[0][0]);
    return matrix;
  }
  std::array<double, 3> t{0, 0, 0};
  std::array<double, 4> r{0, 0, 0, 1};
  std::array<double, 3> s{1, 1, 1};
  if (!numbers(member(node, "translation"), t) || !numbers(member(node, "rotation"), r) ||
      !numbers(member(node, "scale"), s)) {
    return std::nullopt;
  }
  const M44d rotation = Imath::Quatd(r[3], r[0], r[1], r[2]).normalized().toMatrix44();
  return M44d().setScale(V3d(s[0], s[1], s[2])) * rotation * M44d().setTranslation(V3d(t[0], t[1], t[2]));
}

}  // namespace selvedge
