// The surface of a stitch's yarns as an implicit function (Daubert et al. 2001, section 4: implicit surfaces
// around skeletons of Bézier curves).
//
//   f(p) = minimum over all yarns and their copies of ( distance from p to the yarn's curve - its radius
//   there )
//
// in millimetres, negative inside. The distance is to the cubic curve itself, not to a polyline. Of flat yarn
// it is that in its round section (format/fabric/yarn_section.h): no more than the distance, and no less than
// its flattening times it.
#pragma once

#include <cstdint>
#include <vector>

#include "converter/stitch/pattern.h"

namespace selvedge {

/// The function at one point, and the nearest yarn.
struct SurfaceSample {
  double distance = 0;    ///< f, mm
  V3d gradient{0, 0, 0};  ///< unit, away from the nearest skeleton; zero on the skeleton and beyond the reach
  V3d round_gradient{0, 0, 0};  ///< the gradient in the round section, unit
  V3d squeeze{0, 0, 0};         ///< of the section
  V3d tangent{0, 0, 0};         ///< unit, along the nearest yarn; zero beyond the reach
  int yarn = -1;                ///< index of the nearest yarn; -1 beyond the reach
  double radius_slope = 0;      ///< change of its radius, mm a mm along the tangent
};

class ImplicitSurface {
 public:
  /// Precondition: validate(pattern) holds. f is exact below `reach` mm and `reach` beyond. Refuses
  /// (mesh_invalid) yarns so long and thin that their index exceeds its limit of memory; `file` is for the
  /// message.
  static Result<ImplicitSurface> build(const StitchPattern& pattern, double reach, const std::string& file);

  /// f at any finite point; periodic in x and y, deterministic to the bit.
  double distance(const V3d& point) const { return sample(point).distance; }
  SurfaceSample sample(const V3d& point) const;

  /// Pieces of yarn that a point of the cell is held against, in the mean.
  double pieces_per_point() const {
    return static_cast<double>(entries_.size()) / static_cast<double>(bin_start_.size() - 1);
  }

  /// Conservative lowest and highest z of the surface, mm.
  double z_low() const { return low_; }
  double z_high() const { return high_; }

 private:
  friend Result<double> minimum_clearance(const StitchPattern& pattern, const std::string& file);

  struct Piece {
    BezierSegment segment;
    CurveSpan span;
    double radius = 0;  ///< half the width, the larger one of both ends
    int yarn = 0;
    double start_length = 0;  ///< along the yarn's chain, by chords, mm
    double start_radius = 0;
    double end_radius = 0;
    V3d start_squeeze{0, 0, 0};
    V3d end_squeeze{0, 0, 0};
    double min_fraction = 1;  ///< of thickness in width
    /// The nearest point is sought in the section of a ply's middle; across a yarn it is the nearest of all.
    V3d search_squeeze{0, 0, 0};
    /// Fraction of the way from start to end.
    double part(double t) const { return (t - span.t0) / (span.t1 - span.t0); }
    double length() const { return (span.end - span.start).length(); }
    double radius_at(double t) const { return start_radius + part(t) * (end_radius - start_radius); }
    bool flat() const { return min_fraction < 1; }
    /// As flat as between both ends, also where the yarn turns.
    V3d squeeze_at(double t) const;
    double nearest_to(const V3d& point) const;
  };
  struct Entry {
    std::int32_t piece;
    std::int16_t shift_x, shift_y;  ///< the copy, in periods
  };

  /// Cuts yarns into pieces and finds the bounds of z.
  static Result<ImplicitSurface> cut(const StitchPattern& pattern, const std::string& file);
  /// Fills the bins, about `size` mm wide; false if the limit of memory is exceeded.
  bool index(double size);
  /// Calls visit(bin, entry) for every bin of the cell within reach of a copy of a piece, until it returns
  /// false.
  template <class Visit>
  bool for_each_entry(std::size_t piece, const Visit& visit) const;
  /// Whether a place of a piece is less than pi radii along the yarn from one of another, moved by periods.
  bool are_adjacent(const Piece& a, double ta, const Piece& b, double tb, const V2i& shift) const;
  std::size_t bin_of(const V3d& wrapped) const;
  V3d wrap(const V3d& point) const;

  V2d period_{1, 1};
  double reach_ = 0;
  double low_ = 0;
  double high_ = 0;
  V3i bins_{1, 1, 1};
  V3d bin_size_{1, 1, 1};
  std::vector<Piece> pieces_;
  std::vector<std::uint32_t> bin_start_;
  std::vector<Entry> entries_;
  std::vector<double> yarn_length_;
  std::vector<V2i> turns_;  ///< of yarns: periods that their chains take
};

/// Most distances of points from pieces of yarn that are computed to find a clearance: some seconds.
constexpr double max_clearance_distances = 5e8;

/// The minimum distance between yarn surfaces, mm: the distance of the centre lines minus both radii (of flat
/// yarn, of the sections in the direction in which there is most room), negative if yarns overlap, at most
/// the largest radius. Covers all pairs, copies in other cells included, except parts of one yarn less than
/// pi radii apart along it: a yarn bent no tighter than its own radius does not touch itself there (Schur's
/// comparison theorem). Sampled at points 1/16 radius apart along the yarns: too large by at most 1e-3 radii
/// where yarns cross. Refuses (mesh_invalid) yarns that are too many and too close. Precondition:
/// validate(pattern) holds.
Result<double> minimum_clearance(const StitchPattern& pattern, const std::string& file);

}  // namespace selvedge
