// An OpenEXR file taken apart and put together again, for the mutators: its headers, and its chunks in the
// order of the offset tables. Reads what our own writer writes and, as far as it goes, what became of that.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "format/exr/exr.h"

namespace selvedge::fuzz {

struct ExrAttribute {
  std::string name;
  std::string type;
  std::string value;
};

struct ExrHeader {
  std::vector<ExrAttribute> attributes;
  /// Its value, or nothing.
  const std::string* find(const std::string& name) const;
  std::string* find(const std::string& name);
};

struct ExrChunk {
  std::size_t part = 0;  ///< whose offset table it stands in
  std::vector<std::int32_t>
      place;         ///< as stored before the size: part number, then the row or the tile and level
  std::string data;  ///< packed
};

struct ExrFile {
  std::uint32_t version = 0x1002;  ///< of several parts
  std::vector<ExrHeader> headers;
  std::vector<ExrChunk> chunks;  ///< part by part
};

std::optional<ExrFile> take_apart(const std::string& bytes);

/// The file of these headers and chunks; all offsets and sizes are true.
std::string put_together(const ExrFile& file);

/// A part as ExrReader would give it: name, channels, size of level 0; nothing if the header does not say.
std::optional<ExrPart> part_of(const ExrHeader& header);

/// The pixels of a chunk that holds `width` x `height` of them, without its compression: none or ZIP.
std::optional<std::string> unpack(const std::string& packed, char compression, std::size_t size);
std::string pack(const std::string& pixels, char compression);

}  // namespace selvedge::fuzz
