// The repeat of the cloth in rectified pictures: its size, and the texels of one cell.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "format/base/vec.h"
#include "format/picture/image.h"

namespace selvedge {

/// Brightness of a picture: one channel.
Image luminance_of(const Image& picture);

/// The period of pictures of one size and one channel along x (`axis` 0) or y (1), in pixels to a fraction:
/// the first peak of their mean autocorrelation that is as high as its highest, to 5 %. At least 4 pixels,
/// and at most 2/3 of the picture. Nothing where no peak reaches 0.3.
std::optional<double> find_period(std::span<const Image> pictures, int axis);

/// Averages all repeats of a picture into the texels of one cell, whose lower left corner is the picture's.
/// Every pixel counts by the area that it shares with a texel. Repeats fade in and out towards the picture's
/// borders, over up to half a period, so that the cell's borders close without a seam wherever the picture
/// has more than one repeat.
class RepeatAverage {
 public:
  /// `period`: in pixels, at most the picture's size. `opacity`: as large as the pictures, in its red
  /// channel; empty: 1 everywhere.
  RepeatAverage(const V2i& picture, const V2d& period, const V2i& texels, const Image& opacity = {});

  struct Cell {
    std::vector<V3f> values;  ///< [texel] as in fabric.h; means weighted by opacity; 0 in a hole
    double variance = 0;      ///< mean over texels and channels of that between repeats
    double mean_square = 0;   ///< mean square of the values
  };
  /// Precondition: the picture has the size of the constructor and four channels.
  Cell average(const Image& picture) const;
  /// [texel], the mean opacity.
  std::vector<float> alpha() const;
  /// Repeats along x and y, whole ones and parts.
  V2d repeats() const { return {picture_.x / period_.x, picture_.y / period_.y}; }

 private:
  template <class Add>
  void for_each_box(int texel, const Add& add) const;

  V2i picture_;
  V2d period_;
  V2i texels_;
  std::vector<float> opacity_;  ///< [pixel]
};

}  // namespace selvedge
