#include "converter/dress/unwrap.h"

#include <fmt/format.h>

#include <cmath>

#include "converter/dress/add_tangents.h"
#include "converter/dress/charts.h"
#include "converter/dress/gather_vertices.h"
#include "converter/dress/places_in_scene.h"
#include "format/base/guard.h"
#include "format/gltf/edit.h"
#include "format/gltf/geometry.h"

namespace selvedge {
namespace {

/// Bytes: lists of edges and neighbours, and the equations of the charts with their factors.
constexpr std::uint64_t triangle_price = 2048;
constexpr std::uint64_t vertex_price = 512;

class Unwrapper {
 public:
  Unwrapper(GltfDocument& document, int tex_coord, const Scene& scene, MemoryAccount& memory)
      : document_(document),
        set_(tex_coord),
        semantic_(fmt::format("TEXCOORD_{}", tex_coord)),
        in_scene_(places_in(scene)),
        memory_(memory) {}

  Unwrapped unwrap(const std::set<Place>& places) {
    for (const Place& place : places) unwrap(place);
    if (result_.charts == 0)
      throw Failure{Error{Code::garment_empty, document_.file, "", "no triangle has an area to lay flat"}};
    result_.stretch = stretch_below(std::move(stretch_), 0.95);
    return result_;
  }

 private:
  void unwrap(const Place& place) {
    const std::string where = fmt::format("/meshes/{}/primitives/{}", place.first, place.second);
    drop_tangents(document_, place.first, place.second);
    Json json = document_.json["meshes"][place.first]["primitives"][place.second];
    Json& attributes = json["attributes"];
    if (set_ > 0 && !attributes.contains("TEXCOORD_0")) {
      throw Failure{Error{Code::garment_no_uvs, document_.file, where + "/attributes",
                          "no TEXCOORD_0, without which there is no " + semantic_}};
    }
    GltfReader reader(document_);
    const auto take = [&](std::size_t count, std::uint64_t price) {
      if (reader.fault) throw Failure{*reader.fault};
      if (!memory_.take(count, price))
        throw Failure{beyond_memory(document_.file, where, "its charts", memory_.limit())};
    };
    take(
        reader.accessor_shape(index_of(member(attributes, "POSITION")), where + "/attributes/POSITION").count,
        vertex_price);
    std::vector<V3d> positions = reader.attribute<V3d>(attributes, "POSITION", 0, where + "/attributes");
    const std::vector<std::uint32_t> triangles = read_triangles(reader, json, where, positions.size());
    take(triangles.size() / 3, triangle_price);
    PlaceInScene seen;
    if (const auto found = in_scene_.find(place); found != in_scene_.end()) seen = found->second;
    const double local = area_of(positions, triangles);
    if (!(local > 0)) return;
    const double metres = seen.area > 0 ? std::sqrt(seen.area / local) : 1;
    for (V3d& p : positions) p *= metres;
    Charts charts = cut_into_charts(positions, triangles, seen.down, top_);
    if (charts.count == 0) return;
    result_.replaced |= attributes.contains(semantic_);
    attributes.erase(semantic_);
    gather_vertices(document_, reader, json, charts.sources, where);
    take(0, 0);
    std::vector<float> uvs;
    for (const V2d& uv : charts.uvs)
      uvs.insert(uvs.end(), {static_cast<float>(uv.x), static_cast<float>(uv.y)});
    json["attributes"][semantic_] = append_float_accessor(document_, uvs, 2, false);
    json["indices"] = append_index_accessor(document_, charts.indices);
    json.erase("mode");
    document_.json["meshes"][place.first]["primitives"][place.second] = std::move(json);
    result_.charts += charts.count;
    stretch_.insert(stretch_.end(), charts.stretch.begin(), charts.stretch.end());
  }

  GltfDocument& document_;
  int set_;
  std::string semantic_;
  std::map<Place, PlaceInScene> in_scene_;
  MemoryAccount& memory_;
  double top_ = 0;
  Unwrapped result_;
  std::vector<ChartStretch> stretch_;
};

}  // namespace

Result<Unwrapped> unwrap(GltfDocument& document, const std::set<Place>& places, int tex_coord,
                         const Scene& scene, MemoryAccount& memory) {
  try {
    return Unwrapper(document, tex_coord, scene, memory).unwrap(places);
  } catch (const Failure& failure) {
    return tl::unexpected(failure.error);
  }
}

}  // namespace selvedge
