// The memory that a document takes, reckoned from what it declares before anything of that size is allocated.
// A file of some kilobytes may declare terabytes: pictures of one colour, many instances of a large mesh,
// primitives that share their vertices. No single one of them is too large; together they are.
#pragma once

#include <cstdint>

#include "format/base/memory.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Bytes that one of these takes at most, reading and drawing.
inline constexpr std::uint64_t bytes_per_json_value = 128;  ///< in the parsed text, beside the text itself
inline constexpr std::uint64_t bytes_per_vertex = 160;      ///< of a primitive, with what reading it takes
inline constexpr std::uint64_t bytes_per_index = 12;        ///< of a primitive
inline constexpr std::uint64_t bytes_per_instance = 320;    ///< of a primitive, without its vertices
inline constexpr std::uint64_t bytes_per_placed_vertex =
    256;  ///< of an instance: surface, merged mesh, projection
inline constexpr std::uint64_t bytes_per_placed_triangle = 128;  ///< of an instance: corners and lists
inline constexpr std::uint64_t bytes_per_shaded_vertex =
    320;  ///< of an instance in an environment: fractions, light
inline constexpr std::uint64_t bytes_per_texture_pixel = 16;  ///< of a texture, with its levels
inline constexpr std::uint64_t bytes_per_unfinished_texture_pixel =
    24;  ///< of the largest texture, while it is made, beside that
inline constexpr std::uint64_t bytes_per_decoded_picture_pixel =
    8;  ///< of the largest picture, while it is decoded

/// Pixels that pictures may have for each of their bytes, and beyond that together.
inline constexpr std::uint64_t max_pixels_per_encoded_byte = 32;
inline constexpr std::uint64_t max_pixels_above_ratio = std::uint64_t{1} << 29;

/// The memory that a scene and its encoded pictures leave of `limit` bytes when they are drawn;
/// FILE_TOO_LARGE beyond it. Textures come on top, by what a frame shows of them
/// (viewer/light/picture_textures.h).
Result<MemoryBudget> check_scene_memory(const Scene& scene, std::uint64_t limit);

/// Whether textures of all its pictures fit as well, each in full size, as a frame from near may need them:
/// FILE_TOO_LARGE. They are reckoned by the sizes in their headers (picture_size).
Result<void> check_texture_memory(const Scene& scene, MemoryBudget budget);

/// Spends the bytes of textures of so many pixels in all and in the largest one, decoded from pictures of at
/// most `largest_picture_pixels`; false if that is more than there is.
bool try_spend_textures(MemoryBudget& budget, std::uint64_t texture_pixels,
                        std::uint64_t largest_texture_pixels, std::uint64_t largest_picture_pixels);

}  // namespace selvedge
