// The unknowns of one lobe in a search, their bounds, and steps within these.
#pragma once

#include "fitter/lobes/lobe_moments.h"

namespace selvedge {

/// Bounds of a lobe's size and exponent.
struct LobeBounds {
  double max_size = 0;
  double min_exponent = 1;
  double max_exponent = 200;  ///< sharper than 64 x 64 directions can resolve
};

/// A step of one lobe, or derivatives by its unknowns, which vectors of all unknowns have in this order.
struct LobeStep {
  static constexpr std::size_t unknowns = 4;
  double size = 0;
  std::array<double, 2> direction{};  ///< the two components after the longest, cyclic; the longest is fixed
  double log_exponent = 0;

  static LobeStep from(const double* values) { return {values[0], {values[1], values[2]}, values[3]}; }
};

/// The direction's component of largest magnitude.
std::size_t longest(const LobeShape& shape);

/// Applies the step within the bounds, and normalises the direction, whose length goes into the size.
void move_lobe(const LobeStep& step, const LobeBounds& bounds, LobeShape& shape, double& size);

/// Whether an unknown of the lobe, by its index in LobeStep, is at a bound and descent would move it
/// outwards.
bool is_at_bound(std::size_t unknown, double gradient, const LobeBounds& bounds, const LobeShape& shape,
                 double size);

}  // namespace selvedge
