#include "converter/dress/unwrap.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "converter/dress/fabric_source.h"
#include "converter/dress/flatten.h"
#include "format/base/disjoint_sets.h"
#include "format/base/guard.h"
#include "format/gltf/edit.h"
#include "format/gltf/geometry.h"
#include "format/gltf/meshopt.h"
#include "format/scene/tangents.h"

namespace selvedge {
namespace {

using Face = std::array<std::uint32_t, 3>;
constexpr int none = -1;  // of vertices and sides

class Cutter {
 public:
  Cutter(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles, const V3d& down)
      : positions_(positions), down_(down) {
    for (std::size_t t = 0; t + 2 < triangles.size(); t += 3)
      add({triangles[t], triangles[t + 1], triangles[t + 2]});
  }

  Charts cut(double& top) {
    build_mesh();
    chart_of_ = parts(half_axes());
    join_small_parts();
    lay_flat();
    pack(top);
    return std::move(charts_);
  }

 private:
  V3d normal_of(const Face& face) const {  ///< as long as twice its area
    return (positions_[face[1]] - positions_[face[0]]).cross(positions_[face[2]] - positions_[face[0]]);
  }

  void add(const Face& face) {
    constexpr double thinnest = 1e-9;  // height over length: invisible, and too steep for the equations
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, (positions_[face[(k + 1) % 3]] - positions_[face[k]]).length2());
    if (normal_of(face).length() > thinnest * longest) faces_.push_back(face);
  }

  /// The size of a triangle in the middle.
  double size_of_face() const {
    if (faces_.empty()) return 0;
    std::vector<double> areas;
    for (const Face& face : faces_) areas.push_back(normal_of(face).length());
    const auto middle = areas.begin() + std::ssize(areas) / 2;
    std::ranges::nth_element(areas, middle);
    return std::sqrt(*middle);
  }

  /// Numbers of faces, each with an edge that an earlier one has, too, where there is one.
  std::vector<std::size_t> in_reach(const std::vector<std::uint32_t>& welded) const {
    constexpr int max_faces = 8;  // looked at on one edge
    std::vector<std::tuple<std::uint32_t, std::uint32_t, std::size_t>> edges;
    const auto edge = [&](std::size_t face, std::size_t k) {
      return std::minmax(welded[faces_[face][k]], welded[faces_[face][(k + 1) % 3]]);
    };
    for (std::size_t f = 0; f < faces_.size(); ++f)
      for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(edge(f, k).first, edge(f, k).second, f);
    std::ranges::sort(edges);
    std::vector<bool> reached(faces_.size(), false);
    std::vector<std::size_t> order;
    const auto reach = [&](std::size_t face) {
      if (!reached[face]) order.push_back(face);
      reached[face] = true;
    };
    for (std::size_t seed = 0, at = 0; seed < faces_.size(); ++seed) {
      reach(seed);
      for (; at < order.size(); ++at) {
        const std::size_t face = order[at];
        for (std::size_t k = 0; k < 3; ++k) {
          const auto [a, b] = edge(face, k);
          auto other = std::ranges::lower_bound(edges, std::tuple(a, b, std::size_t{0}));
          for (int n = 0; n < max_faces && other != edges.end(); ++n, ++other) {
            if (std::get<0>(*other) != a || std::get<1>(*other) != b) break;
            reach(std::get<2>(*other));
          }
        }
      }
    }
    return order;
  }

  void build_mesh() {
    const std::vector<std::uint32_t> welded = weld(positions_, 3e-3 * size_of_face());
    std::vector<std::size_t> open = in_reach(welded);
    // Sheets of faces; those that one refuses both ways are left to the next, and at last each has vertices
    // of its own.
    constexpr int sheets = 8;
    for (int sheet = 0; !open.empty(); ++sheet) {
      std::vector<int> vertices(positions_.size(), none);
      std::set<Face> seen;
      std::vector<std::size_t> refused;
      for (const std::size_t number : open) {
        Face corners;
        std::array<int, 3> own{none, none, none};
        for (std::size_t k = 0; k < 3; ++k) {
          corners[k] = welded[faces_[number][k]];
          int& vertex = sheet < sheets ? vertices[corners[k]] : own[k];
          if (vertex == none) {
            vertex = static_cast<int>(points_.size());
            points_.push_back(positions_[corners[k]]);
          }
          own[k] = vertex;
        }
        std::ranges::sort(corners);
        const bool fits = corners[0] != corners[1] && corners[1] != corners[2] && seen.insert(corners).second;
        bool added = false;
        for (const bool turned : {false, true}) {
          if (added || (!fits && sheet < sheets)) continue;
          added = add_to_mesh({own[0], own[turned ? 2 : 1], own[turned ? 1 : 2]});
          if (!added) continue;
          numbers_.push_back(number);
          turned_.push_back(turned);
          normals_.push_back(normal_of(faces_[number]) * (turned ? -1 : 1));
        }
        if (!added) refused.push_back(number);
      }
      open = std::move(refused);
    }
  }

  /// Adds a face with corners in this order; false where an edge has a face on that side.
  bool add_to_mesh(const V3i& corners) {
    const auto key = [&](int from, int to) { return std::pair(corners[from % 3], corners[to % 3]); };
    for (int k = 0; k < 3; ++k)
      if (halves_.contains(key(k, k + 1))) return false;
    for (int k = 0; k < 3; ++k) {
      const auto half = static_cast<int>(opposite_.size());
      halves_[key(k, k + 1)] = half;
      const auto other = halves_.find(key(k + 1, k));
      opposite_.push_back(other == halves_.end() ? none : other->second);
      if (other != halves_.end()) opposite_[other->second] = half;
    }
    corners_.push_back(corners);
    return true;
  }

  /// Calls visit(half, half on the other side) for each edge of two faces.
  template <class Visit>
  void visit_inner_edges(const Visit& visit) const {
    for (int half = 0; half < std::ssize(opposite_); ++half)
      if (opposite_[half] > half) visit(half, opposite_[half]);
  }

  /// The half axis that is nearest to each face's normal among its neighbours'.
  std::vector<int> half_axes() const {
    constexpr int rounds = 8;
    std::vector<V3d> smooth = normals_;
    for (int round = 0; round < rounds; ++round) {
      std::vector<V3d> next = smooth;
      for (std::size_t f = 0; f < faces_.size(); ++f) {
        for (std::size_t half = 3 * f; half < 3 * f + 3; ++half)
          if (opposite_[half] != none) next[f] += smooth[opposite_[half] / 3];
        next[f] *= 0.25;
      }
      smooth = std::move(next);
    }
    std::vector<int> labels;
    for (const V3d& n : smooth) {
      int axis = 2;  // of equal ones, front and back
      for (const int other : {0, 1})
        if (std::abs(n[other]) > std::abs(n[axis])) axis = other;
      labels.push_back(2 * axis + (n[axis] < 0 ? 1 : 0));
    }
    return labels;
  }

  /// The faces of one label that hang together have one number, of the first of them.
  std::vector<int> parts(const std::vector<int>& labels) const {
    DisjointSets sets(faces_.size());
    visit_inner_edges([&](int half, int other) {
      const int a = sets.root(half / 3), b = sets.root(other / 3);
      if (labels[a] == labels[b]) sets.unite(std::max(a, b), std::min(a, b));
    });
    std::vector<int> part;
    for (int face = 0; face < static_cast<int>(faces_.size()); ++face) part.push_back(sets.root(face));
    return part;
  }

  void join_small_parts() {
    constexpr double small = 0.01;
    const std::vector<int> whole = parts(std::vector<int>(faces_.size(), 0));
    std::vector<double> areas(faces_.size(), 0);
    std::vector<double> wholes(faces_.size(), 0);
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      areas[chart_of_[f]] += normals_[f].length();
      wholes[whole[f]] += normals_[f].length();
    }
    // Rounds, in each of which every small part that has a neighbour joins one: half as many are left.
    DisjointSets joined(areas.size());
    for (bool again = true; again;) {
      again = false;
      std::map<std::pair<int, int>, double> borders;  // of small parts, with whom, and how long
      visit_inner_edges([&](int half, int twin) {
        const V3i& ends = corners_[half / 3];
        const double length = (points_[ends[(half + 1) % 3]] - points_[ends[half % 3]]).length();
        for (const auto& [face, beside] : {std::pair(half / 3, twin / 3), std::pair(twin / 3, half / 3)}) {
          const int part = joined.root(chart_of_[face]), other = joined.root(chart_of_[beside]);
          if (part != other && areas[part] < small * wholes[whole[face]]) borders[{part, other}] += length;
        }
      });
      for (auto at = borders.begin(); at != borders.end();) {
        const int part = at->first.first;
        auto longest = at;
        for (; at != borders.end() && at->first.first == part; ++at)
          if (at->second > longest->second) longest = at;
        const int from = joined.root(part);
        const int to = joined.root(longest->first.second);
        if (from == to) continue;  // they have joined each other
        joined.unite(from, to);
        areas[to] += areas[from];
        again = true;
      }
    }
    for (int& part : chart_of_) part = joined.root(part);
  }

  void lay_flat() {
    charts_.indices.resize(3 * faces_.size());
    std::map<int, std::vector<std::size_t>> members;
    for (std::size_t f = 0; f < faces_.size(); ++f) members[chart_of_[f]].push_back(f);
    for (const auto& [chart, faces] : members) {
      ClothPanel panel;
      std::map<int, int> local;
      for (const std::size_t f : faces) {
        V3i triangle;
        for (int k = 0; k < 3; ++k) {
          const int vertex = corners_[f][k];
          const auto [entry, fresh] = local.try_emplace(vertex, static_cast<int>(panel.positions.size()));
          if (fresh) panel.positions.push_back(points_[vertex]);
          triangle[k] = entry->second;
        }
        panel.triangles.push_back(triangle);
      }
      std::vector<V2d> plane;
      if (is_simple(faces, panel)) plane = flatten(panel);
      const auto is_turned_over = [&](const V3i& t) {
        return !((plane[t[1]] - plane[t[0]]) % (plane[t[2]] - plane[t[0]]) > 0);
      };
      if (plane.empty() || std::ranges::any_of(panel.triangles, is_turned_over)) plane = projected(panel);
      for (V2d& p : plane) p.y = -p.y;  // v of glTF grows downwards
      turn(panel, plane);
      add_chart(faces, panel, plane);
    }
  }

  /// Whether the equations of a chart are as sparse as for a disc, by Euler's number: a hole takes one
  /// from it and a handle two, and many handles tie everything to everything. One triangle needs none.
  bool is_simple(const std::vector<std::size_t>& faces, const ClothPanel& panel) const {
    constexpr std::ptrdiff_t max_holes = 64;
    std::ptrdiff_t halves = 0;  // of edges
    for (const std::size_t f : faces)
      for (std::size_t half = 3 * f; half < 3 * f + 3; ++half)
        halves += opposite_[half] != none && chart_of_[opposite_[half] / 3] == chart_of_[f] ? 1 : 2;
    return faces.size() > 1 && std::ssize(panel.positions) - halves / 2 + std::ssize(faces) >= 1 - max_holes;
  }

  static std::vector<V2d> projected(const ClothPanel& panel) {
    V3d normal(0, 0, 0);
    for (const V3i& t : panel.triangles)
      normal += (panel.positions[t[1]] - panel.positions[t[0]])
                    .cross(panel.positions[t[2]] - panel.positions[t[0]]);
    normal = normal.length() > 0 ? normal.normalized() : V3d(0, 0, 1);
    const V3d x = normal.cross(std::abs(normal.x) < 0.5 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized();
    const V3d y = normal.cross(x);
    std::vector<V2d> plane;
    for (const V3d& p : panel.positions) plane.emplace_back(p.dot(x), p.dot(y));
    return plane;
  }

  /// Turns the plane so that what hangs lower has a larger v in the mean.
  void turn(const ClothPanel& panel, std::vector<V2d>& plane) const {
    V2d slope = area_weighted_gradient(panel, plane, down_);
    if (!(slope.length() > 0)) return;
    slope.normalize();
    for (V2d& p : plane) p = V2d(p.x * slope.y - p.y * slope.x, p.x * slope.x + p.y * slope.y);
  }

  void add_chart(const std::vector<std::size_t>& faces, const ClothPanel& panel,
                 const std::vector<V2d>& plane) {
    std::map<std::pair<std::uint32_t, int>, std::uint32_t> fresh;  // by vertices of surface and panel
    Imath::Box2d box;
    for (const V2d& p : plane) box.extendBy(p);
    const std::size_t first = charts_.uvs.size();
    for (std::size_t i = 0; i < faces.size(); ++i) {
      const std::size_t number = numbers_[faces[i]];
      for (int k = 0; k < 3; ++k) {
        const auto corner = static_cast<std::size_t>(turned_[faces[i]] ? (3 - k) % 3 : k);
        const std::uint32_t source = faces_[number][corner];
        const int flat = panel.triangles[i][k];
        const auto [entry, is_new] = fresh.try_emplace({source, flat}, charts_.source_vertices.size());
        if (is_new) {
          charts_.source_vertices.push_back(source);
          charts_.uvs.push_back(plane[flat] - box.min);
        }
        charts_.indices[3 * number + corner] = entry->second;
      }
    }
    placed_.push_back({box.size(), first, charts_.uvs.size()});
    ++charts_.count;
  }

  /// In rows, the tallest first.
  void pack(double& top) {
    constexpr double gap = 0.01;  // m
    std::ranges::stable_sort(placed_, [](const Placed& a, const Placed& b) { return a.size.y > b.size.y; });
    double area = 0;
    double width = 0;
    for (const Placed& p : placed_) {
      area += (p.size.x + gap) * (p.size.y + gap);
      width = std::max(width, p.size.x);
    }
    width = std::max(width, 1.2 * std::sqrt(area));
    V2d at(0, top);
    double below = top;
    for (const Placed& p : placed_) {
      if (at.x > 0 && at.x + p.size.x > width) at = V2d(0, below);
      for (std::size_t i = p.first; i < p.end; ++i) charts_.uvs[i] += at;
      at.x += p.size.x + gap;
      below = std::max(below, at.y + p.size.y + gap);
    }
    top = below;
  }

  /// A chart's place in the list of new vertices.
  struct Placed {
    V2d size;
    std::size_t first = 0;
    std::size_t end = 0;
  };

  const std::vector<V3d>& positions_;
  V3d down_;
  std::vector<V3d> points_;    ///< by vertex of the mesh
  std::vector<V3i> corners_;   ///< of faces of the mesh, whose edges have two faces, one on each side
  std::vector<int> opposite_;  ///< by 3 * face + k, the side of an edge from corner k on: the other side
  std::map<std::pair<int, int>, int> halves_;  ///< sides by the vertices of their edges
  std::vector<Face> faces_;                    ///< of the surface, those with an area
  std::vector<std::size_t> numbers_;           ///< by face of the mesh, as all below: in faces_
  std::vector<bool> turned_;  ///< its corners run the other way in the mesh, as its neighbours' do
  std::vector<V3d> normals_;  ///< as long as twice the area
  std::vector<int> chart_of_;
  std::vector<Placed> placed_;
  Charts charts_;
};

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
      : document_(document), set_(tex_coord), in_scene_(in_scene) {}

  UnwrapReport unwrap(const std::set<PrimitiveIndex>& places) {
    for (const PrimitiveIndex& place : places)
      if (set_ > 0 && !member(primitive_at(document_, place), "attributes").contains("TEXCOORD_0"))
        throw Failure{Error{Code::garment_no_uvs, document_.file, member_pointer(place) + "/attributes",
                            "no TEXCOORD_0, without which there is no " + semantic_}};
    for (const PrimitiveIndex& place : places) unwrap(place);
    if (result_.chart_count == 0)
      throw Failure{Error{Code::garment_empty, document_.file, "", "no triangle has an area to lay flat"}};
    // Nothing of them shows, but one primitive without would keep the material from being dressed.
    for (const auto& [place, vertices] : without_area_)
      primitive_at(document_, place)["attributes"][semantic_] = append(std::vector<V2f>(vertices, V2f(0)));
    return result_;
  }

 private:
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
  std::string semantic_ = fmt::format("TEXCOORD_{}", set_);
  const PrimitivesInScene& in_scene_;
  double top_ = 0;
  std::map<PrimitiveIndex, std::size_t> without_area_;  ///< and without coordinates: the number of vertices
  UnwrapReport result_;
};

}  // namespace

Charts cut_into_charts(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles,
                       const V3d& down, double& top) {
  return Cutter(positions, triangles, down).cut(top);
}

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
