// Pictures as arrays of floats, read and written by OpenImageIO (openimageio.h); format/exr
// writes OpenEXR.
//
// Row 0 is the top row; pixel (x, y), channel c is pixels[(y * width + x) * channels + c]. Values are linear
// unless a function says otherwise; 1 is the white of an 8-bit picture. Alpha is never multiplied in or
// divided out: it is unassociated in PNG files; in EXR files that is up to the writer.
#pragma once

#include <Imath/ImathBox.h>

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/base/memory.h"
#include "format/base/mip.h"
#include "format/base/srgb.h"
#include "format/base/vec.h"

namespace selvedge {

struct Image {
  int width = 0;
  int height = 0;
  int channels = 4;
  std::vector<float> pixels;
  Imath::Box2i display_window{};       ///< the display window of OpenEXR, in pixels; empty: the picture
  std::vector<std::string> remarks{};  ///< what was chosen in its file
};

/// Whether the last channel is opacity: in images with two or four channels.
inline bool has_alpha(const Image& image) { return image.channels == 2 || image.channels == 4; }

/// Encoding of the colour channels in integer files (PNG, JPEG, WebP). Alpha and floating-point files are
/// always read and written unchanged.
enum class Transfer {
  keep,  ///< stored value / full scale, e.g. for normals; still sRGB-encoded if the file is
  srgb,  ///< linear in memory, sRGB-encoded in the file
};

/// Largest picture that is read or written.
struct ImageLimits {
  int side = 32768;
  std::int64_t pixels = std::int64_t{1} << 28;
  /// Bytes of the file, its pixels as they are stored, and the picture; of garments others reckon them.
  std::uint64_t memory = std::numeric_limits<std::uint64_t>::max();
};

/// Reads a file of PNG, JPEG, WebP, TIFF, OpenEXR, Radiance HDR or PNM, by its first bytes: the finest level;
/// always four channels: grey is repeated, a missing alpha is 1. OpenEXR: of the layers of all parts with R,
/// G and B the one without a name, combined, beauty, rgba, not a right view; else another, with a remark,
/// rather one that is not black; its data window; converted to Rec. 709 from its chromaticities.
/// IMAGE_UNREADABLE for others, FILE_TOO_LARGE beyond `memory`.
Result<Image> read_image(const std::string& path, Transfer transfer = Transfer::srgb,
                         std::uint64_t memory = default_memory_limit);

/// As read_image(), from a whole PNG, JPEG or WebP file in memory, as garments bring them. `name` is the file
/// in errors.
Result<Image> decode_image(std::span<const std::uint8_t> bytes, const std::string& name,
                           Transfer transfer = Transfer::srgb, const ImageLimits& limits = {});

/// The picture of decode_image() in some sizes, halved `halvings` times, to level_size(): its pixels are
/// the means of those that they cover (a pixel at an edge counts for one side), after the transfer. The
/// limits are of the picture in the file, which is decoded once; only a strip of it is in memory, as far as
/// its format allows.
Result<std::vector<Image>> decode_levels(std::span<const std::uint8_t> bytes, const std::string& name,
                                         Transfer transfer, const ImageLimits& limits,
                                         std::span<const int> halvings);

/// Refuses an image whose values are not as many as its size and channels imply; `name` is the file.
Result<void> check_image_shape(const Image& image, const std::string& name);

/// An 8-bit PNG file as bytes; 1 to 4 channels. Values are clamped to [0, 1], NaN becomes 0. The same pixels
/// give the same bytes.
Result<std::vector<std::uint8_t>> encode_png(const Image& image, Transfer transfer = Transfer::srgb);

/// Writes the bytes of encode_png() atomically.
Result<void> write_png(const std::string& path, const Image& image, Transfer transfer = Transfer::srgb);

/// Adds a text to a PNG file in memory, in a chunk tEXt: `key` of 1 to 79 characters, all of Latin-1.
void add_png_text(const std::string& key, const std::string& text, std::vector<std::uint8_t>& png);
/// The text under a key; empty without one, or without a PNG file.
std::string png_text(const std::string& path, const std::string& key);

/// Atomically writes an OpenEXR file of 32-bit floats, ZIP, channels R, G, B, A (the first `channels` of
/// them; one channel is called Y). Without a time stamp, so that the same pixels give the same bytes.
Result<void> write_exr(const std::string& path, const Image& image);

/// Decodes a file of RGBE whose first bytes are "#?" and whose rows come from the top, left to right, flat or
/// in runs of components; divided by its EXPOSURE and COLORCORR, of its PRIMARIES. IMAGE_UNREADABLE for other
/// bytes, FILE_TOO_LARGE beyond `limits`.
Result<Image> decode_hdr(std::span<const std::uint8_t> bytes, const std::string& name,
                         const ImageLimits& limits);

}  // namespace selvedge
