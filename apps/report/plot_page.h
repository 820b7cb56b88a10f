// A page to draw on, the colours of plots, and the parts of a comparison's picture.
#pragma once

#include <string>
#include <vector>

#include "apps/report/drawing.h"
#include "format/quality/compare.h"
#include "format/samples/samples.h"

namespace selvedge {

// Vermilion and blue of Okabe and Ito's palette, which colour-blind eyes tell apart.
inline constexpr Rgb held_out_colour{213, 94, 0};
inline constexpr Rgb training_colour{0, 114, 178};
inline constexpr Rgb ink{27, 31, 36};
inline constexpr Rgb muted{98, 107, 118};
inline constexpr Rgb hairline{208, 213, 220};
inline constexpr Rgb panel{246, 247, 249};

inline constexpr double margin = 40;

/// Degrees from the normal.
double angle_of(const V3f& direction);

/// Degrees around it from u, in [0, 360).
double azimuth_of(const V3f& direction);

/// The next of 1, 2, 5, 10, 20 ... that is not less; 1 where the value is not positive.
double round_up(double value);

/// The shapes of a drawing, in their order.
class Page {
 public:
  void box(const V2d& corner, const V2d& size, Rgb fill) {
    shapes_.emplace_back(DrawnBox{corner, size, fill});
  }
  void line(std::vector<V2d> points, double width, Rgb colour) {
    shapes_.emplace_back(DrawnLine{std::move(points), width, colour});
  }
  void disc(const V2d& centre, double radius, Rgb fill) {
    shapes_.emplace_back(DrawnDisc{centre, radius, fill});
  }
  using Anchor = DrawnText::Anchor;
  void text(const V2d& at, const std::string& words, double size, Rgb colour, Anchor anchor = Anchor::start,
            bool bold = false) {
    shapes_.emplace_back(DrawnText{at, words, size, colour, anchor, bold});
  }
  /// Enlarged or reduced to that size, every pixel a block of one colour, with a hairline around it.
  void picture(const V2d& corner, const V2d& size, const Image& image, std::string title);
  std::vector<Drawn> take() { return std::move(shapes_); }

 private:
  std::vector<Drawn> shapes_;
};

/// Truth, fit and difference side by side for some pairs; gives back where the next thing may begin.
double draw_tiles(Page& page, const Fabric& fabric, const PairSamples& held_out, const Comparison& comparison,
                  double top);

/// A set of pairs with its comparison.
struct ComparedPairs {
  const PairSamples& pairs;
  const Comparison& comparison;
};

/// The error over an angle: of views or of lights.
void draw_angles(Page& page, const V2d& corner, const V2d& size, const char* title,
                 const ComparedPairs& held_out, const ComparedPairs& training, V3f DirectionPair::*direction);

/// The error of every level.
void draw_levels(Page& page, const V2d& corner, const V2d& size, const Comparison& held_out,
                 const Comparison& training);

}  // namespace selvedge
