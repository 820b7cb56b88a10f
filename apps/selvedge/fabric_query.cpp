#include "apps/selvedge/fabric_query.h"

#include <fmt/format.h>

namespace selvedge {

QueriedFabric::QueriedFabric(FabricReader reader) : reader_(std::move(reader)) { kept_.resize(levels()); }

Result<QueriedFabric> QueriedFabric::open(const std::string& path) {
  auto reader = FabricReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  return QueriedFabric(std::move(*reader));
}

Result<Shading> QueriedFabric::shade(const FabricQuery& query) {
  const bool other_side = query.behind || query.light.z < 0;
  if (query.uv && other_side) {
    const auto fabric = sided(query.behind);
    if (!fabric) return tl::unexpected(fabric.error());
    return evaluate(**fabric, query.level, *query.uv, query.light, query.view);
  }
  if (query.uv) {
    const LevelBlend between = level_blend(query.level, levels(), first_level());
    auto near = shade_at(between.lower, query);
    if (!near || !(between.weight > 0)) return near;
    auto far = shade_at(between.lower + 1, query);
    if (!far) return far;
    return blend(*near, *far, between.weight);
  }
  const auto refuse = [&](const char* place, std::string message) {
    return fail(Code::option_out_of_range, reader_.name(), place, std::move(message));
  };
  if (!(query.level >= 0 && query.level <= levels() - 1)) {
    return refuse("level", fmt::format("{} is outside of 0 to {}", query.level, levels() - 1));
  }
  const int level = static_cast<int>(query.level);
  if (level != query.level) return refuse("level", "a texel is of one whole level");
  const int width = level_size(reader_.header().width, level);
  const int height = level_size(reader_.header().height, level);
  if (query.texel->x < 0 || query.texel->y < 0 || query.texel->x >= width || query.texel->y >= height) {
    return refuse("texel", fmt::format("level {} has {}x{} texels", level, width, height));
  }
  if (!other_side) return shade_texel(level, query.texel->x, query.texel->y, query);
  const auto fabric = sided(query.behind);
  if (!fabric) return tl::unexpected(fabric.error());
  return evaluate(**fabric, level, query.texel->x, query.texel->y, query.light, query.view);
}

Result<const Fabric*> QueriedFabric::sided(bool behind) {
  if (!sided_[0]) {
    auto read = reader_.read();
    if (!read) return tl::unexpected(read.error());
    sided_[0] = std::move(*read);
  }
  const bool turns = behind && sided_[0]->side_of(Side::back) != nullptr;
  if (turns && !sided_[1]) sided_[1] = turned_over(*sided_[0]);
  return &*sided_[turns ? 1 : 0];
}

Result<Shading> QueriedFabric::shade_at(int level, const FabricQuery& query) {
  if (level < 0) {
    const auto read = level_of(0);
    if (!read) return tl::unexpected(read.error());
    return (*read)->yarns()->shade(*query.uv, reader_.header().reference_height, query.light, query.view);
  }
  return shade_texel(level, wrap_texel(query.uv->x, level_size(reader_.header().width, level)),
                     wrap_texel(query.uv->y, level_size(reader_.header().height, level)), query);
}

Result<const FabricLevel*> QueriedFabric::level_of(int level) {
  std::optional<FabricLevel>& kept = kept_[level];
  if (!kept) {
    auto read = reader_.read_level(level);
    if (!read) return tl::unexpected(read.error());
    kept = std::move(*read);
  }
  return &*kept;
}

Result<Shading> QueriedFabric::shade_texel(int level, int x, int y, const FabricQuery& query) {
  const auto read = level_of(level);
  if (!read) return tl::unexpected(read.error());
  return evaluate(**read, reader_.header(), x, y, query.light, query.view);
}

}  // namespace selvedge
