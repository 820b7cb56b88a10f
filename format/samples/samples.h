// Radiance samples of a cell and their file (spec/samples.md): made by `bake` and `import`, read by `fit` and
// `compare`.
//
// Directions, texels and frame as in fabrics (fabric.h). Radiance is under unit perpendicular
// irradiance, in 1/sr with the light's cosine included, averaged over the yarn that is visible in the texel:
// it is not multiplied by opacity.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "format/base/memory.h"
#include "format/exr/exr.h"
#include "format/samples/header.h"

namespace selvedge {

/// The samples of one view, for all lights of the file (SamplesHeader::light_count()). Texels are indexed as
/// in fabric.h.
struct ViewSamples {
  std::vector<float> alpha;  ///< [texel], share of the rays that hit yarn
  /// [texel], mean of the visible normals, not normalised; 0 in a hole; mirrored if the view is from behind.
  std::vector<V3f> normal;
  std::vector<V3f> radiance;  ///< [light * texels + texel]
};

/// Ray-traced values for a set of pairs.
struct PairSamples {
  int width = 0;  ///< texels
  int height = 0;
  std::vector<DirectionPair> pairs;
  std::vector<float> alpha;        ///< [pair * texels + texel]
  std::vector<V3f> radiance;       ///< [pair * texels + texel]
  std::vector<V3f> noise;          ///< half the difference of alpha * radiance between two independent halves
  std::vector<float> alpha_noise;  ///< half the difference of alpha
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
  std::vector<float> alpha;   ///< [texel * views + view]
  std::vector<V3f> normal;    ///< [texel], sum over views of the visible normals
  std::vector<V3f> radiance;  ///< [(texel * views + view) * lights + light]
  int texels() const { return width * height; }
};

/// The samples of one side of the cloth, all directions mirrored into the upper hemisphere.
struct SideSamples {
  SamplesHeader header;  ///< with the pairs of this side
  SampleLevel level;     ///< level 0
  ByPairKind<PairSamples> pairs;
};
/// Precondition: the front, or header.both_sides.
SideSamples samples_of(const Samples& samples, Side side);
/// The same of one set of pairs.
PairSamples pairs_of(const PairSamples& all, Side side);

/// Rounds the samples to half precision, as their file stores them. SAMPLES_NOT_FINITE, with the place in the
/// file, for a sample that is NaN, infinite or negative, or beyond half precision. The issues:
/// FABRIC_PRECISION if rounding changes radiance by more than 5 % of the largest sample: all samples are too
/// dark.
Result<Issues> round_as_stored(Samples& samples);

/// Writes a file. Precondition: the samples have the sizes of their header, and are rounded.
Result<void> write_samples(const std::string& path, const Samples& samples);

/// Reads and checks a file. SAMPLES_NOT_FINITE, with the place, for NaN, infinite and negative samples.
Result<Samples> read_samples(const std::string& path, std::uint64_t memory = default_memory);
/// From memory; `name` is used in messages.
Result<Samples> read_samples(std::span<const std::uint8_t> bytes, const std::string& name,
                             const ExrLimits& limits = {});
/// The header of a file alone.
Result<SamplesHeader> read_samples_header(const std::string& path);

}  // namespace selvedge
