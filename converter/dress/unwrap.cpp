#include "converter/dress/unwrap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "converter/dress/charts.h"
#include "converter/dress/gather_vertices.h"
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
  std::vector<V3d> sums(positions.size(), V3d(0, 0, 0));
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const V3d& a = positions[triangles[t]];
    const V3d normal = (positions[triangles[t + 1]] - a).cross(positions[triangles[t + 2]] - a);
    for (std::size_t k = 0; k < 3; ++k) sums[triangles[t + k]] += normal;
  }
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
  Unwrapper(GltfDocument& document, int tex_coord, const PlacesInScene& in_scene)
      : document_(document),
        set_(tex_coord),
        semantic_(fmt::format("TEXCOORD_{}", tex_coord)),
        in_scene_(in_scene) {}

  Unwrapped unwrap(const std::set<Place>& places) {
    for (const Place& place : places) need_first_set(place);
    for (const Place& place : places) unwrap(place);
    if (result_.charts == 0)
      throw Failure{Error{Code::garment_empty, document_.file, "", "no triangle has an area to lay flat"}};
    // Nothing of them shows, but one primitive without would keep the material from being dressed.
    for (const auto& [place, vertices] : without_area_)
      set_uvs(json_of(place), std::vector<V2d>(vertices, V2d(0, 0)));
    return result_;
  }

 private:
  static std::string where_is(const Place& place) {
    return fmt::format("/meshes/{}/primitives/{}", place.first, place.second);
  }

  Json& json_of(const Place& place) {
    return document_.json["meshes"][place.first]["primitives"][place.second];
  }

  void need_first_set(const Place& place) {
    if (set_ == 0 || member(json_of(place), "attributes").contains("TEXCOORD_0")) return;
    throw Failure{Error{Code::garment_no_uvs, document_.file, where_is(place) + "/attributes",
                        "no TEXCOORD_0, without which there is no " + semantic_}};
  }

  void set_uvs(Json& json, const std::vector<V2d>& coordinates) {
    std::vector<float> uvs;
    for (const V2d& uv : coordinates)
      uvs.insert(uvs.end(), {static_cast<float>(uv.x), static_cast<float>(uv.y)});
    json["attributes"][semantic_] = append_float_accessor(document_, uvs, 2, false);
  }

  void unwrap(const Place& place) {
    const std::string where = where_is(place);
    Json json = json_of(place);
    Json& attributes = json["attributes"];
    GltfReader reader(document_);
    std::vector<V3d> positions = reader.attribute<V3d>(attributes, "POSITION", 0, where + "/attributes");
    const std::vector<std::uint32_t> triangles = read_triangles(reader, json, where, positions.size());
    PlaceInScene seen;
    if (const auto found = in_scene_.find(place); found != in_scene_.end()) seen = found->second;
    const double local = area_of(positions, triangles);
    const auto leave = [&] {
      if (!attributes.contains(semantic_)) without_area_.emplace(place, positions.size());
    };
    if (!(local > 0)) return leave();
    const double metres = seen.area > 0 ? std::sqrt(seen.area / local) : 1;
    for (V3d& p : positions) p *= metres;
    const std::vector<V3d> given =
        reader.attribute<V3d>(attributes, "NORMAL", positions.size(), where + "/attributes");
    const std::vector<V3d> normals = unit_normals(given, positions, triangles);
    Charts charts = cut_into_charts(positions, triangles, seen.down, top_);
    if (charts.count == 0) return leave();
    result_.replaced |= attributes.contains(semantic_);
    attributes.erase(semantic_);
    std::vector<V4f> tangents;
    if (attributes.contains("TANGENT") && !given.empty())
      tangents = tangents_of(reader, json, where + "/attributes", charts, positions, normals);
    const int tangent_type = type_of(member(attributes, "TANGENT"));
    drop_tangents(json);
    Columns mended = take_faulty_skin(reader, attributes, where + "/attributes", positions.size());
    if (given != normals && !given.empty() && type_of(attributes["NORMAL"]) == 5126) {
      attributes.erase("NORMAL");
      for (const V3d& n : normals) mended["NORMAL"].emplace_back(n.x, n.y, n.z, 0);
    }
    std::vector<std::uint32_t> sources;
    std::vector<V2d> uvs;
    std::vector<V4f> turned;
    for (const std::uint32_t vertex : order_triangles(charts.indices, charts.sources.size())) {
      sources.push_back(charts.sources[vertex]);
      // Encoders take whole multiples without loss, and of steps that are no finer than need be in fewer
      // bytes.
      const V2d uv = charts.uvs[vertex] / uv_step;
      uvs.push_back(V2d(std::round(uv.x), std::round(uv.y)) * uv_step);
      if (!tangents.empty()) turned.push_back(tangents[vertex]);
    }
    gather_vertices(document_, reader, json, sources, where);
    set_uvs(json, uvs);
    for (const auto& [semantic, values] : mended) set_column(attributes, semantic, values, sources);
    if (!turned.empty()) attributes["TANGENT"] = append_vec4(floats_of(turned), tangent_type);
    json["indices"] = append_index_accessor(document_, charts.indices);
    json.erase("mode");
    json_of(place) = std::move(json);
    result_.charts += charts.count;
  }

  int type_of(const Json& accessor) {
    return index_of(member(entry_of(document_, "accessors", index_of(accessor)), "componentType"));
  }

  /// Tangents of the charts' vertices along the set of the normal texture, empty without that; vertices that
  /// need several get copies.
  std::vector<V4f> tangents_of(GltfReader& reader, const Json& json, const std::string& place, Charts& charts,
                               const std::vector<V3d>& positions, const std::vector<V3d>& normals) {
    const Json& material = entry_of(document_, "materials", index_of(member(json, "material")));
    const int set = std::max(0, index_of(member(member(material, "normalTexture"), "texCoord")));
    const std::vector<V2d> others = reader.attribute<V2d>(
        json["attributes"], fmt::format("TEXCOORD_{}", set).c_str(), positions.size(), place);
    if (set != set_ && others.empty()) return {};
    std::vector<V3d> corners;
    std::vector<V3d> directions;
    std::vector<V2d> uvs;
    for (std::size_t i = 0; i < charts.sources.size(); ++i) {
      corners.push_back(positions[charts.sources[i]]);
      directions.push_back(normals[charts.sources[i]]);
      uvs.push_back(set == set_ ? charts.uvs[i] : others[charts.sources[i]]);
    }
    Tangents made = compute_tangents(corners, directions, uvs, charts.indices, Facing::winding);
    for (const std::uint32_t vertex : made.copy_of) {
      charts.sources.push_back(charts.sources[vertex]);
      charts.uvs.push_back(charts.uvs[vertex]);
    }
    charts.indices = std::move(made.indices);
    for (std::size_t i = 0; i < made.tangents.size(); ++i) {
      V4f& t = made.tangents[i];
      if (t.x != 0 || t.y != 0 || t.z != 0) continue;
      const V3d& n = normals[charts.sources[i]];
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

  void set_column(Json& attributes, const std::string& semantic, const std::vector<Imath::V4d>& values,
                  const std::vector<std::uint32_t>& sources) {
    const int components = semantic == "NORMAL" ? 3 : 4;
    std::vector<float> floats;
    for (const std::uint32_t source : sources)
      for (int c = 0; c < components; ++c) floats.push_back(static_cast<float>(values[source][c]));
    attributes[semantic] = semantic.starts_with("JOINTS")
                               ? append_vec4(floats, 5123)
                               : append_float_accessor(document_, floats, components, false);
  }

  /// An accessor of this type: floats, whole numbers, or signed ones that stand for -1 to 1.
  int append_vec4(std::span<const float> values, int type) {
    if (type == 5126) return append_float_accessor(document_, values, 4, false);
    const AccessorShape shape{values.size() / 4, 4, type, type == 5120 || type == 5122};
    const float scale = type == 5120 ? 127 : type == 5122 ? 32767 : 1;
    Bytes bytes;
    for (const float value : values) {
      const auto number = static_cast<unsigned>(std::lround(scale * value));
      bytes.push_back(static_cast<std::uint8_t>(number));
      if (type != 5120) bytes.push_back(static_cast<std::uint8_t>(number >> 8U));
    }
    Json accessor{{"bufferView", append_attribute_view(document_, shape, bytes)},
                  {"componentType", type},
                  {"count", shape.count},
                  {"type", "VEC4"}};
    if (shape.normalized) accessor["normalized"] = true;
    return append(document_.json["accessors"], std::move(accessor));
  }

  GltfDocument& document_;
  int set_;
  std::string semantic_;
  const PlacesInScene& in_scene_;
  double top_ = 0;
  std::map<Place, std::size_t> without_area_;  ///< and without coordinates: the number of vertices
  Unwrapped result_;
};

}  // namespace

Result<Unwrapped> unwrap(GltfDocument& document, const std::set<Place>& places, int tex_coord,
                         const PlacesInScene& in_scene) {
  return result_of([&] { return Unwrapper(document, tex_coord, in_scene).unwrap(places); });
}

}  // namespace selvedge
