#include "apps/selvedge-view/trade_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace selvedge {
namespace {

/// Names, options and knobs follow from what it draws with.
TradeSetting setting_of(const LevelOptions& levels, int supersample, RenderPath path = RenderPath::hybrid,
                        PowerKind power = PowerKind::exact) {
  TradeSetting setting;
  setting.render.levels = levels;
  setting.render.supersample = supersample;
  setting.render.path = path;
  setting.render.power = power;
  setting.render.layers = 1;
  const std::string by(path_names[static_cast<std::size_t>(path)]);
  const char* filter = levels.area ? "area" : "nearest";
  const char* blend = levels.blend ? "on" : "off";
  nlohmann::ordered_json knobs = {{"path", by}};
  if (levels.forced >= 0) {
    setting.name = fmt::format("{}-level{}-x{}", by, levels.forced, supersample);
    setting.options = fmt::format("--level {}", levels.forced);
    knobs["level"] = levels.forced;
  } else {
    setting.name = fmt::format("{}-{}-blend-{}-x{}", by, filter, blend, supersample);
    setting.options = fmt::format("--filter {} --level-blend {}", filter, blend);
    knobs.update({{"filter", filter}, {"levelBlend", blend}});
    if (levels.area && levels.bias != best_levels.bias) {
      setting.name += fmt::format("-bias{}", levels.bias);
      setting.options += fmt::format(" --level-bias {}", levels.bias);
      knobs["levelBias"] = levels.bias;
    }
    if (levels.points != best_levels.points) {
      setting.name += fmt::format("-points{}", levels.points);
      setting.options += fmt::format(" --points {}", levels.points);
      knobs["points"] = levels.points;
    }
  }
  knobs["supersample"] = supersample;
  if (supersample > 1) setting.options += fmt::format(" --supersample {}", supersample);
  // OpenGL has its own powers.
  if (path != RenderPath::shader) knobs["power"] = power == PowerKind::fast ? "fast" : "exact";
  if (power == PowerKind::fast) {
    setting.name += "-fast";
    setting.options += " --power fast";
  }
  if (path != RenderPath::hybrid) setting.options += " --path " + by;
  setting.knobs = knobs.dump();
  return setting;
}

constexpr LevelOptions unblended(LevelOptions levels) {
  levels.blend = false;
  return levels;
}

constexpr LevelOptions nearest_levels;
constexpr LevelOptions finest_alone{true, 0};
/// Nearly as fine as 2 x 2 samples a pixel with 2 x 2 points each, for a third to a half of their time: the
/// yarn shows further away, and levels are finer.
constexpr LevelOptions many_points{true, -1, -1.5F, true, 3};

}  // namespace

TradeSetting usual_setting() { return setting_of(best_levels, 1); }

TradeSetting quality_setting(std::size_t quality) {
  // With fast powers, for no picture is further from the truth by them (docs/trade.md).
  // tests/bench/frame_presets.mjs tells whether another setting beats one of them.
  const std::array levels{nearest_levels, best_levels, many_points, best_levels};
  return setting_of(levels[quality], quality == 3 ? 3 : 1, RenderPath::hybrid, PowerKind::fast);
}

std::vector<TradeSetting> trade_settings() {
  std::vector<TradeSetting> settings{usual_setting()};
  const auto add = [&](const LevelOptions& levels, std::initializer_list<int> supersamples,
                       RenderPath path = RenderPath::hybrid, PowerKind power = PowerKind::exact) {
    for (const int n : supersamples) settings.push_back(setting_of(levels, n, path, power));
  };
  for (std::size_t i = 0; i < frame_quality_names.size(); ++i) settings.push_back(quality_setting(i));
  add(nearest_levels, {1, 2, 4});
  add(unblended(nearest_levels), {1});
  add(unblended(best_levels), {1, 2});
  add(best_levels, {2, 3, 4});
  add(finest_alone, {1, 2, 3, 4});
  add(finest_alone, {1}, RenderPath::hybrid, PowerKind::fast);
  add(best_levels, {4}, RenderPath::hybrid, PowerKind::fast);
  for (const LevelOptions& levels : {nearest_levels, unblended(nearest_levels)})
    add(levels, {1}, RenderPath::paper);
  for (const LevelOptions& levels : {best_levels, nearest_levels}) add(levels, {1}, RenderPath::shader);
  return settings;
}

}  // namespace selvedge
