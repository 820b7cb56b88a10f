// The memory that a document takes, reckoned from what it declares before anything of that size is allocated.
// A file of some kilobytes may declare terabytes: pictures of one colour, many instances of a large mesh,
// primitives that share their vertices. No single one of them is too large; together they are.
#pragma once

#include <cstdint>

#include "format/base/memory.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Bytes that one of these takes at most, reading and drawing.
namespace memory_price {
inline constexpr std::uint64_t json_value = 128;       ///< in the parsed text, beside the text itself
inline constexpr std::uint64_t vertex = 160;           ///< of a primitive, with what reading it takes
inline constexpr std::uint64_t index = 12;             ///< of a primitive
inline constexpr std::uint64_t instance = 320;         ///< of a primitive, without its vertices
inline constexpr std::uint64_t placed_vertex = 256;    ///< of an instance: surface, merged mesh, projection
inline constexpr std::uint64_t placed_triangle = 128;  ///< of an instance: corners and lists
inline constexpr std::uint64_t pixel = 16;             ///< of a decoded picture
inline constexpr std::uint64_t decoding = 24;          ///< of a pixel of the largest picture, beside that
}  // namespace memory_price

/// What a scene and its pictures, as drawing decodes them, leave of `limit` bytes; FILE_TOO_LARGE if that is
/// nothing. Pictures are reckoned by the sizes in their headers (picture_pixels).
Result<MemoryAccount> check_drawable(const Scene& scene, std::uint64_t limit);

}  // namespace selvedge
