// The yarn of a fabric as the splatter of cell images takes it: pieces at several levels of detail.
//
// Frame: as in format/fabric/yarns.h. A piece is a straight cylinder, which stands for one or more segments
// of a ply, or for a piece of a hair.
#pragma once

#include <Imath/ImathBox.h>

#include <array>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "format/fabric/yarns.h"
#include "format/simd/group.h"

namespace selvedge {

/// Pieces [begin, end).
struct PieceRange {
  int begin = 0;
  int end = 0;
};

/// Pieces of one level of detail: first all plies, then all hairs.
struct YarnPieces {
  /// Numbers of a piece for the splatter; mm, axes as of Yarns::Segment.
  enum Number {
    start_x,
    start_y,
    start_z,
    along_x,
    along_y,
    along_z,
    axis_x,
    axis_y,
    axis_z,  ///< unit, in the round section
    length,  ///< in the round section
    joint,   ///< by which it is longer at either end: in place of a ball between plies' pieces
    radius,
    squeeze_x,
    squeeze_y,
    squeeze_z,
    hair_threshold,
    bounding_radius,
    field_count
  };
  std::vector<Yarns::Segment> plies;
  std::span<const Yarns::Segment> all;  ///< of the yarn, with its hairs
  std::vector<std::uint32_t> hairs;     ///< in `all`
  /// The radii of a hair, which may stand for several, are in `numbers`.
  const Yarns::Segment& segment(int piece) const {
    return piece < ply_piece_count ? plies[piece] : all[hairs[piece - ply_piece_count]];
  }
  /// Strands: count, shift within a turn, lays, first row; later row, width in mm, strand sense x and
  /// y.
  std::vector<std::array<Group, 2>> strands;
  std::array<std::vector<float>, field_count> numbers;  ///< padded by a vector's width
  /// Some neighbours in their order: pieces, or the runs of a group.
  struct Run {
    PieceRange range;
    Imath::Box3f box;     ///< around plies, and around the axes of hairs, mm
    float max_width = 0;  ///< hairs that rays see with at least this radius are not met, mm
  };
  std::vector<Run> runs, groups;
  /// Groups of a stitch of a map, in whose order pieces are, or of all yarn. Plies begin in the first repeat.
  struct Stitch {
    PieceRange plies, hairs;
  };
  std::vector<Stitch> stitches;    ///< rows upwards
  V2f reach_beyond_stitch{0, 0};   ///< mm
  Imath::Box3f box;                ///< around all, mm
  int ply_piece_count = 0;         ///< number of pieces that are no hairs
  float thickest_hair_radius = 0;  ///< radius, mm
  float widest_hair_radius = 0;    ///< as wide rays see it, mm
  float min_hair_bound = 0;        ///< smallest bound on that, mm
  int count() const { return static_cast<int>(plies.size() + hairs.size()); }
};

/// One side of a fabric, prepared for images of its cell. Immutable: for any number of threads.
class CellYarn {
 public:
  /// `plane`: Fabric::reference_height. `sky`: sky_transfer() the yarn, or empty. Both must outlive the
  /// object.
  CellYarn(const Yarns& yarns, float plane, std::span<const float> sky);

  const Yarns& yarns() const { return *yarns_; }
  float reference_height() const { return plane_; }
  std::span<const float> sky_transfer() const { return sky_; }
  void set_sky_transfer(std::span<const float> sky) { sky_ = sky; }
  /// Whether it has so much yarn that images see little of it, or have fewer pixels.
  bool has_large_cell() const { return large_; }
  bool has_flat_sections() const { return flat_; }  ///< whether some section is an ellipse
  /// The coarsest pieces that are at most `longest` mm long, or the finest. Each level is made when it is
  /// first asked for.
  const YarnPieces& pieces(float longest) const;

 private:
  const Yarns* yarns_;
  float plane_;
  std::span<const float> sky_;
  bool flat_ = false, large_ = false;
  float step_ = 0;  ///< mean length of a segment, mm
  /// Segments of a ply that one piece stands for.
  static constexpr std::array<int, 9> detail_lengths{1, 2, 3, 4, 6, 9, 14, 20, 30};
  static constexpr std::size_t small_cell_detail_count = 6;
  struct Detail {
    std::once_flag once;
    YarnPieces pieces;
  };
  std::shared_ptr<std::array<Detail, detail_lengths.size()>> details_;
};

}  // namespace selvedge
