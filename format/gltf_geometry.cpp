#include "format/gltf_geometry.h"

#include <Imath/ImathMatrix.h>
#include <Imath/ImathQuat.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "format/gltf_access.h"

namespace selvedge {
namespace {

enum Mode { triangles = 4, strip = 5, fan = 6 };

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

/// The attribute's values, gathered into vectors of `components` numbers; empty where it is absent.
template <class V>
Result<std::vector<V>> read_vectors(const GltfDocument& document, const Json& primitive, const char* semantic,
                                    std::size_t components, std::size_t count, const std::string& place) {
  const Json& accessor = member(member(primitive, "attributes"), semantic);
  std::vector<V> vectors;
  if (accessor.is_null()) return vectors;
  const std::string where = fmt::format("{}/attributes/{}", place, semantic);
  const Result<AccessorShape> shape = shape_of(document, index_of(accessor), where);
  if (!shape) return tl::unexpected<Error>(shape.error());
  if (static_cast<std::size_t>(shape->components) != components || (count > 0 && shape->count != count)) {
    return fail(Code::gltf_malformed, document.file, where,
                fmt::format("{} elements of {} numbers do not belong here", shape->count, shape->components));
  }
  const Result<std::vector<float>> values = read_floats(document, index_of(accessor), where);
  if (!values) return tl::unexpected<Error>(values.error());
  vectors.resize(shape->count);
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    for (std::size_t c = 0; c < components; ++c) {
      const float value = (*values)[i * components + c];
      if (!std::isfinite(value)) {
        return fail(Code::mesh_not_finite, document.file, where, fmt::format("element {} is not finite", i));
      }
      vectors[i][static_cast<int>(c)] = static_cast<typename V::BaseType>(value);
    }
  }
  return vectors;
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

Result<std::optional<std::vector<std::uint32_t>>> read_triangles(const GltfDocument& document,
                                                                 const Json& primitive,
                                                                 const std::string& place,
                                                                 std::size_t vertices) {
  using Triangles = std::optional<std::vector<std::uint32_t>>;
  const Json& mode_value = member(primitive, "mode");
  const int mode = mode_value.is_null() ? triangles : index_of(mode_value);
  if (mode >= 0 && mode < triangles) return Triangles{};
  if (mode < 0 || mode > fan)
    return fail(Code::gltf_malformed, document.file, place + "/mode", "unknown mode");
  std::vector<std::uint32_t> list(vertices);
  std::iota(list.begin(), list.end(), 0U);
  if (const Json& accessor = member(primitive, "indices"); !accessor.is_null()) {
    const std::string where = place + "/indices";
    Result<std::vector<std::uint32_t>> read = read_indices(document, index_of(accessor), where);
    if (!read) return tl::unexpected<Error>(std::move(read.error()));
    list = std::move(*read);
    const auto bad = std::find_if(list.begin(), list.end(), [&](std::uint32_t i) { return i >= vertices; });
    if (bad != list.end()) {
      return fail(Code::gltf_malformed, document.file, where,
                  fmt::format("index {} of {} vertices", *bad, vertices));
    }
  }
  if (mode == triangles) {
    list.resize(list.size() / 3 * 3);
    return Triangles(std::move(list));
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
  return Triangles(std::move(expanded));
}

Result<std::optional<ScenePrimitive>> read_primitive(const GltfDocument& document, const Json& primitive,
                                                     const std::string& place, std::size_t vertex_limit) {
  ScenePrimitive result;
  result.material = index_of(member(primitive, "material"));
  const Json& position = member(member(primitive, "attributes"), "POSITION");
  if (position.is_null()) return std::optional<ScenePrimitive>{};
  const Result<ElementRun> run = elements_of(document, index_of(position), place + "/attributes/POSITION");
  if (!run) return tl::unexpected<Error>(run.error());
  const std::size_t vertices = run->count;
  if (vertices > vertex_limit) return fail(Code::file_too_large, document.file, place, "too many vertices");

  auto indices = read_triangles(document, primitive, place, vertices);
  if (!indices) return tl::unexpected<Error>(std::move(indices.error()));
  if (!*indices) return std::optional<ScenePrimitive>{};
  result.indices = std::move(**indices);

  auto positions = read_vectors<V3f>(document, primitive, "POSITION", 3, 0, place);
  auto normals = read_vectors<V3f>(document, primitive, "NORMAL", 3, vertices, place);
  auto tangents = read_vectors<V4f>(document, primitive, "TANGENT", 4, vertices, place);
  auto uv0 = read_vectors<V2d>(document, primitive, "TEXCOORD_0", 2, vertices, place);
  auto uv1 = read_vectors<V2d>(document, primitive, "TEXCOORD_1", 2, vertices, place);
  if (!positions) return tl::unexpected<Error>(std::move(positions.error()));
  if (!normals) return tl::unexpected<Error>(std::move(normals.error()));
  if (!tangents) return tl::unexpected<Error>(std::move(tangents.error()));
  if (!uv0) return tl::unexpected<Error>(std::move(uv0.error()));
  if (!uv1) return tl::unexpected<Error>(std::move(uv1.error()));
  result.positions = std::move(*positions);
  result.normals = std::move(*normals);
  result.tangents = std::move(*tangents);
  result.tex_coords = {std::move(*uv0), std::move(*uv1)};
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
    return M44d(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9], m[10], m[11], m[12], m[13], m[14],
                m[15]);
  }
  std::array<double, 3> t{0, 0, 0};
  std::array<double, 4> r{0, 0, 0, 1};
  std::array<double, 3> s{1, 1, 1};
  if (!numbers(member(node, "translation"), t) || !numbers(member(node, "rotation"), r) ||
      !numbers(member(node, "scale"), s)) {
    return std::nullopt;
  }
  const Imath::Quatd rotation = Imath::Quatd(r[3], r[0], r[1], r[2]).normalized();
  M44d scale;
  scale.setScale(V3d(s[0], s[1], s[2]));
  M44d translation;
  translation.setTranslation(V3d(t[0], t[1], t[2]));
  return scale * rotation.toMatrix44() * translation;
}

}  // namespace selvedge
