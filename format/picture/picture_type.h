// Types and sizes of encoded pictures by their first bytes; nothing is decoded.
#pragma once

#include <Imath/ImathVec.h>

#include <cstdint>
#include <span>
#include <string_view>

namespace selvedge {

/// The MIME type of an encoded picture, by its first bytes; "" for bytes of anything else, however short,
/// such as OpenEXR, which is no texture of glTF.
std::string_view picture_type(std::span<const std::uint8_t> bytes);

/// Width and height that the header of a PNG, a JPEG or a WebP declares; (0, 0) for files of other kinds,
/// which are never decoded, and without a readable header.
Imath::Vec2<std::int64_t> picture_size(std::span<const std::uint8_t> bytes);
/// Their product.
std::uint64_t picture_pixel_count(std::span<const std::uint8_t> bytes);

}  // namespace selvedge
