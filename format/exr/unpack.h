// The codecs of EXR chunks that the reader decodes: NONE, RLE, ZIPS and ZIP here, PIZ through OpenEXR
// (exr.cpp).
//
// OpenEXR 3.1 accepts a ZIP or RLE chunk that holds too few bytes and gives the rest of the
// pixels out of memory that it never filled; and its decoder wants the whole file. Hence our own for the
// codecs that fabrics and samples are written with.
#pragma once

#include <cstdint>
#include <span>

#include "format/exr/layout.h"

namespace selvedge {

/// Fills `pixels` with the chunk: row by row from the top, within a row channel by channel in the part's
/// order, little-endian. False where the packed bytes do not decode to exactly that many. The part's
/// compression must be lossless, and `pixels` of the chunk's size.
bool exr_unpack(const ExrPart& part, const ExrChunk& chunk, std::span<const std::uint8_t> packed,
                std::span<std::uint8_t> pixels);

/// How many bytes ZIP makes of a chunk's pixels; more than they are where it cannot make them fewer.
std::size_t exr_zip_size(std::span<const std::uint8_t> pixels);

/// exr_unpack() for PIZ. OpenEXR sees a file of this one chunk, with a header of ours.
bool exr_unpack_piz(const ExrPart& part, const ExrChunk& chunk, std::span<const std::uint8_t> packed,
                    std::span<std::uint8_t> pixels);

}  // namespace selvedge
