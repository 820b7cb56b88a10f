// OpenEXR files of several parts, as fabric and samples files are: the subset of spec/fabric.md, "Container".
// They are read by our own code, which trusts nothing in a file; OpenEXR would not run in browsers, nor count
// the bytes of a file.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"

namespace selvedge {

struct ExrChannel {
  std::string name;
  bool is_half = true;  ///< else 32-bit float
};

/// One part. Its data window begins at (0, 0). Level k of a mipmapped part has level_size() texels.
struct ExrPart {
  std::string name{};
  int width = 0;
  int height = 0;
  bool has_mipmaps = false;  ///< tiles of every level down to 1 x 1; else scanlines of one level
  int levels = 1;
  V2i tile_size{0, 0};                 ///< size in pixels; (0, 0): the writer chooses
  bool is_zipped = true;               ///< compressed by ZIP; else not at all
  std::vector<ExrChannel> channels{};  ///< names unique within the part; read in the file's order
  std::map<std::string, std::string> attributes{};  ///< texts, without the attributes of every EXR file
};

/// Pixels of one level: planes[channel][y * width + x], channels in the order of ExrPart::channels.
struct ExrPixels {
  int width = 0;
  int height = 0;
  std::vector<std::vector<float>> planes;
};

/// Limits of a file, checked against the header before anything is allocated.
struct ExrLimits {
  std::uint64_t header_bytes = std::uint64_t{1} << 24;  ///< of all headers, without the offset tables
  std::uint64_t pixels_per_part = std::uint64_t{1} << 30;
  std::uint64_t bytes_per_read = std::uint64_t{1} << 32;  ///< of decoded floats
  std::uint64_t floats_per_byte = 2200;  ///< decoded floats per byte of a chunk; ZIP of black halves: 2,064
  int parts = 64;
  int channels = 1 << 15;
  int attributes = 1 << 12;  ///< of a part
};

/// The pixels of a level of a part, asked for once each.
using ExrPixelsAt = std::function<ExrPixels(int part, int level)>;

/// The bytes of a file of parts in their order; a single one of scanlines is a picture, which is not of the
/// subset; the same as OpenEXR writes, for any number of threads.
std::string exr_file(std::vector<ExrPart> parts, const ExrPixelsAt& pixels_at);

/// Writes it atomically. A value beyond the range of half precision (65,504) in a channel of halves is an
/// error, never rounded to infinity.
Result<void> write_exr_file(const std::string& path, const std::vector<ExrPart>& parts,
                            const ExrPixelsAt& pixels_at);

/// Bytes of the pixels of a level of a part in the file, without the headers of the chunks.
std::uint64_t exr_packed_bytes(ExrPart part, int level, const ExrPixels& pixels);

/// Checks headers, offset tables and headers of chunks when the file is opened, and reads pixels on demand.
/// EXR_MALFORMED for a file that breaks a rule of OpenEXR, EXR_UNSUPPORTED beyond the subset, FILE_DAMAGED
/// for tables and chunks that contradict the headers or reach beyond the file, FILE_TOO_LARGE beyond a limit.
/// A reader is not thread-safe; two readers of one file share nothing.
class ExrReader {
 public:
  static Result<ExrReader> open(const std::string& path, const ExrLimits& limits = {});
  /// From memory; `name` is used in messages. The bytes must outlive the reader.
  static Result<ExrReader> open(std::span<const std::uint8_t> bytes, const std::string& name,
                                const ExrLimits& limits = {});

  const std::string& path() const;
  const std::vector<ExrPart>& parts() const;
  /// Index of the part with this name, or -1.
  int find_part(const std::string& part_name) const;
  /// Compressed size of a level's pixels in the file, without the headers of the chunks.
  std::uint64_t packed_bytes(int part, int level = 0) const;
  Result<ExrPixels> read_level(int part, int level = 0);

 private:
  struct State;
  explicit ExrReader(std::shared_ptr<State> state) : state_(std::move(state)) {}
  static Result<ExrReader> open(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

/// XXH3-128 (xxHash 0.8) over the decoded pixels, as 32 lower-case hexadecimal digits: channels in byte order
/// of their names, each plane row by row from the top, little-endian in the channel's own precision.
std::string digest_of(const ExrPart& part, const ExrPixels& pixels);

}  // namespace selvedge
