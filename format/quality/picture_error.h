// How far a picture is from the truth, as people see it.
#pragma once

#include <vector>

#include "format/picture/frame.h"

namespace selvedge {

struct PictureError {
  double mean_square = 0;  ///< of sRGB-encoded values from 0 to 1, three colours
  double ssim = 0;         ///< similarity.h; 1 for pictures smaller than its window
};

/// Both by default_display(), clipped, sRGB-encoded, not rounded to bytes. IMAGE_MISMATCH for other sizes.
Result<PictureError> picture_error(const Frame& frame, const Frame& truth);

/// dB relative to 1; 200 at most, so that equal pictures have a figure.
double psnr_of(double mean_square);

/// The error of several pictures as if they were one.
PictureError mean_of(const std::vector<PictureError>& errors);

/// Small pictures of frames side by side, each box filtered to half its size (an odd row or column is left
/// out), by default_display(): linear, three channels. Frames of one size.
Image thumbnail_of(const std::vector<Frame>& frames);

}  // namespace selvedge
