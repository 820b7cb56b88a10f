#include "converter/dress/unwrap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "converter/dress/charts.h"
#include "converter/dress/fabric_source.h"
#include "format/base/guard.h"
#include "format/gltf/edit.h"
#include "format/gltf/geometry.h"
#include "format/gltf/meshopt.h"
#include "format/scene/tangents.h"

namespace selvedge {
namespace {

constexpr double uv_step = 0x1p-20;  ///< metres

/// Values of attributes, by semantic.
using Columns = std::map<std::string, std::vector<Imath::V4d>>;

/// Unit normals: the given ones, or by the triangles around where those have no direction or are missing.
std::vector<V3d> unit_normals(std::vector<V3d> given, const std::vector<V3d>& positions,
                              const std::vector<std::uint32_t>& triangles) {
  constexpr double tolerance = 1e-4;  // within it they stay as they are
  const std::vector<V3d> sums = normal_sums(positions, triangles);
  given.resize(positions.size(), V3d(0, 0, 0));
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (!(given[i].length() > 0)) given[i] = sums[i].length() > 0 ? sums[i] : V3d(0, 0, 1);
    if (std::abs(given[i].length() - 1) > tolerance) given[i].normalize();
  }
  return given;
}

/// Joints of a vertex without weight become 0, none stays twice, and the sum of the weights becomes 1.
void mend_skin(Columns& skin, std::size_t vertex) {
  constexpr double tolerance = 2e-7;
  std::vector<double*> joints;
  std::vector<double*> weights;
  for (auto& [semantic, values] : skin)
    for (int c = 0; c < 4; ++c)
      (semantic.starts_with("JOINTS") ? joints : weights).push_back(&values[vertex][c]);
  constexpr std::size_t max_joints = 16;
  if (joints.size() != weights.size() || joints.size() > max_joints) return;
  double sum = 0;
  for (std::size_t s = 0; s < joints.size(); ++s) {
    *weights[s] = std::max(*weights[s], 0.0);
    sum += *weights[s];
    for (std::size_t earlier = 0; earlier < s; ++earlier)
      if (*joints[earlier] == *joints[s]) *weights[earlier] += std::exchange(*weights[s], 0);
    if (*weights[s] == 0) *joints[s] = 0;
  }
  if (!(sum > 0) || std::abs(sum - 1) <= tolerance) return;
  for (double* const weight : weights) *weight /= sum;
}

class Unwrapper {
 public:
  Unwrapper(GltfDocument& document, int tex_coord, const PrimitivesInScene& in_scene)
      : document_(document),
        set_(tex_coord),
        semantic_(fmt::format("TEXCOORD_{}", tex_coord)),
        in_scene_(in_scene) {}

  UnwrapReport unwrap(const std::set<PrimitiveIndex>& places) {
    for (const PrimitiveIndex& place : places) need_first_set(place);
    for (const PrimitiveIndex& place : places) unwrap(place);
    if (result_.chart_count == 0)
      throw Failure{Error{Code::garment_empty, document_.file, "", "no triangle has an area to lay flat"}};
    // Nothing of them shows, but one primitive without would keep the material from being dressed.
    for (const auto& [place, vertices] : without_area_)
      primitive_at(document_, place)["attributes"][semantic_] = append(std::vector<V2f>(vertices, V2f(0)));
    return result_;
  }

 private:
  void need_first_set(const PrimitiveIndex& place) {
    if (set_ == 0 || member(primitive_at(document_, place), "attributes").contains("TEXCOORD_0")) return;
    throw Failure{Error{Code::garment_no_uvs, document_.file, member_pointer(place) + "/attributes",
                        "no TEXCOORD_0, without which there is no " + semantic_}};
  }

  template <class Vector>
  int append(const std::vector<Vector>& values, int component_type = 5126) {
    const bool normalized = component_type == 5120 || component_type == 5122;
    return append_accessor(document_, floats_of(values),
                           {0, static_cast<int>(Vector::dimensions()), component_type, normalized});
  }

  void unwrap(const PrimitiveIndex& place) {
    const std::string where = member_pointer(place);
    Json json = primitive_at(document_, place);
    Json& attributes = json["attributes"];
    GltfReader reader(document_);
    std::vector<V3d> positions = reader.attribute<V3d>(attributes, "POSITION", 0, where + "/attributes");
    const std::vector<std::uint32_t> triangles = read_triangles(reader, json, where, positions.size());
    PrimitiveInScene seen;
    if (const auto found = in_scene_.find(place); found != in_scene_.end()) seen = found->second;
    const double local = twice_area_of(positions, triangles);
    const auto leave = [&] {
      if (!attributes.contains(semantic_)) without_area_.emplace(place, positions.size());
    };
    if (!(local > 0)) return leave();
    const double metres = seen.twice_area > 0 ? std::sqrt(seen.twice_area / local) : 1;
    for (V3d& p : positions) p *= metres;
    const std::vector<V3d> given =
        reader.attribute<V3d>(attributes, "NORMAL", positions.size(), where + "/attributes");
    const std::vector<V3d> normals = unit_normals(given, positions, triangles);
    Charts charts = cut_into_charts(positions, triangles, seen.down_direction, top_);
    if (charts.count == 0) return leave();
    result_.had_uvs |= attributes.contains(semantic_);
    attributes.erase(semantic_);
    std::vector<V4f> tangents;
    if (attributes.contains("TANGENT") && !given.empty())
      tangents = tangents_of(reader, json, where + "/attributes", charts, positions, normals);
    const int tangent_type = type_of(member(attributes, "TANGENT"));
    drop_attribute(json, "TANGENT");
    Columns mended = take_faulty_skin(reader, attributes, where + "/attributes", positions.size());
    const bool bent = given != normals && !given.empty() && type_of(attributes["NORMAL"]) == 5126;
    if (bent) attributes.erase("NORMAL");
    std::vector<std::uint32_t> sources;
    std::vector<V2f> uvs;
    std::vector<V3f> straight;
    std::vector<V4f> turned;
    for (const std::uint32_t vertex : order_triangles(charts.indices, charts.source_vertices.size())) {
      sources.push_back(charts.source_vertices[vertex]);
      // Encoders take whole multiples without loss, and of steps that are no finer than need be in fewer
      // bytes.
      const V2d uv = charts.uvs[vertex] / uv_step;
      uvs.emplace_back(V2d(std::round(uv.x), std::round(uv.y)) * uv_step);
      if (bent) straight.emplace_back(normals[sources.back()]);
      if (!tangents.empty()) turned.push_back(tangents[vertex]);
    }
    gather_vertices(document_, reader, json, sources, where);
    attributes[semantic_] = append(uvs);
    if (bent) attributes["NORMAL"] = append(straight);
    for (const auto& [semantic, values] : mended) {
      std::vector<V4f> copies;
      for (const std::uint32_t source : sources) copies.emplace_back(values[source]);
      attributes[semantic] = append(copies, semantic.starts_with("JOINTS") ? 5123 : 5126);
    }
    if (!turned.empty()) attributes["TANGENT"] = append(turned, tangent_type);
    json["indices"] = append_index_accessor(document_, charts.indices);
    json.erase("mode");
    primitive_at(document_, place) = std::move(json);
    result_.chart_count += charts.count;
  }

  int type_of(const Json& accessor) {
    return index_of(member(root_entry(document_, "accessors", index_of(accessor)), "componentType"));
  }

  /// Tangents of the charts' vertices along the set of the normal texture, empty without that; vertices that
  /// need several get copies.
  std::vector<V4f> tangents_of(GltfReader& reader, const Json& json, const std::string& place, Charts& charts,
                               const std::vector<V3d>& positions, const std::vector<V3d>& normals) {
    const Json& material = root_entry(document_, "materials", index_of(member(json, "material")));
    const int set = std::max(0, index_of(member(member(material, "normalTexture"), "texCoord")));
    const std::vector<V2d> others = reader.attribute<V2d>(
        json["attributes"], fmt::format("TEXCOORD_{}", set).c_str(), positions.size(), place);
    if (set != set_ && others.empty()) return {};
    std::vector<V3d> corners;
    std::vector<V3d> directions;
    std::vector<V2d> uvs;
    for (std::size_t i = 0; i < charts.source_vertices.size(); ++i) {
      corners.push_back(positions[charts.source_vertices[i]]);
      directions.push_back(normals[charts.source_vertices[i]]);
      uvs.push_back(set == set_ ? charts.uvs[i] : others[charts.source_vertices[i]]);
    }
    Tangents made = compute_tangents(corners, directions, uvs, charts.indices, Facing::winding);
    for (const std::uint32_t vertex : made.copy_sources) {
      charts.source_vertices.push_back(charts.source_vertices[vertex]);
      charts.uvs.push_back(charts.uvs[vertex]);
    }
    charts.indices = std::move(made.indices);
    for (std::size_t i = 0; i < made.tangents.size(); ++i) {
      V4f& t = made.tangents[i];
      if (t.x != 0 || t.y != 0 || t.z != 0) continue;
      const V3d& n = normals[charts.source_vertices[i]];
      const V3f aside(n.cross(std::abs(n.x) < 0.5 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized());
      t = V4f(aside.x, aside.y, aside.z, t.w);
    }
    return std::move(made.tangents);
  }

  /// Takes the joints and weights out and mends them if some have a fault, which every copy would repeat.
  static Columns take_faulty_skin(GltfReader& reader, Json& attributes, const std::string& place,
                                  std::size_t vertices) {
    Columns skin;
    for (const auto& [semantic, accessor] : attributes.items())
      if (semantic.starts_with("JOINTS") || semantic.starts_with("WEIGHTS"))
        skin[semantic] = reader.attribute<Imath::V4d>(attributes, semantic.c_str(), vertices, place);
    if (skin.empty()) return skin;
    const Columns given = skin;
    for (std::size_t i = 0; i < vertices; ++i) mend_skin(skin, i);
    if (skin == given) return {};
    for (const auto& [semantic, values] : skin) attributes.erase(semantic);
    return skin;
  }

  GltfDocument& document_;
  int set_;
  std::string semantic_;
  const PrimitivesInScene& in_scene_;
  double top_ = 0;
  std::map<PrimitiveIndex, std::size_t> without_area_;  ///< and without coordinates: the number of vertices
  UnwrapReport result_;
};

}  // namespace

void gather_vertices(GltfDocument& document, GltfReader& reader, Json& primitive,
                     const std::vector<std::uint32_t>& sources, const std::string& place) {
  std::map<int, int> made;  // by the accessor of which it is a copy: many may name one
  const auto gather = [&](int accessor, const std::string& where) {
    AccessorShape shape = reader.accessor_shape(accessor, where);
    const auto size = static_cast<std::ptrdiff_t>(shape.element_size());
    const std::vector<std::uint8_t> elements = reader.elements(accessor, where);
    std::vector<std::uint8_t> gathered;
    for (const std::uint32_t source : sources) {
      if (source >= shape.count)
        reader.fail(Code::gltf_malformed, where, fmt::format("there is no element {}", source));
      const auto first = elements.begin() + source * size;
      gathered.insert(gathered.end(), first, first + size);
    }
    shape.count = sources.size();
    Json json = document.json["accessors"][accessor];
    json.erase("byteOffset");
    json.erase("sparse");
    json["bufferView"] = append_attribute_view(document, shape, gathered);
    json["count"] = shape.count;
    if (json.contains("min") || json.contains("max"))
      set_bounds(json, to_floats(gathered, shape.component_type, false), shape.components);
    return append(document.json["accessors"], std::move(json));
  };
  const auto gather_all = [&](Json& attributes, const std::string& where) {
    for (const auto& [semantic, accessor] : attributes.items()) {
      const auto [known, fresh] = made.try_emplace(index_of(accessor), -1);
      if (fresh) known->second = gather(known->first, where + "/" + semantic);
      accessor = known->second;
    }
  };
  gather_all(primitive["attributes"], place + "/attributes");
  if (!primitive.contains("targets")) return;
  for (Json& target : primitive["targets"]) gather_all(target, place + "/targets");
}

Result<UnwrapReport> unwrap(GltfDocument& document, const std::set<PrimitiveIndex>& places, int tex_coord,
                            const PrimitivesInScene& in_scene) {
  return catch_failure([&] { return Unwrapper(document, tex_coord, in_scene).unwrap(places); });
}

}  // namespace selvedge
