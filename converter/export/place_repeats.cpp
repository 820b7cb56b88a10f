#include "converter/export/place_repeats.h"

#include <Imath/ImathMatrixAlgo.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "format/base/parallel.h"
#include "format/fabric/variation.h"

namespace selvedge {
namespace {

constexpr double degree = std::numbers::pi / 180;

constexpr double bend_step = 4 * degree;
constexpr int max_steps = 12;
/// A shape with fewer copies costs more than these bent.
constexpr int fewest_copies = 8;

/// By how much the normal of the shaped surface leans at a place of the repeat.
V2d lean_at(const V3d& p, const MeshShape& shape, const RepeatFrame& frame) {
  const auto& [x, y, twist] = shape.bend;  // steps along each axis and across
  const V3d bends =
      V3d(x / frame.period.x, y / frame.period.y, twist / std::sqrt(frame.period.x * frame.period.y)) *
      bend_step;
  const V2d from(p.x - frame.period.x / 2, p.y + frame.period.y / 2);
  return {bends.x * from.x + bends.z * from.y, bends.y * from.y + bends.z * from.x};
}

/// From the frame of the repeat to the frame of the mesh.
V3d shaped(const V3d& p, const MeshShape& shape, const RepeatFrame& frame) {
  const V2d lean = lean_at(p, shape, frame);
  const V2d from(p.x - frame.period.x / 2, p.y + frame.period.y / 2);
  const V3d place = V3d(p.x, p.y, frame.height - lean.dot(from) / 2) +
                    V3d(lean.x, lean.y, 1).normalized() * (p.z - frame.height);
  return {shape.is_mirrored ? -place.x : place.x, place.y, place.z};
}

enum class Lay { none, copy, bent, cut };

/// A repeat that is laid onto a cell.
struct LaidRepeat {
  Lay lay = Lay::none;
  MeshShape shape;
  RepeatCopy copy;
  M44d to_world;  ///< of the copy, from the frame of the mesh
  double turn = 0, shear = 0, gap = 0, overlap = 0;
  /// Whether it is bent instead, for its gaps and overlaps where the cloth turns so far.
  bool is_faulty() const {
    return std::max(gap, overlap) > (turn <= 4 * degree ? 0.1 : std::max(0.25, 0.025 * turn / degree));
  }
};

class RepeatLayer {
 public:
  RepeatLayer(const Cloth& cloth, const std::vector<ClothCell>& cells, const Yarns& yarns,
              const RepeatFrame& frame, const std::optional<Imath::Box2d>& region)
      : cloth_(cloth), cells_(cells), yarns_(yarns), frame_(frame), region_(region), laid(cells.size()) {
    for (int i = 0; i < static_cast<int>(cells.size()); ++i)
      numbers_[{cells[i].patch, cells[i].repeat_index.x, cells[i].repeat_index.y}] = i;
  }

  /// As a copy, unless it is cut or beyond the surface.
  void lay(int i, const RepeatMesh& mesh, bool in_region) {
    bool any = false, all = true;
    laid[i].shape.stitch = cells_[i].stitch;
    for (const MergedTubes& tubes : mesh.tubes_of(cells_[i].stitch)) {
      for (const V3f& p : tubes.mesh.positions) {
        const bool inside = below(i, V3d(p)).is_inside;
        any = any || inside;
        all = all && inside;
      }
    }
    if (!any) return;
    laid[i].lay = !all ? Lay::cut : in_region ? Lay::bent : Lay::copy;
    fit(i);
  }

  /// Sets gap and overlap of a copy.
  void measure(int i) {
    LaidRepeat& own = laid[i];
    own.gap = own.overlap = 0;
    if (own.lay != Lay::copy) return;
    for (const YarnJoint& joint : joints_) {
      const V2i at = cells_[i].repeat_index + V2i(joint.neighbour_offset.x, -joint.neighbour_offset.y);
      const auto number = numbers_.find({cells_[i].patch, at.x, at.y});
      if (number == numbers_.end() || laid[number->second].lay == Lay::none) continue;
      const LaidRepeat& neighbour = laid[number->second];
      const V3d q(joint.other_point),
          shift(joint.neighbour_offset.x * period_.x, joint.neighbour_offset.y * period_.y, 0);
      if (neighbour.lay == Lay::cut && !below(number->second, q).is_inside) continue;
      const V3d other = neighbour.lay == Lay::copy ? copied(neighbour, q) : bent(number->second, q);
      const V3d expected = copied(own, q + shift), apart = copied(own, V3d(joint.own_point)) - expected;
      const V3d moved = (expected - other) / (scale_ * static_cast<double>(joint.radius));
      const double way = joint.is_continuation ? moved.length() : moved.dot(apart.normalized());
      own.gap = std::max(own.gap, way);
      own.overlap = std::max(own.overlap, -way);
    }
  }

  /// The plies of a curve on the surface, as far as it has them.
  void add_lines(int i, const YarnCurve& curve, std::span<const Yarns::Segment> segments,
                 PlyLines& lines) const {
    const std::size_t each = segments.size() / curve.plies.count;
    for (int ply = 0; laid[i].lay != Lay::none && ply < curve.plies.count; ++ply) {
      std::vector<V3f> line;
      const auto finish = [&] {
        if (line.size() > 1) lines.push_back(line);
        line.clear();
      };
      const auto add = [&](const V3f& p) {
        if (!below(i, V3d(p)).is_inside) return finish();
        line.emplace_back(bent(i, V3d(p)));
      };
      const auto own = segments.subspan(ply * each, each);
      for (const Yarns::Segment& s : own) add(s.start);
      add(own.back().start + own.back().along);
      finish();
    }
  }

  /// The tubes on the surface, as far as it has them.
  TubeMesh bend(int i, const MergedTubes& tubes) const {
    TubeMesh result;
    const TubeMesh& mesh = tubes.mesh;
    std::vector<int> kept(mesh.positions.size(), -1);
    for (std::size_t k = 0; k + 2 < mesh.indices.size(); k += 3) {
      std::array<std::uint32_t, 3> corners{mesh.indices[k], mesh.indices[k + 1], mesh.indices[k + 2]};
      const V3f sum = mesh.positions[corners[0]] + mesh.positions[corners[1]] + mesh.positions[corners[2]];
      if (!below(i, V3d(sum) / 3.0).is_inside) continue;
      if (laid[i].shape.is_mirrored) std::swap(corners[1], corners[2]);
      for (const std::uint32_t corner : corners) {
        if (kept[corner] < 0) {
          kept[corner] = static_cast<int>(result.positions.size());
          add_vertex(i, tubes, corner, result);
        }
        result.indices.push_back(static_cast<std::uint32_t>(kept[corner]));
      }
    }
    return result;
  }

 private:
  V2d uv_of(int i, const V3d& p) const {
    return V2d(p.x / period_.x, -p.y / period_.y) + V2d(cells_[i].repeat_index);
  }

  /// The cloth that shows this place of the repeat. Rows leave their places within the region.
  ClothPoint below(int i, const V3d& p) const {
    const V2d shown = uv_of(i, p);
    V2d uv = shown;
    for (int round = 0; region_ && round < 3; ++round) {
      const V2d within = V2d(uv - region_->min), left = V2d(region_->max - uv);
      const double fraction = std::clamp(std::min({within.x, within.y, left.x, left.y}), 0.0, 1.0);
      const RepeatPlace place = repeat_place(uv / tile_);
      const RepeatPlace moved = displaced_place(yarns_.variation(), place, static_cast<float>(fraction));
      uv = shown - (V2d(moved.repeat - place.repeat) + V2d(moved.fraction - place.fraction)) * tile_;
    }
    return point_at(cloth_, cells_[i], uv);
  }

  V3d bent(int i, const V3d& p) const {
    const ClothPoint surface = below(i, p);
    return surface.position + surface.normal * ((p.z - frame_.height) * scale_);
  }

  V3d copied(const LaidRepeat& repeat, const V3d& p) const {
    return shaped(p, repeat.shape, frame_) * repeat.to_world;
  }

  /// The shape that is next to the cloth, and the copy of it whose joints are nearest to where they bend to:
  /// by least squares, but without the shear.
  void fit(int i) {
    LaidRepeat& repeat = laid[i];
    std::array<ClothPoint, 4> sides;
    constexpr std::array<std::array<double, 2>, 4> middles{{{0, 0.5}, {1, 0.5}, {0.5, 1}, {0.5, 0}}};
    for (std::size_t k = 0; k < 4; ++k)
      sides[k] = point_at(cloth_, cells_[i], V2d(cells_[i].repeat_index) + V2d(middles[k][0], middles[k][1]));
    V3d along = (sides[1].position - sides[0].position) / period_.x;
    V3d up = (sides[3].position - sides[2].position) / period_.y;
    const V3d turn_along = sides[1].normal - sides[0].normal, turn_up = sides[3].normal - sides[2].normal;
    repeat.turn = std::max(turn_along.length(), turn_up.length());
    repeat.shear = std::abs(std::numbers::pi / 2 -
                            std::acos(std::clamp(along.normalized().dot(up.normalized()), -1.0, 1.0)));
    repeat.shape.is_mirrored = cloth_.triangles[cells_[i].triangles.front()].is_mirrored;
    const double squareness = std::sqrt(period_.y / period_.x);
    const std::array<double, 3> bends{
        turn_along.dot(along.normalized()), turn_up.dot(up.normalized()),
        (turn_along.dot(up.normalized()) * squareness + turn_up.dot(along.normalized()) / squareness) / 2};
    for (std::size_t k = 0; k < 3; ++k)
      repeat.shape.bend[k] =
          static_cast<int>(std::lround(std::clamp(bends[k] / bend_step, -1.0 * max_steps, 1.0 * max_steps)));
    if (repeat.shape.is_mirrored) along *= -1;

    constexpr double weight_of_end = 10, weight_of_middles = 1e-3;
    std::vector<std::tuple<double, V3d, V3d>> pairs;
    double sum = 0;
    V3d centre(0, 0, 0), middle(0, 0, 0);
    for (const YarnJoint& joint : joints_) {
      const double weight = joint.is_continuation ? weight_of_end : 1;
      const V3d own(joint.own_point);
      const auto& [_, from, to] = pairs.emplace_back(weight, shaped(own, repeat.shape, frame_), bent(i, own));
      sum += weight;
      centre += from * weight;
      middle += to * weight;
    }
    centre /= sum;
    middle /= sum;
    const V3d straight = along.cross(up).normalized() * scale_;
    Eigen::Matrix3d squares = Eigen::Matrix3d::Identity() * (weight_of_middles * sum * period_.x * period_.y);
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (const auto& [weight, from, to] : pairs) {
      const V3d p = from - centre, away = to - middle - along * p.x - up * p.y - straight * p.z;
      squares += weight * Eigen::Vector3d(p.x, p.y, p.z) * Eigen::RowVector3d(p.x, p.y, p.z);
      moments += weight * Eigen::Vector3d(p.x, p.y, p.z) * Eigen::RowVector3d(away.x, away.y, away.z);
    }
    const Eigen::Matrix3d change = squares.ldlt().solve(moments);
    along += V3d(change(0, 0), change(0, 1), change(0, 2));
    up += V3d(change(1, 0), change(1, 1), change(1, 2));

    const V3d across = (along.normalized() + up.normalized()).normalized();
    const V3d beside = (along.normalized() - up.normalized()).normalized();
    const V3d x = (across + beside).normalized(), y = (across - beside).normalized(), z = x.cross(y);
    const V3d scale(along.dot(x), up.dot(y), scale_);
    M44d turned(x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, 0, 0, 0, 1);
    const Imath::Quatd rotation = Imath::extractQuat(turned);
    const V3d translation = middle - centre * scale * turned;
    repeat.to_world = M44d().setScale(scale) * turned * M44d().setTranslation(translation);
    repeat.copy = {V3f(translation), V4f(Imath::V4d(rotation.v.x, rotation.v.y, rotation.v.z, rotation.r)),
                   V3f(scale),
                   yarns_.variation_factor((V2d(cells_[i].repeat_index) + V2d(0.5, 0.5)) / repeat_, -1)};
  }

  void add_vertex(int i, const MergedTubes& tubes, std::uint32_t vertex, TubeMesh& result) const {
    const V3d p(tubes.mesh.positions[vertex]), n(tubes.mesh.normals[vertex]);
    result.positions.emplace_back(bent(i, p));
    const ClothPoint surface = below(i, p);
    const V3d x = surface.dp_du / period_.x, y = surface.dp_dv / -period_.y, z = surface.normal * scale_;
    const V3d normal = y.cross(z) * n.x + z.cross(x) * n.y + x.cross(y) * n.z;
    result.normals.emplace_back((laid[i].shape.is_mirrored ? -normal : normal).normalized());
    result.tex_coords.push_back(tubes.mesh.tex_coords[vertex]);
    result.shades.push_back(yarns_.variation_factor(uv_of(i, p) / repeat_, tubes.first_curve));
  }

  const Cloth& cloth_;
  const std::vector<ClothCell>& cells_;
  const Yarns& yarns_;
  std::vector<YarnJoint> joints_ = joints_of(yarns_);
  RepeatFrame frame_;
  std::optional<Imath::Box2d> region_;
  V2d period_ = frame_.period;                   ///< mm, of a cell
  V2d repeat_ = V2d(yarns_.repeat()) / period_;  ///< of the fabric, in cells
  V2d tile_ = V2d(yarns_.tile()) / period_;      ///< of its variation, in cells
  double scale_ = std::sqrt(cloth_.area / (cloth_.uv_area * period_.x * period_.y));  ///< m a mm
  std::map<std::tuple<int, int, int>, int> numbers_;

 public:
  std::vector<LaidRepeat> laid;  ///< of each cell
};

void append_mesh(const TubeMesh& part, TubeMesh& whole) {
  const auto first = static_cast<std::uint32_t>(whole.positions.size());
  whole.positions.insert(whole.positions.end(), part.positions.begin(), part.positions.end());
  whole.normals.insert(whole.normals.end(), part.normals.begin(), part.normals.end());
  whole.tex_coords.insert(whole.tex_coords.end(), part.tex_coords.begin(), part.tex_coords.end());
  whole.shades.insert(whole.shades.end(), part.shades.begin(), part.shades.end());
  for (const std::uint32_t index : part.indices) whole.indices.push_back(first + index);
}

}  // namespace

TubeMesh shaped_mesh(TubeMesh mesh, const MeshShape& shape, const RepeatFrame& frame) {
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    V3f& n = mesh.normals[v];
    const V2f lean(lean_at(V3d(mesh.positions[v]), shape, frame));
    n = V3f(n.x + lean.x * n.z, n.y + lean.y * n.z, n.z - lean.x * n.x - lean.y * n.y).normalized();
    if (shape.is_mirrored) n.x = -n.x;
    mesh.positions[v] = V3f(shaped(V3d(mesh.positions[v]), shape, frame));
  }
  for (std::size_t i = 0; shape.is_mirrored && i + 2 < mesh.indices.size(); i += 3)
    std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  return mesh;
}

LaidCloth place_repeats(const Cloth& cloth, const std::vector<ClothCell>& cells, const Yarns& yarns,
                        const RepeatFrame& frame, std::span<const RepeatMesh> meshes,
                        const std::vector<int>& mesh_of_cell, const std::optional<Imath::Box2d>& region) {
  RepeatLayer layer(cloth, cells, yarns, frame, region);
  const auto each = [&](const auto& work) { parallel_for(0, static_cast<int>(cells.size()), work); };
  each([&](int i) { layer.lay(i, meshes[mesh_of_cell[i]], mesh_of_cell[i] > 0); });
  std::map<std::pair<int, MeshShape>, int> counts;
  const auto count_of = [&](std::size_t i) -> int& { return counts[{mesh_of_cell[i], layer.laid[i].shape}]; };
  for (std::size_t i = 0; i < cells.size(); ++i) count_of(i) += layer.laid[i].lay == Lay::copy;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (layer.laid[i].lay == Lay::copy && count_of(i) < fewest_copies) layer.laid[i].lay = Lay::bent;
  for (bool changed = true; changed;) {
    each([&](int i) { layer.measure(i); });
    changed = false;
    for (LaidRepeat& repeat : layer.laid) {
      if (!repeat.is_faulty()) continue;
      repeat.lay = Lay::bent;
      repeat.gap = repeat.overlap = 0;
      changed = true;
    }
  }
  std::vector<std::vector<TubeMesh>> tubes(cells.size());
  each([&](int i) {
    if (layer.laid[i].lay == Lay::copy || layer.laid[i].lay == Lay::none) return;
    for (const MergedTubes& one : meshes[mesh_of_cell[i]].tubes_of(cells[i].stitch))
      tubes[i].push_back(layer.bend(i, one));
  });
  LaidCloth all;
  std::size_t first = 0;
  for (const YarnCurve& curve : yarns.data().curves) {
    PlyLines& lines = all.region_lines.emplace_back();
    const std::size_t count = segment_count(curve);
    for (int i = 0; i < static_cast<int>(cells.size()); ++i)
      if (mesh_of_cell[i] > 0 && yarns.data().map.empty())
        layer.add_lines(i, curve, yarns.geometry().segments.subspan(first, count), lines);
    first += count;
  }
  for (const RepeatMesh& mesh : meshes)
    all.repeats.emplace_back().bent_meshes.resize(mesh.tubes_of(0).size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const LaidRepeat& repeat = layer.laid[i];
    const bool is_empty =
        std::ranges::all_of(tubes[i], [](const TubeMesh& one) { return one.indices.empty(); });
    if (repeat.lay == Lay::none || (repeat.lay != Lay::copy && is_empty)) continue;
    PlacedRepeats& placed = all.repeats[mesh_of_cell[i]];
    all.max_gap_radii = std::max(all.max_gap_radii, repeat.gap);
    all.max_overlap_radii = std::max(all.max_overlap_radii, repeat.overlap);
    if (repeat.lay != Lay::cut) {
      all.max_turn = std::max(all.max_turn, repeat.turn);
      all.max_shear = std::max(all.max_shear, repeat.shear);
    }
    placed.bent_repeat_count += repeat.lay == Lay::bent;
    placed.cut_repeat_count += repeat.lay == Lay::cut;
    if (repeat.lay == Lay::copy) placed.copies[repeat.shape].push_back(repeat.copy);
    for (std::size_t y = 0; y < tubes[i].size(); ++y) append_mesh(tubes[i][y], placed.bent_meshes[y]);
  }
  return all;
}

}  // namespace selvedge
