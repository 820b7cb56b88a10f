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
  LayerSet half = table_layers;
  /// none, rle, zips, zip or piz. OPTION_OUT_OF_RANGE for lossy and unknown codecs.
  std::string codec = "zip";
};

/// FABRIC_PRECISION for layers that the options' precision would change too much (warnings.h); file: `path`.
Issues precision_warnings(const std::string& path, const Fabric& fabric, const FabricWriteOptions& options);

/// Writes atomically; the same fabric and options give the same bytes. Refuses an invalid fabric (validate())
/// and values beyond the range of the chosen precision.
Result<void> write_fabric(const std::string& path, const Fabric& fabric,
                          const FabricWriteOptions& options = {});

/// The fabric as a reader of its file gets it: layers of `half` are rounded to 16 bits. Precondition: the
/// fabric is valid (validate()).
Fabric as_stored(const Fabric& fabric, const LayerSet& half);

/// Reads levels and layers of a fabric file on demand.
class FabricReader {
 public:
  /// Reads and checks the headers; no pixels.
  static Result<FabricReader> open(const std::string& path, const FabricLimits& limits = {});
  /// From memory; `name` is used in messages. The bytes must outlive the reader.
  static Result<FabricReader> open(std::span<const std::uint8_t> bytes, const std::string& name,
                                   const FabricLimits& limits = {});

  const std::string& name() const { return file_.name(); }
  const FabricHeader& header() const { return header_; }
  /// The attribute text as stored: a JSON object.
  const std::string& text() const { return text_; }
  /// The header digest, which differs between fabrics.
  std::string digest() const;
  /// The layers that the file has in 16 bits, in all channels of their parts.
  LayerSet half() const;

  /// Bytes that these layers of levels [first, last] take at most, with what reading them takes, but for the
  /// cells of yarn. Precondition: both levels exist.
  std::uint64_t memory_of(int first, int last, const LayerSet& layers = LayerSet::all()) const;
  /// The memory of FabricLimits from now on.
  void allow_memory(std::uint64_t bytes) { memory_ = bytes; }

  /// A level of the front with those of `layers` that it has, and the bases of its products; checks digests
  /// and values. FILE_TOO_LARGE beyond the memory of FabricLimits. Precondition: 0 <= level <
  /// header().levels.
  Result<FabricLevel> read_level(int level, LayerSet layers = LayerSet::all());
  /// Levels [first, last] of all sides as a fabric, with Fabric::whole if it is a partial one. Precondition:
  /// both levels exist, and first <= last.
  Result<Fabric> read_levels(int first, int last, LayerSet layers = LayerSet::all());
  Result<Fabric> read() { return read_levels(0, header_.levels - 1); }

  /// Compressed size of a level of a layer in the file; 0 if the level does not have it. The bases are at
  /// level 0.
  std::uint64_t packed_bytes(LayerKind kind, int level, Side side = Side::front) const;

  /// Bytes of the file that were read so far, headers included, each counted once.
  std::uint64_t bytes_read() const { return file_.bytes_read(); }

 private:
  FabricReader(ExrReader file, FabricHeader header, std::string text, std::uint64_t memory);
  static Result<FabricReader> open(Result<ExrReader> file, const FabricLimits& limits);

  /// `room`: bytes for the cells of yarn.
  Result<FabricLevel> read_level(const FabricHeader& side, int level, const LayerSet& layers,
                                 std::uint64_t room);
  Result<void> check_memory(int first, int last, const LayerSet& layers) const;
  Result<void> read_layer(const FabricHeader& side, LayerKind kind, int level, FabricLevel& result);
  /// The functions that all levels share; read once.
  Result<std::shared_ptr<const ProductBases>> bases(const FabricHeader& side);

  ExrReader file_;
  FabricHeader header_;
  std::array<std::shared_ptr<const ProductBases>, all_sides.size()> bases_;
  std::string text_;
  std::uint64_t memory_;
};

/// Reads all levels and layers, verifies every digest and validates every value.
Result<Fabric> read_fabric(const std::string& path, const FabricLimits& limits = {});
Result<Fabric> read_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                           const FabricLimits& limits = {});

}  // namespace selvedge
