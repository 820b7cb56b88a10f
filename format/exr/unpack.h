// Codecs of EXR chunks: NONE, RLE, ZIPS and ZIP here, PIZ through OpenEXR (exr.cpp).
//
// OpenEXR 3.1 accepts a ZIP or RLE chunk that holds too few bytes and returns uninitialised memory for the
// missing pixels, and it decodes whole files only. Hence our own decoder for the codecs that fabrics and
// samples use.
#pragma once

#include <cstdint>
#include <span>

#include "format/exr/layout.h"

namespace selvedge {

/// Decodes the chunk into `pixels`: row by row from the top, within a row channel by channel in the part's
/// order, little-endian. False if the packed bytes do not decode to exactly this size. Preconditions: the
/// part's compression is lossless, and `pixels` has the size of the chunk.
bool exr_unpack(const ExrPart& part, const ExrChunk& chunk, std::span<const std::uint8_t> packed,
                std::span<std::uint8_t> pixels);

/// Size of a chunk's pixels after ZIP compression; may be larger than the pixels.
std::size_t exr_zip_size(std::span<const std::uint8_t> pixels);

/// exr_unpack() for PIZ, by OpenEXR from a file in memory that has this chunk alone.
bool exr_unpack_piz(const ExrPart& part, const ExrChunk& chunk, std::span<const std::uint8_t> packed,
                    std::span<std::uint8_t> pixels);

}  // namespace selvedge
