// OpenEXR files: float and half channels in one or more parts, scanline or tiled with mip levels. They are
// written by OpenEXR (exr.cpp) and read by our own code (reader.cpp), which trusts nothing in a file.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"

namespace selvedge {

using ExrValue = std::variant<std::string, int, float, V2f, V3f>;

struct ExrChannel {
  std::string name;
  bool half = true;  ///< else 32-bit float
};

/// One part. Its data window begins at (0, 0). Level k of a mipmapped part has level_size() texels.
struct ExrPart {
  std::string name;
  int width = 0;
  int height = 0;
  bool tiled = false;      ///< else scanlines
  bool mipmapped = false;  ///< implies tiled; every level down to 1 x 1
  int levels = 1;
  int tile_width = 0;  ///< of a tiled part; 0: the writer chooses
  int tile_height = 0;
  /// One of none, rle, zips, zip, piz (lossless), pxr24, b44, b44a, dwaa, dwab (lossy).
  std::string compression = "zip";
  bool increasing_y = true;  ///< line order; else decreasing or, for tiles, any
  /// Whether the display window is the data window. Only read: the writer gives every part the first one's.
  bool display_is_data = true;
  std::vector<ExrChannel> channels;  ///< names unique within the part; read back in the file's order
  std::map<std::string, ExrValue> attributes;  ///< without those that every EXR file has
};

/// Whether the compression may change pixels. PXR24 keeps halves but rounds floats, so it counts as lossy.
bool is_lossy(std::string_view compression);

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
  std::uint64_t expansion = 2200;  ///< decoded floats per byte of a chunk; ZIP of black halves: 2,064
  int parts = 64;
  int channels = 1 << 15;
  int attributes = 1 << 12;  ///< of a part
};

/// Writes parts in their order, each level or row exactly once, rows from top to bottom. The file appears at
/// `path` with commit(). Its bytes do not depend on the number of threads.
class ExrWriter {
 public:
  /// A lossy or unknown compression is OPTION_OUT_OF_RANGE.
  static Result<ExrWriter> create(const std::string& path, std::vector<ExrPart> parts);
  ExrWriter(ExrWriter&&) noexcept;
  ExrWriter& operator=(ExrWriter&&) noexcept;
  ~ExrWriter();

  /// A value beyond the range of half precision (65,504) is an error, never rounded to infinity.
  Result<void> write_level(int part, int level, const ExrPixels& pixels);
  /// Appends rows to a scanline part: pixels.height rows of the part's width.
  Result<void> write_rows(int part, const ExrPixels& pixels);
  Result<void> commit();

 private:
  struct State;
  explicit ExrWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Checks the whole structure of the file when it is opened (scan.h) and reads pixels on demand. Rejects
/// deep parts, sub-sampled channels, unsigned channels, windows that do not begin at (0, 0) and level modes
/// other than one level or mip maps rounded down. A reader is not thread-safe; two readers of one file share
/// nothing.
class ExrReader {
 public:
  static Result<ExrReader> open(const std::string& path, const ExrLimits& limits = {});
  /// From memory; `name` is used in messages. The bytes must outlive the reader.
  static Result<ExrReader> open(std::span<const std::uint8_t> bytes, const std::string& name,
                                const ExrLimits& limits = {});
  ExrReader(ExrReader&&) noexcept;
  ExrReader& operator=(ExrReader&&) noexcept;
  ~ExrReader();

  const std::string& name() const;
  const std::vector<ExrPart>& parts() const;
  /// Index of the part with this name, or -1.
  int find_part(const std::string& part_name) const;
  /// Bytes of the file that were read so far, headers included, each counted once.
  std::uint64_t bytes_read() const;
  /// Compressed size of a level's pixels in the file, without the headers of the chunks.
  std::uint64_t packed_bytes(int part, int level = 0) const;
  /// EXR_UNSUPPORTED for parts in a lossy compression, although parts() lists them.
  Result<ExrPixels> read_level(int part, int level = 0);
  /// Rows [first, first + count) of a scanline part.
  Result<ExrPixels> read_rows(int part, int first, int count);

 private:
  struct State;
  explicit ExrReader(std::unique_ptr<State> state);
  static Result<ExrReader> open(std::unique_ptr<State> state);
  /// Rows [first, first + height) of a level that is `width` wide.
  Result<ExrPixels> read(int part, int level, int first, int width, int height);
  std::unique_ptr<State> state_;
};

/// XXH3-128 (xxHash 0.8) over the decoded pixels, as 32 lower-case hexadecimal digits: channels in byte order
/// of their names, each plane row by row from the top, little-endian in the channel's own precision.
std::string digest_of(const ExrPart& part, const ExrPixels& pixels);

}  // namespace selvedge
