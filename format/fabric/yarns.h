// The yarn itself, as a fabric file holds it: chains of round segments, the reflectance of their fibres, and
// the light that reaches them by way of other yarn (spec/brdf.md, "Yarn").
//
// Frame of the fabric, mm: x along growing u, y along falling v, z above the cell's lowest point; everything
// repeats with the period in x and y. A point (u, v) of the reference plane lies at x = u period.x,
// y = -v period.y.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"
#include "format/fabric/layers.h"
#include "format/fabric/shading.h"
#include "format/fabric/variation.h"
#include "format/fabric/yarn_hairs.h"
#include "format/fabric/yarn_map.h"
#include "format/fabric/yarn_reflectance.h"
#include "format/fabric/yarn_section.h"
#include "format/fabric/yarn_strands.h"

namespace selvedge {

/// The plies of a yarn, which follow from its axis.
struct YarnPlies {
  int count = 1;      ///< 1 to 8; 1: none, the yarn is round
  int divisions = 1;  ///< parts of a segment of the axis, each with a node of every ply; 1 to 64
  /// At its end, ply j runs on as ply j + shift: they turn shift/count times about the axis, right-handed.
  int shift = 0;
  float phase = 0;  ///< angle of ply 0 at node 0, in [-pi, pi]
  /// Indirect light is 1 + groove times the normal's fraction in the way out of the axis as bright.
  V3f outward_gain{0, 0, 0};
  /// 1: indirect light distinguishes the sides of the axis on which plies lie (YarnPoint::ply_side) in place
  /// of the double angle. 0: of earlier writers.
  int sides = 0;
  bool operator==(const YarnPlies&) const = default;
};

/// One yarn: a closed chain of nodes, joined by segments with round ends; from the last node it runs
/// on to the first of the repeat that lies `turns` away.
struct YarnCurve {
  int nodes = 0;            ///< >= 2
  int stations = 0;         ///< places, evenly spaced along it, where indirect light is known; >= 1
  V2i repeat_offset{0, 0};  ///< in periods along x and y; (0, 0) is a ring
  float radius = 0.5F;      ///< mm, > 0; of a round yarn with the same area
  V3f albedo{0.5F, 0.5F, 0.5F};
  Gloss gloss;
  /// Tangent of the angle from the yarn's axis to the fibres at its surface: a right-handed screw is
  /// positive.
  float fibre_slope = 0;
  YarnPlies plies;
  YarnStrands strands;
  float flattening = 1;  ///< thickness over width of its section, min_flattening to 1 (round)
  YarnHairs hairs;
  /// Squeezes (yarn_section.h) of the section at its nodes; empty: by its flattening.
  std::vector<V3f> squeezes{};
  bool is_round() const { return flattening == 1 && squeezes.empty(); }
  bool operator==(const YarnCurve&) const = default;
};

/// Radius of each of `plies` equal circles that touch each other in a ring within a circle of radius 1.
double unit_ply_radius(int plies);
/// Radius of the plies, or of the yarn where it has none.
float ply_or_yarn_radius(const YarnCurve& curve);

/// Indirect light of a station: for the angle a about the axis and the light l
///   f(a, l) = max(0, l_z sum over i, k of c_ik A_i(a) B_k(l)) in 1/sr, A = 1, cos a, sin a, cos 2a, sin 2a,
///   B = 1, x, y, z, xy, xz, yz, x^2 - y^2, 3 z^2 - 1.
/// With YarnPlies::sides the last two A are YarnPoint::ply_side.
/// The angle counts from the direction that a first direction across the chain's first segment (Yarns) takes
/// when it is carried along.
inline constexpr int angle_function_count = 5;
inline constexpr int yarn_light_function_count = 9;
inline constexpr int transfer_values_per_station = 3 * angle_function_count * yarn_light_function_count;
/// A station's coefficients are followed by the moments of its light along the fibre, which yarn with lustre
/// reflects by view: [n - 1][i], the mean of U_n(x) as sum over i of m_ni A_i(a), for n = 1 and 2. x is the
/// light's component along the fibre, U_n Chebyshev's polynomial of the second kind.
inline constexpr int light_moment_count = 2;
inline constexpr int light_values_per_station =
    transfer_values_per_station + light_moment_count * angle_function_count;
static_assert(light_values_per_station == station_value_count &&
              transfer_values_per_station == min_station_value_count);

std::array<float, angle_function_count> angle_basis(float cosine, float sine);
/// l_z included. Precondition: unit light.
std::array<float, yarn_light_function_count> light_basis(const V3f& light);

/// Numbers from which a reader restores nodes, squeezes and light, a few bytes a node and a station
/// (spec/fabric.md, "Packed yarn"): nodes are multiples of the step then, squeezes of packed_squeeze_step.
struct YarnPacking {
  float step = 0;                ///< mm; 0: the yarn is not packed
  std::vector<float> functions;  ///< [function][value of a station]
  /// [function][station], whole numbers that a 16-bit float holds: a station's light is the sum of the
  /// functions times these.
  std::vector<float> factors, factors_through;
  int function_count() const { return static_cast<int>(functions.size()) / light_values_per_station; }
  bool operator==(const YarnPacking&) const = default;
};
inline constexpr float packed_squeeze_step = 0x1p-6F;

/// The content of the file.
struct YarnData {
  std::vector<YarnCurve> curves;
  std::vector<V3f> nodes;  ///< curve by curve, along its chain, also beyond the cell
  std::vector<float>
      station_light;  ///< [station][(i * yarn_light_function_count + k) * 3 + colour], then the moments
  /// The same for light from below, mirrored into the upper half, with direct light where the yarn faces up:
  /// where it faces down, the cloth turned over adds that. Empty: unknown.
  std::vector<float> light_through;
  YarnPacking packing{};
  YarnMap map{};
  bool operator==(const YarnData&) const = default;
};

YarnCounts counts_of(const YarnData& data);

/// The values of a file's layer `yarns`: the curves' nodes, then their stations, and so on in the order of
/// the members of YarnCurve, then 1 with squeezes, the strands' contrast and change, the plies' sides, the
/// lustre and the marl; x, y, z of each curve's nodes and then of its squeezes. `indirect`: every value over
/// all stations. Of packed yarn these are whole steps from where the nodes, or the squeeze, before lead, then
/// every value over all functions; `indirect`: every factor over all stations.
inline constexpr int values_per_node = 3;
inline int curve_value_count(const YarnCounts& counts) {
  return counts.values_per_curve * counts.curves + values_per_node * counts.nodes +
         counts.light_functions * counts.values_per_station;
}
inline int indirect_value_count(const YarnCounts& counts) {
  return counts.stations * (counts.light_functions > 0 ? counts.light_functions : counts.values_per_station);
}
std::vector<float> curve_values(const YarnData& data);
/// Transfer of light from above, or of light that comes `through`; empty where that is unknown.
std::vector<float> indirect_values(const YarnData& data, bool through = false);
/// The inverse, of values that may be followed by others. Refuses what validate() refuses.
Result<YarnData> yarns_from_values(std::span<const float> curves, std::span<const float> indirect,
                                   const YarnCounts& counts, const V2f& period, YarnMap map = {});
/// The map of a layer `map`, of a yarn with so many columns and rows of stitches.
YarnMap map_from_values(std::span<const float> values, const YarnCounts& counts, const V2i& kinds);

/// Values over all stations, or functions, one after the other by station; missing moments are 0.
std::vector<float> light_from_values(std::span<const float> values, int stations);
/// The light that the functions and factors make, as YarnData has it.
std::vector<float> unpacked_light(const YarnPacking& packing, const std::vector<float>& factors);
/// Sets the light that comes through from the values of that layer.
void set_light_through(YarnData& data, std::span<const float> indirect);

/// Counts that do not agree, values out of range or not finite, segments without length, yarn that covers the
/// cell too often, stitches of a map that are not there: refused, the place being "curve 3" or "node 17".
/// `period`: of the yarn.
Result<void> validate(const YarnData& data, const V2f& period);

/// Bytes that Yarns takes at most. A cell lists the segments that pass it, and a few numbers of a file can be
/// thousands of times as many of these. Precondition: validate() holds.
double yarn_memory_bytes(const YarnData& data, const V2f& period);

/// Where a ray meets yarn.
struct YarnHit {
  int segment = 0;            ///< that which begins at the node of this index
  V3f start_offset{0, 0, 0};  ///< mm, from that node to the point
  V2f map_shift{0, 0};        ///< mm, by which a map moves the segment
};

/// The surface at a hit.
struct YarnPoint {
  V3f normal{0, 0, 1};     ///< unit, out of the yarn
  V3f fibre{1, 0, 0};      ///< unit, perpendicular to the normal
  float angle_cosine = 1;  ///< of the angle about the axis
  float angle_sine = 0;
  /// Fraction of the normal in the way from the yarn's axis to its ply's; 0 without plies.
  float outward_cosine = 0;
  /// The way from the yarn's axis to its ply's, as cosine and sine of its angle; 0 without plies.
  V2f ply_side{0, 0};
  float station = 0;  ///< in [0, stations of its curve]
  int curve = 0;
  bool is_hair = false;  ///< angle, station and outward at its root
  StrandRows rows;
  V3f strand_normal{0, 0, 1};  ///< normal of the visible strand; of smooth yarn: the yarn's
  float brightness = 1;        ///< factor of all light but the gloss
};

/// The factors of the functions at a point of a yarn or ply.
std::array<float, angle_function_count> angle_factors(const YarnPlies& plies, const YarnPoint& point);

/// Indirect light of a point for any light: the factors of the functions of the light, [function][colour].
using LightTransfer = std::array<float, 3 * yarn_light_function_count>;
/// f by indirect light, in 1/sr. Precondition: unit light.
V3f indirect_light(const LightTransfer& transfer, const V3f& light);

/// A place on a curve's axis, and the directions that angles about it count from.
struct YarnFrame {
  V3f position{0, 0, 0};     ///< mm
  V3f tangent{1, 0, 0};      ///< unit, in the round section
  V3f across{0, 0, 1};       ///< unit; angle 0, and tangent x across is a right angle
  V3f axis_to_ply{0, 0, 0};  ///< of a ply: unit, across it, away from the yarn's axis
  V3f squeeze{0, 0, 0};      ///< of its section (yarn_section.h): angles on the round section
  float radius = 0;          ///< mm, of the round section, the largest of the segments there
  /// Normal and place of the surface where the round section has this unit normal.
  V3f surface_normal(const V3f& round) const { return squeezed(round, squeeze).normalized(); }
  V3f surface_position(const V3f& round) const { return position + stretched(round, squeeze) * radius; }
};

/// Segments that are tested together.
inline constexpr std::size_t yarn_block_size = 8;

/// Whether angles about a curve count from the x axis, since its first tangent stands too steeply.
inline bool angles_from_x_axis(const V3f& tangent) { return std::abs(tangent.z) >= 0.9F; }

/// Yarn that rays can be traced through. Immutable: for any number of threads.
class Yarns {
 public:
  /// Precondition: validate(data, period) holds.
  Yarns(YarnData data, const V2f& period);

  const YarnData& data() const { return data_; }
  const V2f& period() const { return period_; }
  /// The cloth's, mm: the map's, or the yarn's own.
  V2f repeat() const {
    const YarnMap& map = data_.map;
    return map.empty() ? period_ : period_ * V2f(map.size) / V2f(map.kinds);
  }
  /// The repeat, mm, of images and of variation: the yarn's, or map_tile_stitches of a map.
  V2f tile() const {
    const YarnMap& map = data_.map;
    return map.empty() ? period_ : period_ * static_cast<float>(map_tile_stitches) / V2f(map.kinds);
  }
  V2d tiles_per_repeat() const { return V2d(repeat() / tile()); }
  /// Made at the first call.
  const Variation& variation() const;

  /// The first yarn that the ray from the viewer meets which passes the plane z = `plane` at (u, v). Rays
  /// rise by at least 1/32 a unit of way in the plane: a lower `view` counts as one that does. `width`: of
  /// what the ray stands for, mm: of thinner hairs only a fraction is met, and these are as much wider
  /// (spec/brdf.md, "Over a surface").
  std::optional<YarnHit> trace(const V2d& uv, float plane, const V3f& view, float width = 0) const;
  /// Without strands.
  YarnPoint point_at(const YarnHit& hit) const;
  /// Turns fibre and normal to the strand's that is seen from unit `view`.
  void perturb_by_strands(YarnPoint& point, const V3f& view) const;
  /// Precondition: the curve has the station.
  YarnFrame frame_at(int curve, int station, int ply = 0) const;
  /// Whether yarn lies between the point and unit `light`, which is lifted like a view.
  bool is_occluded(const YarnHit& hit, const YarnPoint& point, const V3f& light) const;
  /// The same for a point, mm, of any repeat of the yarn, or of the cloth that a map makes of it.
  bool is_occluded(const V3f& from, const V3f& light, const YarnMap* map = nullptr) const;
  /// f(l, v) of the point by direct light, whether or not yarn hides it.
  V3f direct_reflectance(const YarnPoint& point, const V3f& light, const V3f& view) const;
  /// Transfer of light from above, or of light that comes `through`, if that is known.
  LightTransfer transfer_at(const YarnPoint& point, bool through = false) const;
  /// Factor of that light from above, by lustre: its fraction that leaves towards the view over the mean.
  float lustre_view_factor(const YarnPoint& point, const V3f& view) const;

  /// f and alpha of what is seen at (u, v) of the plane: alpha is 0 or 1, and f is 0 where nothing is.
  /// Directions are unit; where the view lies below the horizon, f is 0, and alpha the rim's. `varied`: f is
  /// multiplied by variation_factor().
  Shading shade(const V2d& uv, float plane, const V3f& light, const V3f& view, bool varied = false) const;
  /// Where variation.h looks coordinates up: it moves the rows of a tile.
  V2d displaced_place(const V2d& uv) const;
  /// Factor of the variation beyond the repeat, where a curve is seen; -1: all of them, from above.
  float variation_factor(const V2d& uv, int curve) const;

  /// Between two nodes, or a piece of a hair, mm; the frames at both ends. Only members of 4 bytes, so that
  /// lanes can fetch them.
  struct Segment {
    V3f start, along;
    /// across: of the yarn's axis. Of a hair, the first has cosine, sine and YarnPoint::outward_cosine of its
    /// root, the second YarnPoint::ply_side.
    std::array<V3f, 2> tangent, across;
    std::array<V3f, 2> axis_to_ply{V3f(0, 0, 0),
                                   V3f(0, 0, 0)};  ///< unit, from that to the ply's; 0 without plies
    float inverse_length2 = 0;                     ///< 1 / mm^2; in the round section
    float start_station = 0;
    float station_span = 0;  ///< over its length; 0: a hair, which has the light of its root
    float radius = 0;        ///< of the round section
    V3f squeeze{0, 0, 0};
    /// Radius of the ball about its start: the thicker segment's there. Of a hair, its largest radius.
    float bounding_radius = 0;
    float hair_threshold =
        0;  ///< of a hair, in (0, 1): it is met where that is less than the fraction of hairs; else 0
    int curve = 0;
    StrandRows rows;
    /// Half the width of the section where half the thickness is `thin`.
    float half_width(float thin) const { return thin / (1 - squeeze.length2()); }
    /// How far it reaches up and down about its line.
    float half_height() const { return section_extent(bounding_radius, squeeze, V3f(0, 0, 1)); }
  };
  /// Segments for the lanes, relative to the middle of a cell at z = 0. Those that are not there
  /// have radius and reach 0.
  struct Block {
    std::array<std::array<float, yarn_block_size>, 3> start, axis;  ///< axis: unit, in the round section
    std::array<float, yarn_block_size> length, bounding_radius, radius, hair_threshold;  ///< likewise
    std::array<int, yarn_block_size> segment;
    float min_z = std::numeric_limits<float>::max();  ///< mm, of what its segments reach
    float max_z = std::numeric_limits<float>::lowest();
    float min_empty_width;  ///< mm; rays of at least this width meet none of them
    bool has_flat_segment;  ///< whether one of them is
    std::array<std::array<float, yarn_block_size>, 3> squeeze;
  };
  struct Cell {
    std::uint32_t first_block = 0;
    std::uint32_t block_count = 0;
    float min_z = std::numeric_limits<float>::max();  ///< mm, of what the cell's segments reach
    float max_z = std::numeric_limits<float>::lowest();
  };
  /// Cells of the plane, each with the segments that a ray through it may meet.
  struct Grid {
    float min_z = 0, max_z = 0;  ///< mm, of the lowest and the highest point
    V2i count{1, 1};
    V2f size{1, 1};  ///< of a cell, mm
    /// How far, in stitches of a map, the stitch of the layer's segments lies from the cell's; one layer
    /// without a map.
    std::vector<V2i> layers;
    std::vector<Cell> cells;  ///< [layer][row][column]
    std::vector<Block> blocks;
  };
  /// Made at the first call: cloth that is splatted needs none.
  const Grid& grid() const;
  struct Geometry {                      ///< segments and numbers of the yarn, for programs that show it
    float min_z = 0, max_z = 0;          ///< mm, of the lowest and the highest point
    std::span<const Segment> segments;   ///< one for each node of a yarn or ply
    std::span<const int> first_station;  ///< of each curve
    /// Factors of cosine and sine, by curve: strands of yarn turned over count from the mirrored angle.
    std::span<const V2f> strand_sense;
    std::span<const V2i> stitches;  ///< of a map, of each segment: append_stitches(); else empty
  };
  /// Made at the first call: cloth that is read and written again needs none.
  Geometry geometry() const;

 private:
  void derive_segments() const;
  Grid placed_in_cells() const;

  YarnData data_;
  V2f period_;
  std::vector<int> first_station_;  ///< of each curve
  struct Derived {
    std::once_flag segments_once, grid_once, variation_once;
    float low = 0;  ///< mm, of the lowest point
    float high = 0;
    std::vector<Segment> segments;
    std::vector<int> first_segment;  ///< of each curve; segments of a ply are adjacent
    std::vector<V2f> strand_sense;
    std::vector<V2i> stitches;
    Grid grid;
    Variation variation;
  };
  std::shared_ptr<Derived> derived_ = std::make_shared<Derived>();
};

/// Rows of the strands of a ply, or of a yarn without plies (yarn_strands.h). Ply in [0, count).
StrandRows ply_strand_rows(const YarnCurve& curve, int ply);

inline std::int64_t segment_count(const YarnCurve& curve) {
  return std::int64_t{1} * curve.nodes * curve.plies.count * curve.plies.divisions;
}
/// Nodes of all plies and hairs, which validate() refuses from here on.
constexpr std::int64_t max_piece_count = 1 << 20;
std::int64_t piece_count(const YarnData& data);
/// The width of rays from which on none meets the segment; infinite for all but most hairs.
float min_empty_width(const Yarns::Segment& segment);
/// Makes the segments of one curve from its own nodes, ply after ply. Precondition: validate() holds of all
/// but the lengths of plies.
std::vector<Yarns::Segment> make_segments(const YarnCurve& curve, std::span<const V3f> nodes,
                                          const V2f& period);
void append_segments_of(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period,
                        std::vector<Yarns::Segment>& segments);
/// Whether `test` holds of each ply, or of a yarn without: of the ends of its segments, mm.
bool holds_for_plies(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period,
                     const std::function<bool(std::span<const V3d>)>& test);
/// Calls visit(index, curve, its nodes) for all curves.
template <class Visit>
void for_each_curve(const YarnData& data, const Visit& visit) {
  std::span<const V3f> rest = data.nodes;
  for (std::size_t c = 0; c < data.curves.size(); ++c) {
    visit(c, data.curves[c], rest.first(data.curves[c].nodes));
    rest = rest.subspan(data.curves[c].nodes);
  }
}
/// Appends them, followed by the pieces of its hairs.
void append_segments_with_hairs(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period,
                                std::vector<Yarns::Segment>& segments);
/// The stitch of a map, along its curve, that the segment behind each node belongs to: it ends at the node on
/// its border, also where yarn bulges over that before. Without a map all 0.
std::vector<int> stitches_of(const YarnMap& map, const V2f& period, const YarnCurve& curve,
                             std::span<const V3f> nodes);
/// Appends the stitches, columns and rows (upwards) of any repeat, that the segments and hairs of a curve
/// belong to: where a map shows one, it shows them. Moves hairs into the first repeat.
void append_stitches(const YarnData& data, std::size_t curve, std::span<const V3f> nodes, const V2f& period,
                     std::span<Yarns::Segment> segments, std::vector<V2i>& stitches);
/// Hairs of a curve that has make_segments() `chain`.
std::vector<YarnHair> make_hairs(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period,
                                 std::span<const Yarns::Segment> chain);
/// Whether angles about the curve count from the x axis.
bool angles_from_x_axis(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period);

/// A point of the surface about a station.
struct StationPoint {
  V3f position, normal;        ///< mm; unit, out of the yarn
  float radius = 0;            ///< mm, YarnFrame::radius
  float visible_fraction = 1;  ///< roughly the fraction of views that it is seen from
  std::array<float, angle_function_count> functions{};  ///< angle_factors()
};
/// So many points evenly around a yarn, or around each of its plies as far as this touches no other.
std::vector<StationPoint> points_around_station(const Yarns& yarns, int curve, int station, int count);

/// The yarn of the cell turned over: heights are `thickness` (mm) less what they were, and light from above
/// is that from below. Where that is unknown, the upper side keeps the light that the other had.
YarnData turned_over(const Yarns& yarns, float thickness);

}  // namespace selvedge
