// Radiance samples of a cell and their file (spec/samples.md), written by `bake`, read by `fit` and
// `compare`.
//
// Directions, texels and frame are those of the fabric (fabric.h). Radiance is under unit perpendicular
// irradiance, in 1/sr with the light's cosine included, averaged over the yarn that is visible in the texel:
// it is not multiplied by opacity.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "format/exr/exr.h"
#include "format/samples/header.h"

namespace selvedge {

/// Number of rows of texels with samples of at most `bytes` bytes in memory; at least one, at most all.
int max_rows(const SamplesHeader& header, std::size_t bytes);

/// What samples may be.
inline bool is_radiance(float value) { return std::isfinite(value) && value >= 0; }
inline bool is_opacity(float value) { return value >= 0 && value <= 1; }

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

/// The samples of a mip level, or of some of its rows, in the order in which they are fitted.
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

/// Writes samples to a file as they come; holds at most one view or the pairs of one call in memory.
class SamplesWriter {
 public:
  static Result<SamplesWriter> create(const std::string& path, const SamplesHeader& header);
  /// First all views in their order, then the pairs of each set in their order, in any number of calls.
  Result<void> write_view(const ViewSamples& samples);
  Result<void> write_pairs(PairKind kind, const PairSamples& samples);
  /// Once, where the header has yarns.
  Result<void> write_yarns(const YarnData& yarns);
  Result<void> commit() { return writer_.commit(); }
  /// FABRIC_PRECISION if the rounding to half precision, which has no scale here, changed radiance by more
  /// than 5 % of the largest value: all samples are too dark.
  Issues warnings() const;

 private:
  SamplesWriter(ExrWriter writer, SamplesHeader header);
  void update_precision(std::span<const V3f> radiance);
  ExrWriter writer_;
  SamplesHeader header_;
  float max_radiance_ = 0;
  float max_rounding_ = 0;  ///< largest difference between radiance and its stored value
};

/// Reads and checks a samples file. SAMPLES_NOT_FINITE, with the place, for NaN, infinite and negative
/// samples.
class SamplesReader {
 public:
  static Result<SamplesReader> open(const std::string& path);
  /// From memory; `name` is used in messages. The bytes must outlive the reader.
  static Result<SamplesReader> open(std::span<const std::uint8_t> bytes, const std::string& name,
                                    const ExrLimits& limits = {});
  /// With the pairs of the selected side, mirrored like all its directions into the upper hemisphere.
  const SamplesHeader& header() const { return header_; }
  /// Which side the levels and pairs are of that are read; the front at first. Precondition: the front, or
  /// header().both_sides.
  void select(Side side);
  const std::string& name() const { return reader_.name(); }
  /// All of level 0.
  Result<SampleLevel> read_level() { return read_rows(0, header_.height); }
  /// Rows of texels [first, first + count) of level 0, as a level of height `count`.
  Result<SampleLevel> read_rows(int first, int count);
  Result<PairSamples> read_pairs(PairKind kind);
  /// Precondition: header().yarns has curves.
  Result<YarnData> read_yarns();

 private:
  SamplesReader(ExrReader reader, SamplesHeader header);
  static Result<SamplesReader> open(Result<ExrReader> reader);
  ExrReader reader_;
  SamplesHeader file_header_;
  SamplesHeader header_;
};

}  // namespace selvedge
