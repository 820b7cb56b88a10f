// Evaluates the reflectance at points of a fabric file, reading only what the answer needs.
#pragma once

#include <optional>
#include <string>
#include <vector>

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

/// A fabric file that answers queries. Levels are read on first use, and kept.
class QueriedFabric {
 public:
  static Result<QueriedFabric> open(const std::string& path);

  int levels() const { return reader_.header().levels; }
  /// -1 with yarn, else 0.
  int first_level() const { return reader_.header().has(LayerKind::yarns, 0) ? -1 : 0; }
  /// Whether light from the other side may come through.
  bool lets_through() const { return !reader_.header().sides.empty(); }
  /// OPTION_OUT_OF_RANGE if a texel or its level does not exist (place: "level" or "texel"). With texture
  /// coordinates the level is clamped to those that exist.
  Result<Shading> shade(const FabricQuery& query);

 private:
  explicit QueriedFabric(FabricReader reader);
  /// The level, read on first use.
  Result<const FabricLevel*> level_of(int level);
  Result<Shading> shade_texel(int level, int x, int y, const FabricQuery& query);
  Result<Shading> shade_at(int level, const FabricQuery& query);
  /// All levels of the side that is seen and of light that comes through to it; read on first use.
  Result<const Fabric*> sided(bool behind);

  FabricReader reader_;
  std::vector<std::optional<FabricLevel>> kept_;
  std::array<std::optional<Fabric>, 2> sided_;  ///< from the front, from behind
};

}  // namespace selvedge
