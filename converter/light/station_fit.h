// Fits the light of places about yarn with the functions that a fabric file holds of it
// (format/fabric/yarns.h).
#pragma once

#include <vector>

#include <Eigen/Core>

#include "format/fabric/yarns.h"

namespace selvedge {

inline constexpr int columns_of_light = 3 * light_functions_of_yarn;

/// Light of a place, 1/sr: [function][colour] of the light from above and of that from below, then the
/// moments.
using PlaceLight = Eigen::Matrix<double, 1, 2 * columns_of_light + light_moments>;

struct LitPlace {
  double station = 0;  ///< in [0, stations)
  Eigen::Matrix<double, 1, angle_functions> functions;
  double up = 0;  ///< z of the unit normal
  double weight = 0;
  bool open = true;  ///< false: other yarn covers it, and `light` is unknown
  PlaceLight light;
};

/// Writes the coefficients of a curve, whose first station is `first`, to data.light, and to data.through if
/// that has values. Stations are interpolated between, so that all are solved for together. `exact`: every
/// colour has 8 bits, as light that comes through needs. Covered places get their light.
void fit_stations(std::vector<LitPlace>& places, int curve, int first, bool exact, YarnData& data);

}  // namespace selvedge
