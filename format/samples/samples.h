// The samples of one cell: what `bake` writes and `fit` and `compare` read (spec/samples.md).
//
// Directions, texels and frame are those of the fabric (fabric.h). Radiance is under unit perpendicular
// irradiance, in 1/sr with the light's cosine included, averaged over the yarn that is visible in the texel:
// it is not multiplied by opacity.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "format/exr/exr.h"
#include "format/samples/header.h"

namespace selvedge {

/// Rows of texels whose samples take at most so many bytes in memory; at least one, at most all.
int rows_within(const SamplesHeader& header, std::size_t bytes);

/// Everything seen from one view. Index of a texel as in fabric.h.
struct ViewSamples {
  std::vector<float> alpha;   ///< [texel], share of the rays that met yarn
  std::vector<V3f> normal;    ///< [texel], mean of the visible normals, not normalised; 0 in a hole
  std::vector<V3f> radiance;  ///< [light * texels + texel]
};

/// The truth of one set of pairs.
struct PairSamples {
  int width = 0;  ///< texels, as the header's
  int height = 0;
  std::vector<DirectionPair> pairs;
  std::vector<float> alpha;        ///< [pair * texels + texel]
  std::vector<V3f> radiance;       ///< [pair * texels + texel]
  std::vector<V3f> noise;          ///< half the difference of alpha * radiance between two independent halves
  std::vector<float> alpha_noise;  ///< the same of alpha
};

/// The samples of one mip level, or of some of its rows, texel by texel, as the fit takes them.
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

/// Streams samples to a file. At any time it holds one view (all of its lights and texels) or the pairs of
/// one call: memory does not grow with the number of views or pairs.
class SamplesWriter {
 public:
  static Result<SamplesWriter> create(const std::string& path, const SamplesHeader& header);
  /// Views in their order, then the pairs of each set in theirs, in as many calls as one likes.
  Result<void> write_view(const ViewSamples& samples);
  Result<void> write_pairs(PairKind kind, const PairSamples& samples);
  /// Once, where the header has slabs.
  Result<void> write_heights(const HeightLayer& heights);
  Result<void> commit() { return writer_.commit(); }
  /// FABRIC_PRECISION where half precision, in which samples are stored and without a scale, has changed
  /// radiance by more than 5 % of the largest that was written: all of it is too dark.
  Issues warnings() const;

 private:
  SamplesWriter(ExrWriter writer, SamplesHeader header);
  void take_note(std::span<const V3f> radiance);
  ExrWriter writer_;
  SamplesHeader header_;
  float largest_ = 0;  ///< radiance written
  float change_ = 0;   ///< largest difference from what is stored
};

/// Reads and checks; NaN, infinite and negative samples are refused with their place.
class SamplesReader {
 public:
  static Result<SamplesReader> open(const std::string& path);
  /// From memory; `name` is used in messages. The bytes must outlive the reader.
  static Result<SamplesReader> open(std::span<const std::uint8_t> bytes, const std::string& name,
                                    const ExrLimits& limits = {});
  const SamplesHeader& header() const { return header_; }
  const std::string& name() const { return reader_.name(); }
  /// Level 0, whole.
  Result<SampleLevel> read_level() { return read_rows(0, header_.height); }
  /// Rows of texels [first, first + count) of level 0, as a level that is `count` high.
  Result<SampleLevel> read_rows(int first, int count);
  Result<PairSamples> read_pairs(PairKind kind);
  /// Heights of level 0, mm. Precondition: header().slabs.
  Result<HeightLayer> read_heights();

 private:
  SamplesReader(ExrReader reader, SamplesHeader header);
  static Result<SamplesReader> open(Result<ExrReader> reader);
  ExrReader reader_;
  SamplesHeader header_;
};

}  // namespace selvedge
