// Sizes of files that ExrWriter makes, counted without writing them.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "format/exr/exr.h"

namespace selvedge {

/// Bytes of the pixels of a level of a part in the file, without the headers of the chunks.
std::uint64_t exr_packed_bytes(ExrPart part, int level, const ExrPixels& pixels);

/// Size of the file of parts with these pixels.
std::uint64_t exr_file_bytes(std::vector<ExrPart> parts,
                             const std::function<ExrPixels(int part, int level)>& pixels_at);

}  // namespace selvedge
