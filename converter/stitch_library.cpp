#include "converter/stitch_library.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>

#include "converter/stitch_json.h"

namespace selvedge {
namespace {

using std::numbers::pi;

/// A point of a curve and its derivative by the parameter.
struct CurvePoint {
  V3d position;
  V3d velocity;
};

/// A chain of `count` cubic segments through a curve's points with its tangents (Hermite), t from t0 to t1.
std::vector<BezierSegment> chain_along(const std::function<CurvePoint(double)>& curve, double t0, double t1,
                                       int count) {
  std::vector<BezierSegment> chain;
  const double step = (t1 - t0) / count;
  CurvePoint a = curve(t0);
  for (int i = 1; i <= count; ++i) {
    const CurvePoint b = curve(t0 + i * step);
    chain.push_back(
        {a.position, a.position + a.velocity * (step / 3), b.position - b.velocity * (step / 3), b.position});
    a = b;
  }
  return chain;
}

}  // namespace

StitchPattern plain_knit(const PlainKnitOptions& o) {
  const auto loop = [&](double t) {
    return CurvePoint{V3d(o.wale_mm * t / (2 * pi) + o.neck_mm * std::sin(2 * t), -o.height_mm * std::cos(t),
                          -o.depth_mm * std::cos(2 * t)),
                      V3d(o.wale_mm / (2 * pi) + 2 * o.neck_mm * std::cos(2 * t), o.height_mm * std::sin(t),
                          2 * o.depth_mm * std::sin(2 * t))};
  };
  StitchPattern pattern;
  pattern.name = "plain-knit";
  pattern.period_mm = {o.wale_mm, o.course_mm};
  pattern.yarns.push_back({"course", o.radius_mm, o.albedo, chain_along(loop, 0, 2 * pi, o.segments)});
  return pattern;
}

StitchPattern plain_weave(const PlainWeaveOptions& o) {
  StitchPattern pattern;
  pattern.name = "plain-weave";
  const double period = 2 * o.spacing_mm;
  pattern.period_mm = {period, period};
  const double height = o.warp_radius_mm + o.weft_radius_mm;
  const double warp_rise = o.warp_share * height;
  const double weft_rise = height - warp_rise;
  for (int k = 0; k < 2; ++k) {
    const double across = (k + 0.5) * o.spacing_mm;
    const double sign = k == 0 ? 1 : -1;
    // At the crossings (along = spacing / 2, 3/2 spacing) the sine is 1 and -1.
    const auto rise = [&](double along) { return sign * std::sin(2 * pi * along / period); };
    const auto slope = [&](double along) {
      return sign * std::cos(2 * pi * along / period) * 2 * pi / period;
    };
    pattern.yarns.push_back(
        {fmt::format("warp {}", k + 1), o.warp_radius_mm, o.warp_albedo,
         chain_along(
             [&](double y) {
               return CurvePoint{V3d(across, y, warp_rise * rise(y)), V3d(0, 1, warp_rise * slope(y))};
             },
             0, period, 8)});
    pattern.yarns.push_back(
        {fmt::format("weft {}", k + 1), o.weft_radius_mm, o.weft_albedo,
         chain_along(
             [&](double x) {
               return CurvePoint{V3d(x, across, -weft_rise * rise(x)), V3d(1, 0, -weft_rise * slope(x))};
             },
             0, period, 8)});
  }
  return pattern;
}

std::vector<StitchInfo> built_in_stitches() {
  return {{"plain-knit", "stockinette from its face, one stitch of 5 x 3.8 mm, one red wool yarn"},
          {"plain-weave", "two warp by two weft yarns, 2 x 2 mm, off-white warp and blue weft"}};
}

Result<StitchPattern> find_stitch(const std::string& name_or_json_path) {
  if (name_or_json_path == "plain-knit") return plain_knit();
  if (name_or_json_path == "plain-weave") return plain_weave();
  std::error_code ignored;
  if (std::filesystem::exists(name_or_json_path, ignored)) return read_stitch_file(name_or_json_path);
  std::string names;
  for (const StitchInfo& info : built_in_stitches()) names += (names.empty() ? "" : ", ") + info.name;
  return fail(Code::stitch_unknown, name_or_json_path, "",
              "no such file and no such built-in stitch (there are " + names + ")");
}

}  // namespace selvedge
