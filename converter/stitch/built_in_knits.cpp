#include <algorithm>
#include <array>
#include <utility>

#include "converter/stitch/built_in.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/knit.h"
#include "converter/stitch/yarn_settings.h"

namespace selvedge {
namespace {

/// Descriptions and charts (spec/chart.md).
constexpr std::pair<const char*, const char*> knits[] = {
    {"stockinette from its face, one red yarn", R"(name: plain-knit
yarn A: albedo=0.50,0.13,0.09
1: k)"},
    {"stockinette from its back", R"(name: purl
yarn A: albedo=0.10,0.30,0.31
1: p)"},
    {"1x1 rib: wales of knit and purl by turns", R"(name: rib
wale_mm: 4.5
yarn A: albedo=0.58,0.36,0.07 radius_mm=0.56
1: k p)"},
    {"2x2 rib: two wales of knit, two of purl", R"(name: rib-2x2
wale_mm: 4.5
yarn A: albedo=0.13,0.16,0.22 radius_mm=0.56
1: k2 p2)"},
    {"garter stitch: courses of knit and purl by turns", R"(name: garter
course_mm: 3
yarn A: albedo=0.20,0.33,0.12 radius_mm=0.6
2: p
1: k)"},
    {"stockinette with courses of two colours", R"(name: two-colour
yarn A: albedo=0.62,0.56,0.45
yarn B: albedo=0.06,0.11,0.26
2: k [B]
1: k [A])"},
    {"eyelets: yarn overs and decreases in every second course, set off by turns", R"(name: lace
yarn A: albedo=0.47,0.17,0.25
4: k2tog k2 yo
3: k4
2: k yo k2tog k
1: k4)"}};

/// Of the parameters of each yarn of a chart.
constexpr std::array<const char*, max_chart_yarns> prefixes{"",       "second_", "third_",   "fourth_",
                                                            "fifth_", "sixth_",  "seventh_", "eighth_"};

}  // namespace

StitchParameter length_parameter(const std::string& name, double value, const std::string& meaning) {
  return {name, {value}, min_stitch_mm, max_stitch_mm, false, meaning};
}

StitchParameter slack_parameter() {
  return {"slack", {0}, 0, 2, false, "air between neighbouring yarns, in radii: yarns lie looser and longer"};
}

void append(std::vector<StitchParameter>& parameters, const std::vector<StitchParameter>& more) {
  parameters.insert(parameters.end(), more.begin(), more.end());
}

void append_yarn(std::vector<StitchParameter>& parameters, const std::string& prefix, int kind,
                 double shorter_mm, Yarn yarn) {
  set_kind(kind, prefix, shorter_mm, yarn);
  append(parameters, yarn_parameters(prefix, yarn));
}

double radius_for(const StitchValues& values, const std::string& name, double gauge) {
  return values.number(name) * (values.is_set(name) ? 1 : gauge);
}

BuiltIn knit(const std::string& description, const ChartText& chart) {
  const KnitChart& drawn = chart.knit;
  BuiltIn stitch;
  stitch.info = {chart.name, description, {}};
  auto& parameters = stitch.info.parameters;
  const double radius_mm = drawn.yarns.front().radius_mm;
  parameters = {length_parameter("wale_mm", drawn.wale_mm, "width of one stitch"),
                length_parameter("course_mm", drawn.course_mm, "height of one course"),
                length_parameter("radius_mm", radius_mm, "of the yarn; not set, it follows the gauge"),
                slack_parameter()};
  append(parameters, common_parameters(drawn.yarns.front().fibre));
  const auto shorter = [wales = drawn.rows.front().size(), courses = drawn.rows.size()](double wale,
                                                                                        double course) {
    return std::min(wale * static_cast<double>(wales), course * static_cast<double>(courses));
  };
  for (std::size_t k = 0; k < drawn.yarns.size(); ++k) {
    Yarn yarn = drawn.yarns[k];
    const int kind = std::exchange(yarn.fibre, 0);
    if (k > 0) append(parameters, shared_parameters(prefixes[k], kind));
    append_yarn(parameters, prefixes[k], kind, shorter(drawn.wale_mm, drawn.course_mm), yarn);
    for (const auto& [name, value] : chart.settings[k]) stitch.settings[prefixes[k] + name] = value;
  }
  stitch.radii = "radius_mm";
  stitch.draw = [=](const StitchValues& values, Flat) {
    KnitChart set = chart.knit;
    set.wale_mm = values.number("wale_mm");
    set.course_mm = values.number("course_mm");
    const double gauge = std::min(set.wale_mm / chart.knit.wale_mm, set.course_mm / chart.knit.course_mm);
    for (std::size_t k = 0; k < set.yarns.size(); ++k) {
      Yarn& yarn = set.yarns[k];
      // One setting for all: thicker ones stay so many times as thick.
      yarn.radius_mm = radius_for(values, "radius_mm", gauge) * (yarn.radius_mm / radius_mm);
      yarn.fibre = 0;
      apply_flattening(values, prefixes[k], yarn);
      apply_settings(values, prefixes[k], shorter(set.wale_mm, set.course_mm), yarn);
    }
    return draw_knit(set, chart.name);
  };
  return stitch;
}

std::vector<BuiltIn> built_in_knits() {
  std::vector<BuiltIn> stitches;
  for (const auto& [description, text] : knits)
    stitches.push_back(knit(description, read_chart(text, "").value()));
  return stitches;
}

}  // namespace selvedge
