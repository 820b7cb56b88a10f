// Radiance samples of a cell and their file (spec/samples.md): made by `bake` and `import`, read by `fit` and
// `compare`.
//
// Directions, texels and frame as in fabrics (fabric.h). Radiance is under unit perpendicular
// irradiance, in 1/sr with the light's cosine included, averaged over the yarn that is visible in the texel:
// it is not multiplied by opacity.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "format/base/memory.h"
#include "format/exr/exr.h"
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

/// The radiance scale is unused and 1.
struct SamplesHeader : FabricInfo {
  int width = 32;
  int height = 32;
  int samples_per_texel = 0;  ///< rays or splatted points per texel and view
  int truth_samples = 0;      ///< the same per texel of the pair sets
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
std::vector<V3f> cell_directions(const DirectionGrid& grid, bool both_sides);

/// The attribute text of a header, and back; `file` is for messages. SAMPLES_MALFORMED if the text breaks a
/// rule of spec/samples.md.
std::string samples_header_to_json(const SamplesHeader& header);
Result<SamplesHeader> samples_header_from_json(const std::string& text, const std::string& file);

/// The samples of one view, for all lights of the file (SamplesHeader::light_count()). Texels are indexed as
/// in fabric.h.
struct ViewSamples {
  std::vector<float> alpha;  ///< [texel], fraction of the rays that hit yarn
  /// [texel], mean of the visible normals, not normalised; 0 in a hole; mirrored if the view is from behind.
  std::vector<V3f> normal;
  std::vector<V3f> radiance;  ///< [light * texels + texel]
};

/// Ray-traced values for a set of pairs.
struct PairSamples {
  int width = 0;  ///< texels
  int height = 0;
  std::vector<DirectionPair> pairs{};
  std::vector<float> alpha{};   ///< [pair * texels + texel]
  std::vector<V3f> radiance{};  ///< [pair * texels + texel]
  std::vector<V3f> noise{};     ///< half the difference of alpha * radiance between two independent halves
  std::vector<float> alpha_noise{};  ///< half the difference of alpha
};

/// All samples of a cell.
struct Samples {
  SamplesHeader header;
  std::vector<ViewSamples> views;  ///< header.view_count()
  ByPairKind<PairSamples> pairs;   ///< of the pairs of the header
  YarnData yarns;                  ///< header.yarns counts them
};

/// The samples of a mip level in the order in which they are fitted.
struct SampleLevel {
  int width = 0;
  int height = 0;
  int views = 0;
  int lights = 0;
  std::vector<float> alpha{};     ///< [texel * views + view]
  std::vector<V3f> normal_sum{};  ///< [texel], sum over views of the visible normals
  std::vector<V3f> radiance{};    ///< [(texel * views + view) * lights + light]
  int texels() const { return width * height; }
};

/// The samples of one side of the cloth, all directions mirrored into the upper hemisphere.
struct SideSamples {
  SamplesHeader header;  ///< with the pairs of this side
  SampleLevel level;     ///< level 0
  ByPairKind<PairSamples> pairs;
};
/// Precondition: the front, or header.both_sides.
SideSamples side_samples(const Samples& samples, Side side);
/// The same of the only side that is asked for: frees the views on the way.
SideSamples take_side_samples(Samples& samples, Side side);
/// The same of one set of pairs.
PairSamples side_pairs(const PairSamples& all, Side side);

/// Rounds the samples to half precision, as their file stores them. SAMPLES_NOT_FINITE, with the place in the
/// file, for a sample that is NaN, infinite or negative, or beyond half precision.
Result<void> round_to_half(Samples& samples);

/// Writes a file. Precondition: the samples have the sizes of their header, and are rounded.
Result<void> write_samples(const std::string& path, const Samples& samples);

/// Reads and checks a file. SAMPLES_NOT_FINITE, with the place, for NaN, infinite and negative samples.
Result<Samples> read_samples(const std::string& path, std::uint64_t memory = default_memory_limit);
/// From memory; `name` is used in messages.
Result<Samples> read_samples(std::span<const std::uint8_t> bytes, const std::string& name,
                             const ExrLimits& limits = {});
/// The header of a file alone.
Result<SamplesHeader> read_samples_header(const std::string& path);

}  // namespace selvedge
