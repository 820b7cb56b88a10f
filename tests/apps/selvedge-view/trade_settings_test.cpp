#include "apps/selvedge-view/trade_settings.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <set>

#include "viewer/render_checks.h"

namespace selvedge {
namespace {

TEST_CASE(
    "a sweep tries every named quality, the usual setting first, and no two that differ in name alone") {
  const std::vector<TradeSetting> settings = trade_settings();
  CHECK(settings.front().name == usual_setting().name);
  std::set<std::string> names;
  std::set<std::string> options;
  std::set<std::string> knobs;
  for (const TradeSetting& setting : settings) {
    CAPTURE(setting.name);
    CHECK(names.insert(setting.name).second);
    CHECK(options.insert(setting.options).second);
    CHECK(knobs.insert(setting.knobs).second);
    CHECK(check_options(setting.render).has_value());
  }
  for (std::size_t i = 0; i < frame_quality_names.size(); ++i)
    CHECK(names.count(quality_setting(i).name) == 1);
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::shader, RenderPath::paper}) {
    CHECK(std::any_of(settings.begin(), settings.end(),
                      [&](const TradeSetting& setting) { return setting.render.path == path; }));
  }
}

TEST_CASE("a setting's options and knobs tell its powers, but for the shader path, which has OpenGL's") {
  for (const TradeSetting& setting : trade_settings()) {
    CAPTURE(setting.name);
    const bool fast = setting.render.power == PowerKind::fast;
    const bool shader = setting.render.path == RenderPath::shader;
    CHECK((setting.options.find("--power fast") != std::string::npos) == fast);
    CHECK((setting.knobs.find(R"("power":"fast")") != std::string::npos) == fast);
    CHECK((setting.knobs.find("power") == std::string::npos) == shader);
  }
}

}  // namespace
}  // namespace selvedge
