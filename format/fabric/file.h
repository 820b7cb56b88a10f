// Reading and writing of fabric files, the multi-part OpenEXR files of spec/fabric.md.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "format/exr/exr.h"
#include "format/fabric/header.h"

namespace selvedge {

struct FabricWriteOptions {
  /// Layers in 16 bits, the others in 32. Half precision ruins a lobe with a large exponent.
  LayerSet half_layers = half_precision_layers;
};

/// Writes atomically; the same fabric and options give the same bytes. Refuses values that a reader
/// refuses, such as NaN, and those beyond the range of the chosen precision.
Result<void> write_fabric(const std::string& path, const Fabric& fabric,
                          const FabricWriteOptions& options = {});

/// The fabric as a reader of its file gets it: layers of `half` are rounded to 16 bits.
Fabric round_to_stored_precision(const Fabric& fabric, const LayerSet& half);

/// The header digest, over the attribute text and the names of all parts and channels, so that exchanged
/// names are detected.
std::string header_digest(const std::string& text, const std::vector<ExrPart>& parts);

/// The attribute text as stored; null if part 0 has none.
const std::string* fabric_header_text(const std::vector<ExrPart>& parts);

/// Reads a fabric file: first the headers, then everything. The functions with a sink are the one
/// implementation of the rules of spec/fabric.md: they go on after an error, as far as that makes sense, and
/// the others return the first error that they find.
class FabricReader {
 public:
  /// Reads and checks the headers; no pixels.
  static Result<FabricReader> open(const std::string& path, const FabricLimits& limits = {});
  /// From memory; `name` is used in messages. The bytes must outlive the reader.
  static Result<FabricReader> open(std::span<const std::uint8_t> bytes, const std::string& name,
                                   const FabricLimits& limits = {});
  static std::optional<FabricReader> open(ExrReader file, const FabricLimits& limits, IssueSink& sink);

  const std::string& path() const { return file_.path(); }
  const FabricHeader& header() const { return header_; }
  /// The attribute text as stored: a JSON object.
  const std::string& header_text() const { return *fabric_header_text(file_.parts()); }

  /// Bytes that the fabric takes at most, with what reading it takes, but for the cells of yarn.
  std::uint64_t peak_memory_bytes() const;
  /// The memory of FabricLimits from now on.
  void set_memory_limit(std::uint64_t bytes) { memory_ = bytes; }

  /// Reads all levels and layers; checks digests and values. FILE_TOO_LARGE beyond the memory of
  /// FabricLimits.
  Result<Fabric> read();
  std::optional<Fabric> read(IssueSink& sink);

  /// Compressed size of a level of a layer in the file; 0 if the level does not have it. The bases are at
  /// level 0.
  std::uint64_t packed_bytes(LayerKind kind, int level, Side side = Side::front) const;
  /// Whether the file has some channel of the layer in 16 bits.
  bool is_half(LayerKind kind, Side side = Side::front) const;

 private:
  FabricReader(ExrReader file, FabricHeader header, std::uint64_t memory)
      : file_(std::move(file)), header_(std::move(header)), memory_(memory) {}

  Fabric read_side(const FabricHeader& side, IssueSink& sink);

  ExrReader file_;
  FabricHeader header_;
  std::uint64_t memory_;
};

/// Reads all levels and layers, verifies every digest and validates every value.
Result<Fabric> read_fabric(const std::string& path, const FabricLimits& limits = {});
Result<Fabric> read_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                           const FabricLimits& limits = {});

/// Size of the file that write_fabric() makes. Refuses an invalid fabric, but not values beyond the
/// precision.
Result<std::uint64_t> fabric_file_bytes(const Fabric& fabric, const FabricWriteOptions& options = {});

/// The limits of the file that has the fabric.
ExrLimits exr_limits(const FabricLimits& limits);

}  // namespace selvedge
