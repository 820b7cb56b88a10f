#include "apps/selvedge-view/trade_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>

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
  const char* filter = levels.linear ? "linear" : "nearest";
  const char* blend = levels.blend ? "on" : "off";
  nlohmann::ordered_json knobs = {{"path", by}};
  if (levels.forced >= 0) {
    setting.name = fmt::format("{}-level{}-x{}", by, levels.forced, supersample);
    setting.options = fmt::format("--level {}", levels.forced);
    knobs["level"] = levels.forced;
  } else {
    setting.name = fmt::format("{}-{}-taps{}-blend-{}-x{}", by, filter, levels.taps, blend, supersample);
    setting.options = fmt::format("--filter {} --anisotropy {} --level-blend {}", filter, levels.taps, blend);
    knobs.update({{"filter", filter}, {"taps", levels.taps}, {"levelBlend", blend}});
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

constexpr LevelOptions with_taps(LevelOptions levels, int taps) {
  levels.taps = taps;
  return levels;
}
constexpr LevelOptions unblended(LevelOptions levels) {
  levels.blend = false;
  return levels;
}

constexpr LevelOptions nearest_levels;
constexpr LevelOptions finest_alone{true, 0, 1, 0, false};

/// What a name stands for.
struct FrameQuality {
  LevelOptions levels;
  int supersample;
  PowerKind power;
};
/// In the order of frame_quality_names. With fast powers, for no picture is further from the truth by them
/// (docs/trade.md). tests/bench/frame_presets.mjs tells whether another setting beats one of them.
constexpr std::array<FrameQuality, frame_quality_names.size()> qualities{{
    {nearest_levels, 1, PowerKind::fast},
    {best_levels, 1, PowerKind::fast},
    {best_levels, 2, PowerKind::fast},
    {best_levels, 3, PowerKind::fast},
}};

}  // namespace

TradeSetting usual_setting() { return setting_of(best_levels, 1); }

TradeSetting quality_setting(std::size_t quality) {
  const auto& [levels, supersample, power] = qualities[quality];
  return setting_of(levels, supersample, RenderPath::hybrid, power);
}

std::vector<TradeSetting> trade_settings() {
  std::vector<TradeSetting> settings;
  const auto add = [&](const TradeSetting& setting) {
    const auto same = [&](const TradeSetting& other) { return other.name == setting.name; };
    if (std::none_of(settings.begin(), settings.end(), same)) settings.push_back(setting);
  };
  add(usual_setting());
  for (std::size_t i = 0; i < qualities.size(); ++i) add(quality_setting(i));
  for (const int taps : {1, 2, 4, 16}) add(setting_of(with_taps(nearest_levels, taps), 1));
  for (const int taps : {1, 2}) add(setting_of(with_taps(best_levels, taps), 1));
  add(setting_of(unblended(nearest_levels), 1));
  add(setting_of(unblended(best_levels), 1));
  for (const int supersample : {1, 2, 3, 4}) add(setting_of(finest_alone, supersample));
  for (const int supersample : {2, 4}) {
    add(setting_of(nearest_levels, supersample));
    add(setting_of(with_taps(best_levels, 1), supersample));
  }
  add(setting_of(with_taps(nearest_levels, 4), 2));
  add(setting_of(unblended(best_levels), 2));
  add(setting_of(best_levels, 3));
  add(setting_of(nearest_levels, 1));
  for (const int supersample : {2, 4}) add(setting_of(best_levels, supersample));
  add(setting_of(finest_alone, 1, RenderPath::hybrid, PowerKind::fast));
  add(setting_of(best_levels, 4, RenderPath::hybrid, PowerKind::fast));
  for (const LevelOptions& levels : {nearest_levels, unblended(nearest_levels)})
    add(setting_of(levels, 1, RenderPath::paper));
  for (const LevelOptions& levels : {best_levels, nearest_levels})
    add(setting_of(levels, 1, RenderPath::shader));
  return settings;
}

}  // namespace selvedge
