// Queries of the conformance kit's protocol (spec/conformance/README.md).
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "format/base/vec.h"

namespace selvedge::test {

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

struct Query {
  double level = 0;
  std::optional<V2i> texel;
  std::optional<V2d> uv;  ///< exactly one of texel and uv is set
  V3f light{0, 0, 1};     ///< unit, in the fabric's frame
  V3f view{0, 0, 1};
  bool behind = false;  ///< the cloth is seen from behind: directions are in the frame of the back
  std::optional<ClosedEnvironment> environment;  ///< in place of the light
  std::optional<V3d> background;  ///< radiance behind holes; without it that is the environment's
};

/// Reads an `evaluate` or `environment` line, view and axis turned into the fabric's frame. Throws
/// std::exception.
Query query_from(const nlohmann::json& line);

}  // namespace selvedge::test
