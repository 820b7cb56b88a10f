// Answers the queries of the conformance kit (spec/conformance/README.md) by the reference evaluation and by
// `selvedge check`. One JSON object per line in, one per line out.
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "apps/common/report.h"
#include "apps/selvedge/file_kind.h"
#include "format/base/json_text.h"
#include "format/base/option_text.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "tests/spec/query.h"

namespace {

using namespace selvedge;
using test::ClosedEnvironment;
using test::Query;

Shading shade(const Fabric& fabric, const Query& query) {
  if (query.uv) return evaluate(fabric, query.level, *query.uv, query.light, query.view);
  const int level = static_cast<int>(query.level);
  const bool known = level == query.level && level >= 0 && level < static_cast<int>(fabric.levels.size());
  const auto [x, y] = std::pair(query.texel->x, query.texel->y);
  if (!known || x < 0 || y < 0 || x >= fabric.levels[level].width || y >= fabric.levels[level].height)
    throw std::out_of_range("no such texel");
  return evaluate(fabric, level, x, y, query.light, query.view);
}

/// Integral of f times weight(cosine) over the directions whose cosine to the axis is more than `lowest`: a
/// mean over a spiral, each point of which stands for the same area.
template <class Weight>
V3d integral(const Fabric& fabric, Query query, const V3d& axis, double lowest, const Weight& weight) {
  constexpr int direction_count = 1 << 19;
  constexpr double two_pi = 2 * std::numbers::pi;
  const V3d side = axis.cross(std::abs(axis.x) < 0.5 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized();
  const V3d other = axis.cross(side);
  V3d sum(0, 0, 0);
  for (int i = 0; i < direction_count; ++i) {
    const double cosine = 1 - (1 - lowest) * (i + 0.5) / direction_count;
    const double turns = i * std::numbers::phi;
    const double angle = two_pi * (turns - std::floor(turns));
    const double sine = std::sqrt(1 - cosine * cosine);
    query.light = V3f(axis * cosine + (side * std::cos(angle) + other * std::sin(angle)) * sine);
    sum += V3d(shade(fabric, query).radiance) * weight(cosine);
  }
  return sum * (two_pi * (1 - lowest) / direction_count);
}

/// The radiance towards the view, holes and what lies behind them included, and the opacity.
Shading shown(const Fabric& fabric, const Query& query) {
  using Kind = ClosedEnvironment::Kind;
  const ClosedEnvironment& e = *query.environment;
  Shading result = shade(fabric, query);
  const bool opaque = fabric.sides == decltype(fabric.sides)();
  V3d light = e.a * integral(fabric, query, V3d(0, 0, 1), opaque ? 0 : -1, [](double) { return 1.0; });
  if (e.kind != Kind::constant) {
    // A small disc has all of the directions.
    const double lowest = e.kind == Kind::disc   ? std::cos(e.degrees * std::numbers::pi / 180)
                          : e.kind == Kind::lobe ? 0
                                                 : -1;
    light += e.b * integral(fabric, query, e.axis, lowest,
                            [&](double cosine) { return e.kind == Kind::disc ? 1 : e.pattern(cosine); });
  }
  const double alpha = result.alpha;
  const V3d radiance = light * alpha + query.background.value_or(e.at(-V3d(query.view))) * (1 - alpha);
  for (int c = 0; c < 3; ++c)
    result.radiance[c] =
        static_cast<float>(std::min(radiance[c], static_cast<double>(std::numeric_limits<float>::max())));
  return result;
}

Json issues_of(const std::string& file) {
  // Unrecognisable content: the name decides.
  const bool named_gltf = has_ending(file, ".gltf") || has_ending(file, ".glb");
  const FileKind kind = kind_of(file).value_or(named_gltf ? FileKind::gltf : FileKind::fabric);
  Json issues = Json::array();
  for (const Error& issue : check_file(file, kind)) issues.push_back(to_json(issue));
  return {{"issues", issues}};
}

/// The fabric as it is seen, with the texels of its map; the last one is kept.
const Fabric& seen_fabric(const std::string& file, bool behind) {
  static std::pair<std::string, bool> name;
  static Fabric fabric;
  if (name != std::pair(file, behind)) {
    fabric = arranged(value_or_throw(read_fabric(file)));
    if (behind && fabric.find_side(Side::back) != nullptr) fabric = turned_over(fabric);
    name = {file, behind};
  }
  return fabric;
}

Json answer(const nlohmann::json& line) {
  const auto file = line.at("file").get<std::string>();
  if (line.at("op") == "check") return issues_of(file);
  const Query query = test::query_from(line);
  const Fabric& fabric = seen_fabric(file, query.behind);
  const Shading shading = query.environment ? shown(fabric, query) : shade(fabric, query);
  return {{"rgb", shading.radiance}, {"alpha", shading.alpha}};
}

Json answer_or_error(const std::string& line) {
  try {
    return answer(parse_json(line));
  } catch (const Failure& failure) {
    return {{"error", name_of(failure.error.code)}, {"message", failure.error.message}};
  } catch (const std::exception& error) {
    return {{"error", "QUERY"}, {"message", error.what()}};
  }
}

}  // namespace

int main() {
  for (std::string line; std::getline(std::cin, line);)
    std::cout << answer_or_error(line).dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
}
