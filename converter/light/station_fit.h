// Fits the light of places about yarn with the functions that a fabric file holds of it
// (format/fabric/yarns.h).
#pragma once

#include <vector>

#include <Eigen/Core>

#include "format/fabric/yarns.h"

namespace selvedge {

inline constexpr int light_columns = 3 * yarn_light_function_count;

/// Light of a place, 1/sr: [function][colour] of the light from above and of that from below, then the
/// moments.
using LightColumns = Eigen::Matrix<double, 1, 2 * light_columns + light_moment_count>;

struct LitPoint {
  double station = 0;  ///< in [0, stations)
  Eigen::Matrix<double, 1, angle_function_count> angle_values;
  double normal_z = 0;  ///< z of the unit normal
  double weight = 0;
  bool is_visible = true;  ///< false: other yarn covers it, and `light` is unknown
  LightColumns light;
};

/// Writes the coefficients of a curve, whose first station is `first`, to data.light, and to data.through if
/// that has values. Stations are interpolated between, so that all are solved for together. `exact`: every
/// colour has 8 bits, as light that comes through needs. Covered places get their light.
void fit_stations(std::vector<LitPoint>& places, int curve, int first, bool exact, YarnData& data);

}  // namespace selvedge
