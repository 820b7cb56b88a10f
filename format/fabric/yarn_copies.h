// Yarn as copies of a few kinds of pieces (spec/fabric.md, "Pieces"): a repeat of a thousand stitches has
// some dozens of them.
#pragma once

#include <span>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

struct YarnCurve;
struct YarnData;

/// Piece i of all curves begins at node i x `nodes` of YarnData.
struct YarnCopies {
  int nodes = 0;             ///< of each piece; 0: the yarn has no pieces
  int stations = 0;          ///< of each kind
  std::vector<V3f> starts;   ///< mm, of the pieces, curve by curve
  std::vector<int> kind_of;  ///< of each piece
  /// [kind][node], mm: from the point of the straight line to the next piece's start, at equal steps.
  std::vector<V3f> shape;
  std::vector<V3f> squeezes;  ///< [kind][node] where a curve is squashed; else empty
  /// [kind][station], as YarnData has them. Angles count from the direction that is up at the piece's start,
  /// carried along.
  std::vector<float> light, light_through;
  int kinds() const { return nodes == 0 ? 0 : static_cast<int>(shape.size()) / nodes; }
  bool operator==(const YarnCopies&) const = default;
};

/// Up made perpendicular to the unit tangent, or the x axis where it stands too steeply: angles about a chain
/// and about a piece count from that at its start.
V3d upward_across(const V3d& tangent);

/// Tangents of a curve's nodes and the directions that its angles count from, unit.
struct ChainFrames {
  std::vector<V3d> tangent, across;
  std::vector<double> length;  ///< up to the node by straight lines, mm; then of the whole chain
  double closing_angle = 0;    ///< angle that carrying along the whole chain leaves, which is spread over it
};
ChainFrames chain_frames(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period);

/// Angle from the direction of the piece that begins at node `start` to the chain's, at a fraction of the
/// chain's length.
double angle_from_piece(const ChainFrames& frames, std::size_t start, double fraction);

/// Adds a station's light, as factors of functions of angles which count from a direction that is turned by
/// `angle` about the yarn.
void add_rotated_light(std::span<const float> from, double angle, double weight, bool sides,
                       std::span<float> to);

/// Sets nodes, squeezes and light of all curves from the pieces; of curves that have squeezes, those.
/// Precondition: the nodes that each curve counts are a multiple of a piece's, and all pieces are there.
void expand_copies(YarnData& data, const V2f& period);

}  // namespace selvedge
