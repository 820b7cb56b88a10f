#include "viewer/trade_settings.h"

#include <fmt/format.h>

#include <array>

namespace selvedge {
namespace {

/// Names, options and knobs follow from what it draws with.
TradeSetting setting_of(const LevelOptions& levels, int supersample, RenderPath path) {
  TradeSetting setting;
  setting.render.levels = levels;
  setting.render.supersample = supersample;
  setting.render.path = path;
  setting.render.layers = 1;
  const char* filter = levels.linear ? "linear" : "nearest";
  const char* blend = levels.blend ? "on" : "off";
  const char* by = path == RenderPath::shader ? "shader" : "hybrid";
  if (levels.forced >= 0) {
    setting.name = fmt::format("{}-level{}-x{}", by, levels.forced, supersample);
    setting.options = fmt::format("--level {}", levels.forced);
    setting.knobs =
        fmt::format(R"({{"path": "{}", "level": {}, "supersample": {}}})", by, levels.forced, supersample);
  } else {
    setting.name = fmt::format("{}-{}-taps{}-blend-{}-x{}", by, filter, levels.taps, blend, supersample);
    setting.options = fmt::format("--filter {} --anisotropy {} --level-blend {}", filter, levels.taps, blend);
    setting.knobs =
        fmt::format(R"({{"path": "{}", "filter": "{}", "taps": {}, "levelBlend": "{}", "supersample": {}}})",
                    by, filter, levels.taps, blend, supersample);
  }
  if (supersample > 1) setting.options += fmt::format(" --supersample {}", supersample);
  if (path == RenderPath::shader) setting.options += " --path shader";
  return setting;
}

}  // namespace

TradeSetting usual_setting() { return setting_of(best_levels, 1, RenderPath::hybrid); }

TradeSetting quality_setting(std::size_t quality) {
  constexpr std::array<int, 4> supersample{1, 1, 2, 4};
  const LevelOptions levels = quality == 0 ? LevelOptions() : best_levels;
  return setting_of(levels, supersample[quality], RenderPath::hybrid);
}

std::vector<TradeSetting> trade_settings() {
  std::vector<TradeSetting> settings{usual_setting()};
  const auto add = [&](const LevelOptions& levels, int supersample = 1,
                       RenderPath path = RenderPath::hybrid) {
    settings.push_back(setting_of(levels, supersample, path));
  };
  LevelOptions nearest;
  for (const int taps : {1, 2, 4, 16}) {
    nearest.taps = taps;
    add(nearest);
  }
  nearest.taps = 1;
  LevelOptions unblended = nearest;
  unblended.blend = false;
  add(unblended);
  LevelOptions linear = best_levels;
  for (const int taps : {1, 2}) {
    linear.taps = taps;
    add(linear);
  }
  linear = best_levels;
  linear.blend = false;
  add(linear);
  LevelOptions finest;
  finest.forced = 0;
  add(finest);
  add(finest, 4);
  add(nearest, 2);
  add(best_levels, 2);
  add(best_levels, 4);
  add(best_levels, 1, RenderPath::shader);
  add(nearest, 1, RenderPath::shader);
  return settings;
}

}  // namespace selvedge
