// The unknowns of one lobe in a search, the bounds within which they stay, and a step along them.
#pragma once

#include "fitter/lobes/lobe_moments.h"

namespace selvedge {

/// Bounds of a lobe's size and exponent.
struct LobeBounds {
  double max_size = 0;
  double min_exponent = 1;
  double max_exponent = 200;  ///< sharper than a lobe that 64 x 64 directions can show
};

/// A step of one lobe, or a derivative by its unknowns; in vectors of all unknowns in this order.
struct LobeStep {
  static constexpr std::size_t unknowns = 4;
  double size = 0;
  std::array<double, 2> direction{};  ///< the components after the longest, cyclic; the longest is kept
  double log_exponent = 0;

  static LobeStep from(const double* values) { return {values[0], {values[1], values[2]}, values[3]}; }
};

/// The direction's component of largest magnitude.
std::size_t longest(const LobeShape& shape);

/// Takes the step within the bounds. The length that the direction gets goes into the size.
void move_lobe(const LobeStep& step, const LobeBounds& bounds, LobeShape& shape, double& size);

/// Whether an unknown of the lobe, by its number in LobeStep, is at a bound and the descent pushes it
/// outwards.
bool is_at_bound(std::size_t unknown, double gradient, const LobeBounds& bounds, const LobeShape& shape,
                 double size);

}  // namespace selvedge
