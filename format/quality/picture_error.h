// Errors of a rendered picture against the true one, in display values.
#pragma once

#include <vector>

#include "format/picture/frame.h"

namespace selvedge {

struct PictureError {
  double mean_square = 0;  ///< mean squared error of sRGB-encoded values from 0 to 1, three channels
  double ssim = 0;         ///< structural_similarity(); 1 for pictures smaller than its window
};

/// Compares the frames after default_display(), clipped and sRGB-encoded, but not rounded to bytes.
/// IMAGE_MISMATCH if their sizes differ.
Result<PictureError> picture_error(const Frame& frame, const Frame& truth);

/// dB relative to 1; at most 200, so that the PSNR of equal pictures is finite.
double psnr_of(double mean_square);

/// The mean of the errors.
PictureError mean_of(const std::vector<PictureError>& errors);

/// The frames side by side after default_display(), each box filtered to half its size (an odd row or column
/// is dropped): linear, three channels. Precondition: the frames have one size.
Image thumbnail_of(const std::vector<Frame>& frames);

}  // namespace selvedge
