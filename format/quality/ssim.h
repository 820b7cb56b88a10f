// Structural similarity of two pictures: Wang, Bovik, Sheikh and Simoncelli 2004, "Image Quality Assessment:
// From Error Visibility to Structural Similarity", IEEE Transactions on Image Processing 13(4).
#pragma once

#include <optional>

#include "format/picture/image.h"

namespace selvedge {

/// Mean SSIM index, at most 1, which only equal pictures reach. As in the paper: windows of 11 x 11 pixels
/// with Gaussian weights of standard deviation 1.5 that sum to 1, K1 = 0.01, K2 = 0.03, values from 0 to 1
/// (L = 1), the mean over all windows within the picture, then over the colour channels; alpha (the last of 2
/// or 4 channels) is ignored. Nothing if a picture is smaller than a window; NaN if a value is NaN or
/// infinite. IMAGE_MISMATCH if sizes or channel counts differ.
Result<std::optional<double>> structural_similarity(const Image& a, const Image& b);

}  // namespace selvedge
