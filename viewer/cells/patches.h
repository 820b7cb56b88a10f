// Patches of a garment: squares of 1, 2, 4 ... repeats of one chart, each of which shows one cell image;
// parts of a repeat where it is so large that its rays are far from parallel.
//
// A chart is a set of triangles that share vertices. Streaked ones (tangents.h) join nothing: they show the
// chart of their last corner, or have one of their own, which shows the fabric's mean. Its patches form a
// quadtree over texture coordinates; a frame takes the largest ones whose normals turn little and that are
// small on the screen.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "format/scene/camera.h"
#include "format/scene/lights.h"
#include "viewer/frame/options.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

/// Means over the surface of a patch; m, relative to the mesh's origin.
struct Patch {
  V3f mean_normal{0, 0, 0};  ///< of unit normals: its length shows how much they turn
  V3f mean_tangent{0, 0, 0};
  V3f mean_dp_du{0, 0, 0};  ///< change of place for a repeat
  V3f mean_dp_dv{0, 0, 0};
  V3f mean_position{0, 0, 0};
  float area = 0;                  ///< m^2; 0: no surface
  float handedness = 0;            ///< sum over the area
  std::uint32_t any_triangle = 0;  ///< one of its triangles
};

/// A patch as a frame shows it.
struct ShownPatch {
  V2f pixel_width_texels{1, 1};  ///< width of a pixel along u and v, repeats
  bool in_frame = false;
  V2i first_unit{0, 0};    ///< unit of its chart
  int units_per_side = 1;  ///< along its sides
  float offset = 0;        ///< pixels from where yarn belongs at its border, of parts of a repeat
};

/// The facts of a fabric that patches need.
struct PatchFabric {
  float relief = 0;  ///< distance from the plane of the cloth of what it shows, longer sides of a repeat
  V2f repeats_per_uv{1, 1};  ///< of images: tiles of a map (Yarns::tile()) count as repeats here
  bool has_map = false;      ///< all patches are small parts of a tile
};

class Patches {
 public:
  /// Takes the triangles whose surface has a fabric.
  Patches(const MergedSurfaces& mesh, std::span<const SurfaceMaterial> materials,
          std::span<const PatchFabric> fabrics);

  /// Takes another shape of the mesh, of the same triangles and texture coordinates.
  void update_shape(const MergedSurfaces& mesh) {
    std::ranges::fill(patches_, Patch{});
    add_up(mesh);
  }

  /// Takes the relief of another fabric, where all have one.
  void set_relief(float relief) {
    for (Chart& chart : charts_) chart.fabric.relief = relief;
  }

  struct Chart {
    V2i size_in_patches{1, 1};  ///< of the table, in smallest patches
    PatchFabric fabric;
    std::size_t first_table_entry = 0;  ///< its first entry of the table
    V2i first_repeat{0, 0};
    std::vector<std::size_t> level_starts;  ///< first patch of each level, finest first
    std::uint32_t any_patch = 0;            ///< one of the last level that has a surface
  };
  /// Where a triangle lies: the unit of its first corner's repeat, relative to the chart's first.
  struct Place {
    std::int32_t chart = -1;  ///< -1: no fabric
    std::int32_t u = 0;
    std::int32_t v = 0;
  };

  /// Units that a triangle touches, from its place.
  struct Extent {
    std::int32_t min_u_offset = 0, min_v_offset = 0, max_u_offset = -1, max_v_offset = -1;
    /// Whether its pixels are better asked than its units.
    bool is_large() const { return max_u_offset - min_u_offset >= 6 || max_v_offset - min_v_offset >= 6; }
  };
  Extent extent(const MergedSurfaces& mesh, std::size_t triangle) const;

  /// Texture coordinates of a corner of a triangle in a chart, repeats of images.
  V2f place(const MergedSurfaces& mesh, std::size_t triangle, std::size_t corner) const {
    return mesh.uv(mesh.triangles[triangle].corners[corner]) * repeats_per_uv(triangle);
  }
  const V2f& repeats_per_uv(std::size_t triangle) const {
    return charts_[places_[triangle].chart].fabric.repeats_per_uv;
  }
  std::size_t count() const { return patches_.size(); }
  const Patch& operator[](std::size_t i) const { return patches_[i]; }
  const ShownPatch& shown(std::size_t i) const { return shown_[i]; }
  /// The patch around a patch, and a patch within it; itself at the ends.
  std::uint32_t parent(std::uint32_t i) const { return relatives_[i][0]; }
  std::uint32_t parent_side(std::uint32_t side) const { return 2 * parent(side / 2) + side % 2; }
  std::uint32_t child(std::uint32_t i) const { return relatives_[i][1]; }
  const Place& place(std::uint32_t triangle) const { return places_[triangle]; }
  bool empty() const { return charts_.empty(); }
  const Chart& chart(std::int32_t i) const { return charts_[i]; }
  /// Numbers of the chosen patches at the smallest patches of all charts.
  std::span<const std::uint32_t> table() const { return table_; }
  /// Smallest patches along a repeat; below 1: their sides are longer.
  float finest_patches_per_repeat() const { return std::exp2(static_cast<float>(-first_level_)); }

  /// Chooses the patches of a frame. `is_moving`: patches that the last frame split merge at 0.8 of the
  /// limits.
  void choose(const Camera& camera, const V3d& origin, const V2i& frame, const PatchLimits& limits,
              std::span<const Light> lights, bool is_moving = false);

  /// Area of a patch in the frame, as if it were flat, pixels.
  float shown_area(std::uint32_t i) const {
    const float repeats = static_cast<float>(shown_[i].units_per_side) / finest_patches_per_repeat();
    const V2f& pixel = shown_[i].pixel_width_texels;
    return std::max(repeats * repeats / (pixel.x * pixel.y), 1e-3F);
  }
  /// The repeat in which a chosen patch that is part of one lies, of texture coordinates.
  V2i repeat_of(std::uint32_t i) const {
    const Chart& chart = charts_[places_[patches_[i].any_triangle].chart];
    return chart.first_repeat + shown_[i].first_unit / units_per_repeat();
  }
  bool is_part(std::uint32_t i) const { return shown_[i].units_per_side < units_per_repeat(); }
  /// Units are parts of repeats along either side, or whole ones.
  int units_per_repeat() const { return 1 << std::max(-first_level_, 0); }
  /// The unit, counted from a place's, at a place within a repeat.
  int unit_at(int repeat, float within) const {
    const int units = units_per_repeat();
    return repeat * units + std::min(static_cast<int>(within * static_cast<float>(units)), units - 1);
  }
  /// The chosen patch at a unit; any of the chart beyond its border.
  std::uint32_t patch_at(const Place& place, int u, int v) const {
    const Chart& chart = charts_[place.chart];
    return table_[chart.first_table_entry +
                  cell(place.v, v, chart.size_in_patches.y) * chart.size_in_patches.x +
                  cell(place.u, u, chart.size_in_patches.x)];
  }

  /// Calls body(patch) for the chosen patches around one that is part of a repeat, itself included.
  void for_each_neighbour(std::uint32_t i, const auto& body) const {
    const Chart& chart = charts_[places_[patches_[i].any_triangle].chart];
    const ShownPatch& shown = shown_[i];
    for (int v = std::max(shown.first_unit.y - 1, 0);
         v <= std::min(shown.first_unit.y + shown.units_per_side, chart.size_in_patches.y - 1); ++v)
      for (int u = std::max(shown.first_unit.x - 1, 0);
           u <= std::min(shown.first_unit.x + shown.units_per_side, chart.size_in_patches.x - 1); ++u)
        body(table_[chart.first_table_entry + static_cast<std::size_t>(v) * chart.size_in_patches.x + u]);
  }

  /// Calls body(patch) for the chosen patches of an extent, some of them several times.
  void for_each_patch(const Place& place, const Extent& extent, const auto& body) const {
    const Chart& chart = charts_[place.chart];
    const std::size_t last_u = cell(place.u, extent.max_u_offset, chart.size_in_patches.x);
    const std::size_t last_v = cell(place.v, extent.max_v_offset, chart.size_in_patches.y);
    for (std::size_t v = cell(place.v, extent.min_v_offset, chart.size_in_patches.y); v <= last_v; ++v)
      for (std::size_t u = cell(place.u, extent.min_u_offset, chart.size_in_patches.x); u <= last_u; ++u)
        body(table_[chart.first_table_entry + v * chart.size_in_patches.x + u]);
  }

 private:
  std::size_t cell(std::int32_t from, int unit, int size) const {
    const std::int64_t at = (std::int64_t{from} + unit) >> std::max(first_level_, 0);
    return static_cast<std::size_t>(at < 0 ? 0 : at >= size ? size - 1 : at);
  }
  void add_up(const MergedSurfaces& mesh);
  void add_triangle(const MergedSurfaces& mesh, std::uint32_t number);
  void add_levels(const Chart& chart);
  struct Projected;
  struct View;
  void choose_in(const Chart& chart, const View& view, std::size_t level, const V2i& at, std::uint32_t above);

  int first_level_ = 0;  ///< 2^first_level repeats are a side of the smallest patches
  std::vector<Chart> charts_;
  std::vector<Place> places_;             ///< of the triangles
  std::vector<std::uint8_t> is_counted_;  ///< whether a triangle is part of its chart's means
  std::vector<Patch> patches_;
  std::vector<std::array<std::uint32_t, 2>> relatives_;  ///< parent, child
  std::vector<ShownPatch> shown_;
  std::vector<std::uint8_t> splits_, split_before_;  ///< patches, in this frame and the one before
  std::vector<std::uint32_t> table_;                 ///< of each chart's smallest patches, the chosen one
};

}  // namespace selvedge
