// Chunks of files, and the sizes of files that ExrWriter makes, counted without writing them.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "format/exr/layout.h"

namespace selvedge {

/// The pixels of a chunk as a file has them, packed by ZIP where that makes them smaller.
std::vector<std::uint8_t> encode_exr_chunk(const ExrPart& part, const ExrChunk& chunk,
                                           const ExrPixels& pixels);

/// Refuses values beyond the range of half precision, and those that are no numbers, in channels of halves.
Result<void> check_halves(const ExrPart& part, const ExrPixels& pixels, const std::string& file);

/// Bytes of the pixels of a level of a part in the file, without the headers of the chunks.
std::uint64_t exr_packed_bytes(ExrPart part, int level, const ExrPixels& pixels);

/// Size of the file of parts with these pixels.
std::uint64_t exr_file_bytes(std::vector<ExrPart> parts,
                             const std::function<ExrPixels(int part, int level)>& pixels_at);

}  // namespace selvedge
