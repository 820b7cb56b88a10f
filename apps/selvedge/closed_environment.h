// Radiance of a fabric in environments given by a formula (spec/brdf.md, "Environments"; the
// formulas of spec/conformance).
#pragma once

#include <optional>

#include "apps/selvedge/fabric_query.h"

namespace selvedge {

/// Radiance a + b p(c) from a direction whose cosine to the axis is c.
struct ClosedEnvironment {
  enum class Kind {
    constant,  ///< p = 0
    cosine,    ///< p = c
    lobe,      ///< p = max(0, c)^exponent
    disc,      ///< p = 1 where the angle to the axis is less than `degrees`, 0 elsewhere
  };
  Kind kind = Kind::constant;
  V3d a{0, 0, 0};  ///< linear RGB
  V3d b{0, 0, 0};
  V3d axis{0, 0, 1};     ///< unit, in the fabric's frame
  double exponent = 1;   ///< >= 0
  double degrees = 180;  ///< in (0, 180]

  double pattern(double cosine) const;
  /// `direction` is unit, in the fabric's frame.
  V3d at(const V3d& direction) const { return a + b * pattern(axis.dot(direction)); }
};

struct EnvironmentQuery {
  FabricQuery place;  ///< its light does not count
  ClosedEnvironment environment;
  std::optional<V3d> background;  ///< radiance of what lies behind holes; without it that is the environment
};

/// The radiance towards the view, holes and what lies behind them included, and the opacity. The integral is
/// a sum over half a million directions. Throws Failure, with errors as of QueriedFabric::shade.
Shading shown(QueriedFabric& fabric, const EnvironmentQuery& query);

}  // namespace selvedge
