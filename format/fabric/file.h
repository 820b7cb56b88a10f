// A fabric as a file: the multi-part OpenEXR of spec/fabric.md.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "format/exr/exr.h"
#include "format/fabric/header.h"

namespace selvedge {

struct FabricWriteOptions {
  /// Layers in 16 bits, the others in 32. Under a large exponent half precision ruins a lobe.
  LayerSet half = table_layers;
  /// none, rle, zips, zip or piz. Lossy ones are refused, and what no codec is called: OPTION_OUT_OF_RANGE.
  std::string codec = "zip";
};

/// What the options' precision would change in it by more than a little: FABRIC_PRECISION, naming `path`.
Issues precision_warnings(const std::string& path, const Fabric& fabric, const FabricWriteOptions& options);

/// Writes atomically. Same fabric and options, same bytes. Refuses an invalid fabric and values that do not
/// fit into the chosen precision.
Result<void> write_fabric(const std::string& path, const Fabric& fabric,
                          const FabricWriteOptions& options = {});

/// The fabric as it will be read again: layers that are stored in 16 bits are rounded to them. Precondition:
/// it is valid (validate()).
Fabric as_stored(const Fabric& fabric, const LayerSet& half);

/// A fabric file of which parts are read on demand: a level, or some layers of it, costs the bytes and the
/// time of that part alone.
class FabricReader {
 public:
  /// Reads and checks the headers; no pixels.
  static Result<FabricReader> open(const std::string& path, const FabricLimits& limits = {});
  /// From memory; `name` is used in messages. The bytes must outlive the reader.
  static Result<FabricReader> open(std::span<const std::uint8_t> bytes, const std::string& name,
                                   const FabricLimits& limits = {});

  const std::string& name() const { return file_.name(); }
  const FabricHeader& header() const { return header_; }
  /// The attribute text as it stands in the file: a JSON object.
  const std::string& text() const { return text_; }
  /// The header digest, which tells files apart.
  std::string digest() const;
  /// The layers that the file has in 16 bits, all channels of their parts.
  LayerSet half() const;

  /// A level with those of the wanted layers that it has; digests and values are checked.
  /// Products come with their bases. Precondition: 0 <= level < header().levels.
  Result<FabricLevel> read_level(int level, LayerSet layers = LayerSet::all());
  /// Levels `first` to `last` as a fabric, `first` being its level 0 and Fabric::whole saying so.
  /// Precondition: both exist, in this order.
  Result<Fabric> read_levels(int first, int last, LayerSet layers = LayerSet::all());
  /// Everything.
  Result<Fabric> read() { return read_levels(0, header_.levels - 1); }

  /// Bytes that a level of a layer takes in the file, compressed; 0 where the level does not have it. The
  /// bases stand at level 0.
  std::uint64_t packed_bytes(LayerKind kind, int level) const;

  /// Bytes of the file that were read so far, headers included, each counted once.
  std::uint64_t bytes_read() const { return file_.bytes_read(); }

 private:
  FabricReader(ExrReader file, FabricHeader header, std::string text);
  static Result<FabricReader> open(Result<ExrReader> file, const FabricLimits& limits);

  Result<void> read_layer(LayerKind kind, int level, FabricLevel& into);
  /// The functions that all levels share; read once.
  Result<std::shared_ptr<const ProductBases>> bases();

  ExrReader file_;
  FabricHeader header_;
  std::shared_ptr<const ProductBases> bases_;
  std::string text_;
};

/// Reads all levels and layers, verifies every digest and validates every value.
Result<Fabric> read_fabric(const std::string& path, const FabricLimits& limits = {});
Result<Fabric> read_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                           const FabricLimits& limits = {});

/// The JSON text of the file's attribute, for `info`; checked for being a fabric's, nothing decoded.
Result<std::string> read_fabric_header(const std::string& path);

}  // namespace selvedge
