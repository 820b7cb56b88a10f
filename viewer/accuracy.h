// Pictures as accurate as asked for, or as the time allows.
//
// A picture's accuracy is its PSNR against the same picture with 64 rays a pixel or more, as displayed, peak
// 1. For an accuracy it is estimated from blocks of the picture, which are drawn also with twice as many rays
// along a pixel's side: halves of a picture's own rays share its cell images and their places, and do not
// show what these lack. The blocks of a picture for a time are drawn in what is left of it.
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "format/picture/display.h"
#include "viewer/renderer.h"

namespace selvedge {

/// CellImageOptions::samples_per_pixel_side of a picture at rest: look-ups have two samples of images along
/// either side, and pixels at least four.
inline float image_samples(int supersample) { return 2 * static_cast<float>(std::max(supersample, 2)); }

/// PSNR of two frames of one size, dB, as of pictures, above; at most 200. Without a background: over white.
double frame_psnr_db(const Frame& a, const Frame& b, const DisplayOptions& display = default_display());

/// dB of pictures that nobody asks more of: mostly 2 x 2 rays a pixel have them.
inline constexpr double default_accuracy_db = 34;

/// One wish for a picture, or none: the supersampling of the options.
struct PictureGoal {
  std::optional<double> accuracy_db;           ///< dB, above 0
  std::optional<double> seconds;               ///< from the call on; a first picture is drawn in any case
  DisplayOptions display = default_display();  ///< of the picture, which accuracies are of
};

struct AccuratePicture {
  int supersample = 1;
  int magnification = 1;   ///< of a picture for a time: pixels along the side of a pixel that was drawn
  double accuracy_db = 0;  ///< dB, estimated; 0: not known, as there is nothing to compare with
};

/// Adds the statistics of one more drawing of a scene.
void accumulate(const RenderStats& one, RenderStats& sum);

/// Draws a frame for a goal, and leaves the renderer at its supersampling; further frames need
/// image_samples() it. The times of `stats` are of all that was drawn. Errors as Renderer::draw().
Result<AccuratePicture> draw_for_goal(Renderer& renderer, const PictureGoal& goal, const FrameSize& size,
                                      const Camera& camera, DrawOptions options, Frame& frame,
                                      RenderStats& stats);

/// The same of pictures that differ by tints: for each what the function above gives it by itself, as far as
/// no time is asked for. Precondition: there is a tint, and only one if goal.seconds is set.
Result<std::vector<AccuratePicture>> draw_for_goal(Renderer& renderer, const PictureGoal& goal,
                                                   const FrameSize& size, const Camera& camera,
                                                   DrawOptions options, std::span<const Tints> tints,
                                                   std::vector<Frame>& frames, RenderStats& stats);

}  // namespace selvedge
