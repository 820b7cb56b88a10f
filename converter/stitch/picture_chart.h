// Makes knitting charts of pictures: a pixel is a knit stitch, a colour a yarn, as for knitting machines.
#pragma once

#include <string>

namespace selvedge {

/// Largest picture, pixels each way, and its colours.
constexpr int max_picture_side = 256;
constexpr int max_picture_colours = 6;
/// Stitches that a yarn of a picture may pass before it is caught.
constexpr int usual_float_stitches = 7;

/// Whether bytes begin as a PNG.
bool is_png(const std::string& bytes);

/// The chart (chart.h) of a PNG: its bottom row is row 1, its most frequent colour the first yarn. Ends
/// reading (STITCH_INVALID) at pictures that are larger, have more colours, or pixels that are not opaque.
std::string chart_of_picture(const std::string& bytes, const std::string& file);

}  // namespace selvedge
