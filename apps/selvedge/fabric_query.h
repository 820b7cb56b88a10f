// Evaluates the reflectance at points of a fabric file.
#pragma once

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

}  // namespace selvedge
