#include "apps/selvedge/query.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "format/base/guard.h"

namespace selvedge {
namespace {

constexpr int direction_count = 1 << 19;
constexpr double two_pi = 2 * std::numbers::pi;

double cosine_of(double degrees) { return std::cos(degrees * std::numbers::pi / 180); }

/// Integral of f times share(cosine) over the directions whose cosine to the axis is more than `least`: a
/// mean over a spiral, each point of which stands for the same area.
template <class Share>
V3d integral(QueriedFabric& fabric, FabricQuery query, const V3d& axis, double least, const Share& share) {
  const V3d side = axis.cross(std::abs(axis.x) < 0.5 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized();
  const V3d other = axis.cross(side);
  V3d sum(0, 0, 0);
  for (int i = 0; i < direction_count; ++i) {
    const double cosine = 1 - (1 - least) * (i + 0.5) / direction_count;
    const double turns = i * std::numbers::phi;
    const double angle = two_pi * (turns - std::floor(turns));
    const double sine = std::sqrt(1 - cosine * cosine);
    query.light = V3f(axis * cosine + (side * std::cos(angle) + other * std::sin(angle)) * sine);
    if (query.light.z <= 0 && !fabric.lets_through()) continue;
    sum += V3d(value_or_throw(fabric.shade(query)).radiance) * share(cosine);
  }
  return sum * (two_pi * (1 - least) / direction_count);
}

/// A list of `Vector::dimensions()` numbers.
template <class Vector>
Vector vector_from(const nlohmann::json& query, const char* name) {
  const auto list = query.find(name);
  if (list == query.end() || !list->is_array() || list->size() != Vector::dimensions())
    malformed(name, "is missing or of another length");
  Vector result;
  for (unsigned i = 0; i < Vector::dimensions(); ++i) {
    const nlohmann::json& item = (*list)[i];
    constexpr bool whole = std::is_integral_v<typename Vector::BaseType>;
    if (whole ? !item.is_number_integer() : !item.is_number()) malformed(name, "does not hold numbers");
    if (whole && !(item >= -1 && item <= 1 << 30)) malformed(name, "is out of range");
    result[static_cast<int>(i)] = item.get<typename Vector::BaseType>();
  }
  return result;
}

/// A direction is not normalised, so it has to be a unit vector to the precision of its digits.
V3d direction_from(const nlohmann::json& query, const char* name) {
  const V3d direction = vector_from<V3d>(query, name);
  if (!(std::abs(direction.length() - 1) < 0.01)) malformed(name, "is not a unit vector");
  return direction;
}

double number_from(const nlohmann::json& query, const char* name) {
  const auto found = query.find(name);
  return found != query.end() && found->is_number() ? found->get<double>() : std::nan("");
}

/// The level, and a texel or texture coordinates.
FabricQuery place_from(const nlohmann::json& line) {
  FabricQuery query;
  query.level = number_from(line, "level");
  if (std::isnan(query.level)) malformed("level", "is missing or not a number");
  if (line.contains("texel") == line.contains("uv")) malformed("", "has not one of texel and uv");
  if (line.contains("texel")) query.texel = vector_from<V2i>(line, "texel");
  if (line.contains("uv")) query.uv = vector_from<V2d>(line, "uv");
  if (const auto behind = line.find("behind"); behind != line.end()) {
    if (!behind->is_boolean()) malformed("behind", "is neither true nor false");
    query.behind = behind->get<bool>();
  }
  return query;
}

/// Radiance that is nowhere negative.
void read_radiance(const nlohmann::json& json, ClosedEnvironment& e) {
  e.a = vector_from<V3d>(json, "a");
  if (e.kind != ClosedEnvironment::Kind::constant) e.b = vector_from<V3d>(json, "b");
  for (int c = 0; c < 3; ++c) {
    const double opposite = e.kind == ClosedEnvironment::Kind::cosine ? e.a[c] - e.b[c] : e.a[c];
    if (!(e.a[c] + e.b[c] >= 0 && opposite >= 0)) malformed("environment", "is negative somewhere");
  }
}

ClosedEnvironment environment_from(const nlohmann::json& line) {
  using Kind = ClosedEnvironment::Kind;
  constexpr std::array names{"constant", "cosine", "lobe", "disc"};  // in the order of Kind
  const auto json = line.find("environment");
  if (json == line.end() || !json->is_object()) malformed("environment", "is missing or not an object");
  const auto kind = json->find("kind");
  const auto name =
      std::ranges::find_if(names, [&](const char* known) { return kind != json->end() && *kind == known; });
  if (name == names.end()) malformed("kind", "is not constant, cosine, lobe or disc");
  ClosedEnvironment e;
  e.kind = static_cast<Kind>(name - names.begin());
  read_radiance(*json, e);
  if (e.kind != Kind::constant) e.axis = direction_from(*json, "axis").normalized();
  if (e.kind == Kind::lobe) e.exponent = number_from(*json, "exponent");
  if (e.kind == Kind::disc) e.degrees = number_from(*json, "degrees");
  if (!(e.exponent >= 0)) malformed("exponent", "is no number of at least 0");
  if (!(e.degrees > 0 && e.degrees <= 180)) malformed("degrees", "is no angle above 0 and up to 180");
  return e;
}

/// x, y and z of the fabric's frame in the world, of either hand.
using Axes = std::array<V3d, 3>;

V3d in_frame(const Axes& axes, const V3d& d) { return {axes[0].dot(d), axes[1].dot(d), axes[2].dot(d)}; }

/// Where there is no frame, directions are in the fabric's already.
Axes frame_from(const nlohmann::json& line) {
  Axes axes{V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
  const auto list = line.find("frame");
  if (list == line.end()) return axes;
  if (!list->is_array() || list->size() != 3) malformed("frame", "is not three directions");
  for (std::size_t i = 0; i < 3; ++i) {
    axes[i] = direction_from({{"frame", (*list)[i]}}, "frame");
    for (std::size_t k = 0; k < i; ++k) {
      if (!(std::abs(axes[i].dot(axes[k])) < 0.01)) malformed("frame", "has no right angles");
    }
  }
  return axes;
}

}  // namespace

Result<QueriedFabric> QueriedFabric::open(const std::string& path) {
  return read_fabric(path).map([&](Fabric&& fabric) { return QueriedFabric(path, std::move(fabric)); });
}

Result<Shading> QueriedFabric::shade(const FabricQuery& query) {
  const bool turns = query.behind && front_.side_of(Side::back) != nullptr;
  if (turns && !behind_) behind_ = turned_over(front_);
  const Fabric& fabric = turns ? *behind_ : front_;
  if (query.uv) return evaluate(fabric, query.level, *query.uv, query.light, query.view);
  const auto refuse = [&](const char* place, std::string message) {
    return fail(Code::option_out_of_range, path_, place, std::move(message));
  };
  if (!(query.level >= 0 && query.level <= levels() - 1)) {
    return refuse("level", fmt::format("{} is outside of 0 to {}", query.level, levels() - 1));
  }
  const int level = static_cast<int>(query.level);
  if (level != query.level) return refuse("level", "a texel is of one whole level");
  const FabricLevel& texels = fabric.levels[level];
  const auto [x, y] = std::pair(query.texel->x, query.texel->y);
  if (x < 0 || y < 0 || x >= texels.width || y >= texels.height) {
    return refuse("texel", fmt::format("level {} has {}x{} texels", level, texels.width, texels.height));
  }
  return evaluate(fabric, level, x, y, query.light, query.view);
}

double ClosedEnvironment::pattern(double cosine) const {
  switch (kind) {
    case Kind::constant:
      return 0;
    case Kind::cosine:
      return cosine;
    case Kind::lobe:
      return cosine > 0 ? std::pow(cosine, exponent) : 0;
    case Kind::disc:
      return cosine > cosine_of(degrees) ? 1 : 0;
  }
  return 0;
}

Shading shown(QueriedFabric& fabric, const EnvironmentQuery& query) {
  const ClosedEnvironment& e = query.environment;
  Shading result = value_or_throw(fabric.shade(query.place));
  V3d light = e.a * integral(fabric, query.place, V3d(0, 0, 1), fabric.lets_through() ? -1 : 0,
                             [](double) { return 1.0; });
  if (e.kind != ClosedEnvironment::Kind::constant) {
    // A small disc has all of the directions.
    const bool disc = e.kind == ClosedEnvironment::Kind::disc;
    const double least = disc ? cosine_of(e.degrees) : e.kind == ClosedEnvironment::Kind::lobe ? 0 : -1;
    light += e.b * integral(fabric, query.place, e.axis, least,
                            [&](double cosine) { return disc ? 1 : e.pattern(cosine); });
  }
  const double alpha = result.alpha;
  const V3d radiance = light * alpha + query.background.value_or(e.at(-V3d(query.place.view))) * (1 - alpha);
  for (int c = 0; c < 3; ++c)
    result.radiance[c] =
        static_cast<float>(std::min(radiance[c], static_cast<double>(std::numeric_limits<float>::max())));
  return result;
}

void malformed(const char* place, const char* message) {
  throw Failure{Error{Code::json_malformed, {}, place, message}};
}

FabricQuery query_from(const nlohmann::json& line) {
  FabricQuery query = place_from(line);
  query.light = V3f(direction_from(line, "light"));
  query.view = V3f(direction_from(line, "view"));
  return query;
}

EnvironmentQuery environment_query_from(const nlohmann::json& line) {
  EnvironmentQuery query{place_from(line), {}, {}};
  const V3d view = direction_from(line, "view");
  query.environment = environment_from(line);
  const Axes frame = frame_from(line);
  query.place.view = V3f(in_frame(frame, view));
  query.environment.axis = in_frame(frame, query.environment.axis).normalized();
  if (line.contains("background")) query.background = vector_from<V3d>(line, "background");
  return query;
}

}  // namespace selvedge
