// The tiles of a comparison's picture: what was traced and what fit and model show, for some pairs.
#pragma once

#include <optional>
#include <vector>

#include "apps/report/svg.h"
#include "format/quality/compare.h"

namespace selvedge {

constexpr double plot_margin = 40;  ///< at the left, pixels

/// A set of pairs with its comparison.
struct ComparedPairs {
  const PairSamples& pairs;
  const Comparison& comparison;
};

/// A model's answers for the held-out pairs with their comparison; both are empty without a model.
struct ComparedAnswers {
  const PairAnswers& answers;
  const std::optional<Comparison>& comparison;
};

/// Degrees from the normal.
double angle_of(const V3f& direction);

/// Indices of at most `count` pairs, from those whose directions are both steep to the most grazing, evenly
/// over the order of their flatter direction.
std::vector<std::size_t> spread_pairs(const std::vector<DirectionPair>& pairs, std::size_t count);

/// Linear RGB for a number of [-1, 1], beyond them that of the ends: blue below 0, nearly white at 0, red
/// above. Equal steps are equal steps of lightness on both sides, for colour-blind eyes as well.
V3f diverging_colour(double t);

/// Truth, fit and difference one below the other for some pairs, and the same of the model; gives back where
/// the next thing may begin.
Result<double> draw_tiles(Svg& svg, const Fabric& fabric, const ComparedPairs& held_out,
                          const ComparedAnswers& model, double top);

}  // namespace selvedge
