// Pictures as arrays of floats, read and written by OpenImageIO (openimageio.h).
//
// Row 0 is the top row; pixel (x, y), channel c is pixels[(y * width + x) * channels + c]. Values are linear
// unless a function says otherwise; 1 is the white of an 8-bit picture. Alpha is never multiplied in or
// divided out: PNG holds it unassociated, EXR as its writer meant it.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

struct Image {
  int width = 0;
  int height = 0;
  int channels = 4;
  std::vector<float> pixels;
};

/// Whether the last channel is opacity: of two or four.
inline bool has_alpha(const Image& image) { return image.channels == 2 || image.channels == 4; }

/// What happens to the colour channels of integer files (PNG, JPEG) on reading, and on writing to PNG.
/// Alpha and floating-point files are left alone in either case.
enum class Transfer {
  keep,  ///< stored value / full scale: still sRGB-encoded if the file is, or data such as normals
  srgb,  ///< linear in memory, sRGB-encoded in the file
};

/// Largest picture that is read or written.
struct ImageLimits {
  int side = 32768;
  std::int64_t pixels = std::int64_t{1} << 28;
};

/// Any format OpenImageIO knows, first part, finest level; always four channels: grey is repeated, a missing
/// alpha is 1. EXR: the channels R, G, B, A (or the first ones where the file has no such names).
Result<Image> read_image(const std::string& path, Transfer transfer = Transfer::srgb,
                         const ImageLimits& limits = {});

/// The same from a whole file in memory (PNG, JPEG, EXR ...). `name` stands for the file in errors.
Result<Image> decode_image(std::span<const std::uint8_t> bytes, const std::string& name,
                           Transfer transfer = Transfer::srgb, const ImageLimits& limits = {});

/// An 8-bit PNG file as bytes; 1 to 4 channels. Values are clamped to [0, 1], NaN becomes 0. The same pixels
/// give the same bytes.
Result<std::vector<std::uint8_t>> encode_png(const Image& image, Transfer transfer = Transfer::srgb);

/// `encode_png` into a file, whole or not at all.
Result<void> write_png(const std::string& path, const Image& image, Transfer transfer = Transfer::srgb);

/// An OpenEXR file of 32-bit floats, ZIP, channels R, G, B, A (the first `channels` of them; one channel is
/// called Y), whole or not at all. No time stamp: the same pixels give the same bytes.
Result<void> write_exr(const std::string& path, const Image& image);

/// IMAGE_MISMATCH unless the pictures have the same size and channels.
Result<void> check_same_size(const Image& a, const Image& b);

/// How far two pictures are apart, over all channels but for `psnr`.
struct ImageDifference {
  double max_absolute = 0;
  int x = 0;  ///< where the largest difference is
  int y = 0;
  int channel = 0;
  double rmse = 0;
  double psnr = 0;  ///< dB relative to 1, of the colours: of two or four channels the last is opacity;
                    ///< infinite if they are equal
};

/// Sizes and channel counts must agree (IMAGE_MISMATCH). Two NaN or two equal infinities differ by 0; one
/// alone makes the difference infinite.
Result<ImageDifference> compare_images(const Image& a, const Image& b);

/// The sRGB transfer function of IEC 61966-2-1, for values in [0, 1].
inline float srgb_to_linear(float encoded) {
  return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}
inline float linear_to_srgb(float linear) {
  return linear <= 0.0031308F ? linear * 12.92F : 1.055F * std::pow(linear, 1.0F / 2.4F) - 0.055F;
}

}  // namespace selvedge
