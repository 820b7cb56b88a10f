#include "converter/dress/unwrap.h"

#include <fmt/format.h>

#include <cmath>

#include "converter/dress/charts.h"
#include "converter/dress/gather_vertices.h"
#include "format/base/guard.h"
#include "format/gltf/edit.h"
#include "format/gltf/geometry.h"
#include "format/gltf/meshopt.h"

namespace selvedge {
namespace {

constexpr double uv_step = 0x1p-20;  ///< metres

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
    result_.stretch = stretch_below(std::move(stretch_), 0.95);
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
    Charts charts = cut_into_charts(positions, triangles, seen.down, top_);
    if (charts.count == 0) return leave();
    std::vector<std::uint32_t> sources;
    std::vector<V2d> uvs;
    for (const std::uint32_t vertex : order_triangles(charts.indices, charts.sources.size())) {
      sources.push_back(charts.sources[vertex]);
      // Encoders take whole multiples without loss, and of steps that are no finer than need be in fewer
      // bytes.
      const V2d uv = charts.uvs[vertex] / uv_step;
      uvs.push_back(V2d(std::round(uv.x), std::round(uv.y)) * uv_step);
    }
    if (attributes.contains(semantic_)) drop_tangents(json);  // of a normal texture on the set
    result_.replaced |= attributes.contains(semantic_);
    attributes.erase(semantic_);
    gather_vertices(document_, reader, json, sources, where);
    set_uvs(json, uvs);
    json["indices"] = append_index_accessor(document_, charts.indices);
    json.erase("mode");
    json_of(place) = std::move(json);
    result_.charts += charts.count;
    stretch_.insert(stretch_.end(), charts.stretch.begin(), charts.stretch.end());
  }

  GltfDocument& document_;
  int set_;
  std::string semantic_;
  const PlacesInScene& in_scene_;
  double top_ = 0;
  std::map<Place, std::size_t> without_area_;  ///< and without coordinates: the number of vertices
  Unwrapped result_;
  std::vector<ChartStretch> stretch_;
};

}  // namespace

Result<Unwrapped> unwrap(GltfDocument& document, const std::set<Place>& places, int tex_coord,
                         const PlacesInScene& in_scene) {
  return result_of([&] { return Unwrapper(document, tex_coord, in_scene).unwrap(places); });
}

}  // namespace selvedge
