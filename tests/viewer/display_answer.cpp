// Answers the conformance kit's queries about light from all around as the viewer draws it: by the lamps that
// it takes out of an environment, and by smooth light. One JSON object per line in, one per line out.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>

#include "apps/selvedge/query_json.h"
#include "format/base/json_text.h"
#include "format/cells/cell_image.h"
#include "format/fabric/evaluate.h"
#include "format/picture/environment.h"
#include "viewer/hybrid/evaluate_lanes.h"

namespace {

using namespace selvedge;

/// As many pixels as the viewer looks at. Those that an edge may cross have the mean of so many points.
constexpr int picture_width = 512;
constexpr int points_across = 32;

/// A picture of the environment, its directions in the fabric's frame.
Environment picture_of(const ClosedEnvironment& e) {
  Environment picture{picture_width, picture_width / 2, {}, {}};
  const Environment fine{picture.width * points_across, picture.height * points_across, {}, {}};
  const double edge = e.degrees * std::numbers::pi / 180;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const V3d middle = picture.direction(x, y);
      const double angle = std::acos(std::clamp(middle.dot(e.axis), -1.0, 1.0));
      V3d sum = e.at(middle);
      if (e.kind == ClosedEnvironment::Kind::disc &&
          std::abs(angle - edge) < 4 * std::numbers::pi / picture.width) {
        sum = V3d(0, 0, 0);
        for (int i = 0; i < points_across * points_across; ++i)
          sum += e.at(
              fine.direction(x * points_across + i % points_across, y * points_across + i / points_across));
        sum /= points_across * points_across;
      }
      picture.radiance.emplace_back(sum);
    }
  }
  return picture;
}

void set(LaneDirections& directions, const V3f& d) {
  directions.x[0] = d.x;
  directions.y[0] = d.y;
  directions.z[0] = d.z;
}

Shading shade_texel(const PackedFabric& packed, int number, const FabricQuery& query,
                    const EnvironmentLight& light) {
  const PackedLevel& level = packed.levels[number];
  const V2i texel = query.texel.value_or(
      query.uv ? V2i(wrap_texel(query.uv->x, level.width), wrap_texel(query.uv->y, level.height))
               : V2i(0, 0));
  LaneTexels texels;
  texels.weight[0] = 1;
  texels.texel[0] = texel.y * level.width + texel.x;
  texels.level[0] = number;
  LaneDirections view;
  set(view, query.view);
  std::vector<LaneLight> lamps(light.lamps.size());
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    set(lamps[i].direction, V3f(light.lamps[i].direction));
    lamps[i].share[0] = 1;
    lamps[i].irradiance = light.lamps[i].irradiance;
  }
  LaneSmoothLight around;
  for (std::size_t k = 0; k < smooth_functions; ++k) {
    for (int c = 0; c < 3; ++c) around.factors[k][static_cast<std::size_t>(c)][0] = light.rest.factors[k][c];
  }
  LaneScratch scratch;
  LaneShading sum;
  evaluate_lanes(packed, {&texels, 1}, view, lamps, scratch, sum, &around);
  const float alpha = sum.alpha[0];
  const V3f radiance(sum.red[0], sum.green[0], sum.blue[0]);
  return {alpha > 0 ? radiance / alpha : V3f(0, 0, 0), alpha};
}

/// The lamps by the reference, with shadows of the yarn; light from all around as cell images have it.
Shading shade_yarn(const PackedFabric& packed, const FabricQuery& query, const EnvironmentLight& light) {
  const Yarns& yarns = *packed.fabric->levels.front().yarns();
  const float plane = packed.fabric->reference_height;
  const auto hit = yarns.trace(*query.uv, plane, query.view);
  if (!hit) return {V3f(0, 0, 0), 0};
  V3f sum(0, 0, 0);
  for (const Light& lamp : light.lamps)
    sum += yarns.shade(*query.uv, plane, V3f(lamp.direction), query.view).radiance * lamp.irradiance;
  const CellYarn cell(yarns, plane, packed.yarn_sky);
  CellView view;
  view.view = query.view;
  view.around = light.rest;
  const std::span<const Yarns::Segment> segments = yarns.inside().segments;
  std::int32_t piece = 0;  // plies come before hairs
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(segments.size()); ++i) {
    const bool hair = segments[hit->segment].rank > 0;
    if ((segments[i].rank > 0) == hair ? i < hit->segment : hair) ++piece;
  }
  return {
      sum + shade_points(cell, cell.pieces(0), view, std::array{CellPoint{piece, hit->from_start}}).front(),
      1};
}

nlohmann::json answer(const nlohmann::json& line) {
  const EnvironmentQuery query = environment_query_from(line).value();
  const Fabric fabric = read_fabric(line["file"].get<std::string>()).value();
  const bool turns = query.place.behind && fabric.side_of(Side::back) != nullptr;
  const Fabric seen = turns ? turned_over(fabric) : fabric;
  const PackedFabric packed = pack(seen);
  const EnvironmentLight light = divide(picture_of(query.environment));
  const auto at = [&](int level) {
    return level < 0 ? shade_yarn(packed, query.place, light)
                     : shade_texel(packed, level, query.place, light);
  };
  const LevelBlend between = level_blend(query.place.level, static_cast<int>(fabric.levels.size()), -1);
  const Shading near = at(between.lower);
  const Shading shading = between.weight > 0 ? blend(near, at(between.lower + 1), between.weight) : near;
  const V3d behind = query.background.value_or(query.environment.at(-V3d(query.place.view)));
  const V3d shown = V3d(shading.radiance) * shading.alpha + behind * (1 - shading.alpha);
  return {{"rgb", {shown.x, shown.y, shown.z}}, {"alpha", shading.alpha}};
}

}  // namespace

int main() {
  for (std::string line; std::getline(std::cin, line);)
    std::cout << answer(parse_json(line)).dump() << std::endl;
}
