// Answers the conformance kit's queries about light from all around as the viewer draws it: by the lamps that
// it takes out of an environment, and by smooth light. One JSON object per line in, one per line out.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>

#include "format/base/json_text.h"
#include "format/cells/cell_image.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/fabric/yarn_sky.h"
#include "format/picture/environment.h"
#include "tests/format/cells/shade_points.h"
#include "tests/spec/query.h"

namespace {

using namespace selvedge;
using test::ClosedEnvironment;
using test::Query;

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

Shading shade_texel(const Fabric& fabric, int number, const Query& query, const EnvironmentLight& light) {
  const FabricLevel& level = fabric.levels[number];
  const V2i texel = query.texel.value_or(
      query.uv ? V2i(wrap_texel(query.uv->x, level.width), wrap_texel(query.uv->y, level.height))
               : V2i(0, 0));
  CellView view;
  view.view = query.view;
  for (const Light& lamp : light.lamps) view.lamps.push_back({V3f(lamp.direction), lamp.irradiance, 0});
  view.environment = light.smooth_light;
  view.levels = {0, number, 0};
  view.size = texel_cell_size(fabric, {0, 0}, number);
  std::vector<Group> samples(level.texels(), Group{});
  CellTexels(fabric).add_to_samples(view, samples);
  const auto& [red, green, blue, alpha] = samples[(level.height - 1 - texel.y) * level.width + texel.x];
  return {alpha > 0 ? V3f(red, green, blue) / alpha : V3f(0, 0, 0), alpha};
}

/// The lamps by the reference, with shadows of the yarn; light from all around as cell images have it.
Shading shade_yarn(const Fabric& fabric, const Query& query, const EnvironmentLight& light) {
  const Yarns& yarns = *fabric.levels.front().yarns();
  const float plane = fabric.reference_height;
  const auto hit = yarns.trace(*query.uv, plane, query.view);
  if (!hit) return {V3f(0, 0, 0), 0};
  V3f sum(0, 0, 0);
  for (const Light& lamp : light.lamps)
    sum += yarns.shade(*query.uv, plane, V3f(lamp.direction), query.view).radiance * lamp.irradiance;
  const std::vector<float> sky = sky_transfer(yarns);
  const CellYarn cell(yarns, plane, sky);
  CellView view;
  view.view = query.view;
  view.environment = light.smooth_light;
  const std::span<const Yarns::Segment> segments = yarns.geometry().segments;
  std::int32_t piece = 0;  // plies come before hairs
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(segments.size()); ++i) {
    const bool hair = segments[hit->segment].hair_threshold > 0;
    if ((segments[i].hair_threshold > 0) == hair ? i < hit->segment : hair) ++piece;
  }
  sum += test::shade_points(cell, cell.pieces(0), view, std::array{test::CellPoint{piece, hit->start_offset}})
             .front();
  return {sum * yarns.variation_factor(*query.uv, segments[hit->segment].curve), 1};
}

nlohmann::json answer(const nlohmann::json& line) {
  const Query query = test::query_from(line);
  const Fabric fabric = read_fabric(line["file"].get<std::string>()).value();
  const bool turns = query.behind && fabric.find_side(Side::back) != nullptr;
  const Fabric seen = turns ? turned_over(fabric) : fabric;
  const EnvironmentLight light = split_light(picture_of(*query.environment));
  const auto at = [&](int level) {
    if (level < 0) return shade_yarn(seen, query, light);
    Shading shading = shade_texel(seen, level, query, light);
    const auto& yarns = seen.levels.front().yarns();
    if (query.uv && yarns) shading.radiance *= yarns->variation_factor(*query.uv, -1);
    return shading;
  };
  const LevelBlend between = level_blend(query.level, static_cast<int>(fabric.levels.size()), -1);
  const Shading near = at(between.finer_level);
  const Shading shading =
      between.weight > 0 ? blend(near, at(between.finer_level + 1), between.weight) : near;
  const V3d behind = query.background.value_or(query.environment->at(-V3d(query.view)));
  const V3d shown = V3d(shading.radiance) * shading.alpha + behind * (1 - shading.alpha);
  return {{"rgb", {shown.x, shown.y, shown.z}}, {"alpha", shading.alpha}};
}

}  // namespace

int main() {
  for (std::string line; std::getline(std::cin, line);)
    std::cout << answer(parse_json(line)).dump() << std::endl;
}
