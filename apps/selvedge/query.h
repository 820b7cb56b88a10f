// Answers to the queries of spec/conformance about a fabric file: its reflectance at points, and its radiance
// in environments given by a formula (spec/brdf.md, "Environments").
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"

namespace selvedge {

/// A texel of a whole level, or texture coordinates (which repeat) at a level that may lie between two.
struct FabricQuery {
  double level = 0;
  std::optional<V2i> texel;
  std::optional<V2d> uv;  ///< exactly one of texel and uv is set
  V3f light{0, 0, 1};     ///< unit vectors in the fabric's frame
  V3f view{0, 0, 1};
  bool behind = false;  ///< the cloth is seen from behind: both are in the frame of the back
};

/// A fabric file that answers queries.
class QueriedFabric {
 public:
  static Result<QueriedFabric> open(const std::string& path);

  int levels() const { return static_cast<int>(front_.levels.size()); }
  /// -1 with yarn, else 0.
  int first_level() const { return front_.levels.front().yarns() ? -1 : 0; }
  /// Whether light from the other side may come through.
  bool lets_through() const { return front_.sides != decltype(front_.sides)(); }
  /// OPTION_OUT_OF_RANGE if a texel or its level does not exist (place: "level" or "texel"). With texture
  /// coordinates the level is clamped to those that exist.
  Result<Shading> shade(const FabricQuery& query);

 private:
  QueriedFabric(std::string path, Fabric fabric) : path_(std::move(path)), front_(std::move(fabric)) {}

  std::string path_;
  Fabric front_;
  std::optional<Fabric> behind_;  ///< turned over, on first use
};

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

/// Throws the Failure JSON_MALFORMED: a member that is missing, of another form or out of range, which is the
/// place; or none ("").
[[noreturn]] void malformed(const char* place, const char* message);

/// `evaluate`. Other members are ignored. Throws Failure.
FabricQuery query_from(const nlohmann::json& line);

/// `environment`, with view and axis turned into the fabric's frame. Throws Failure.
EnvironmentQuery environment_query_from(const nlohmann::json& line);

}  // namespace selvedge
