#include "apps/selvedge/fabric_query.h"

#include <fmt/format.h>

namespace selvedge {

Result<QueriedFabric> QueriedFabric::open(const std::string& path) {
  return read_fabric(path).map([&](Fabric&& fabric) { return QueriedFabric(path, std::move(fabric)); });
}

Result<Shading> QueriedFabric::shade(const FabricQuery& query) {
  const bool turns = query.behind && front_.side_of(Side::back) != nullptr;
  if (turns && !behind_) behind_ = turned_over(front_);
  const Fabric& fabric = turns ? *behind_ : front_;
  if (query.uv) return evaluate(fabric, query.level, *query.uv, query.light, query.view);
  const auto refuse = [&](const char* place, std::string message) {
    return fail(Code::option_out_of_range, path_, place, std::move(message));
  };
  if (!(query.level >= 0 && query.level <= levels() - 1)) {
    return refuse("level", fmt::format("{} is outside of 0 to {}", query.level, levels() - 1));
  }
  const int level = static_cast<int>(query.level);
  if (level != query.level) return refuse("level", "a texel is of one whole level");
  const FabricLevel& texels = fabric.levels[level];
  const auto [x, y] = std::pair(query.texel->x, query.texel->y);
  if (x < 0 || y < 0 || x >= texels.width || y >= texels.height) {
    return refuse("texel", fmt::format("level {} has {}x{} texels", level, texels.width, texels.height));
  }
  return evaluate(fabric, level, x, y, query.light, query.view);
}

}  // namespace selvedge
