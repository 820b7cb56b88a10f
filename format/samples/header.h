// The header of a samples file and its attribute text (spec/samples.md).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "format/fabric/fabric.h"

namespace selvedge {

/// Sets of pairs of directions with the truth for each: validation pairs, by which a fit chooses; held-out
/// pairs, on which errors are measured; and pairs in which measured samples were taken, from which the grids
/// were interpolated and to which lobes are fitted.
enum class PairKind { validation, held_out, measured };
inline constexpr std::array all_pair_kinds{PairKind::validation, PairKind::held_out, PairKind::measured};
/// Values for each of them.
template <class Values>
using ByPairKind = std::array<Values, all_pair_kinds.size()>;

inline std::size_t index_of(PairKind kind) { return static_cast<std::size_t>(kind); }

/// The name of the part of the file: "validation", "held-out", "measured".
const char* name_of(PairKind kind);

/// The side of a pair.
inline Side side_of(const DirectionPair& pair) {
  const bool behind = pair.view.z < 0;
  if (behind == (pair.light.z < 0)) return behind ? Side::back : Side::front;
  return behind ? Side::back_through : Side::through;
}

/// The radiance scale is unused and 1.
struct SamplesHeader : FabricInfo {
  int width = 32;
  int height = 32;
  int samples_per_texel = 0;  ///< rays per texel and view
  int truth_samples = 0;      ///< rays per texel of the pair sets
  ByPairKind<std::vector<DirectionPair>> pairs;
  YarnCounts yarns;  ///< of the yarn of the file
  /// Views and lights: the directions of the grids, then the same mirrored in the plane of the cloth. Pairs
  /// may lie on any sides.
  bool both_sides = false;

  int texels() const { return width * height; }
  int sides() const { return both_sides ? 2 : 1; }
  int view_count() const { return sides() * views.count(); }
  int light_count() const { return sides() * lights.count(); }
};

/// All views of a file, or all lights.
std::vector<V3f> directions_of(const DirectionGrid& grid, bool both_sides);

/// The attribute text of a header, and back; `file` is for messages. SAMPLES_MALFORMED if the text breaks a
/// rule of spec/samples.md.
std::string samples_header_to_json(const SamplesHeader& header);
Result<SamplesHeader> samples_header_from_json(const std::string& text, const std::string& file);

}  // namespace selvedge
