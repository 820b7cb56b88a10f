#include "tests/spec/query.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace selvedge::test {
namespace {

void require(bool good, const char* message) {
  if (!good) throw std::invalid_argument(message);
}

template <class Vector>
Vector vector_from(const nlohmann::json& list) {
  Vector result;
  require(list.is_array() && list.size() == Vector::dimensions(), "a list of another length");
  for (unsigned i = 0; i < Vector::dimensions(); ++i) {
    const auto x = list[i].get<double>();
    result[static_cast<int>(i)] = static_cast<typename Vector::BaseType>(x);
    require(!std::is_integral_v<typename Vector::BaseType> || result[static_cast<int>(i)] == x, "not whole");
  }
  return result;
}

V3d direction_from(const nlohmann::json& list) {
  const auto direction = vector_from<V3d>(list);
  require(std::abs(direction.length() - 1) < 0.01, "not a unit vector");
  return direction;
}

/// Radiance that is nowhere negative.
ClosedEnvironment environment_from(const nlohmann::json& json) {
  using Kind = ClosedEnvironment::Kind;
  constexpr std::array names{"constant", "cosine", "lobe", "disc"};  // in the order of Kind
  const auto name = std::ranges::find(names, json.at("kind").get<std::string>());
  require(name != names.end(), "an unknown kind");
  ClosedEnvironment e;
  e.kind = static_cast<Kind>(name - names.begin());
  e.a = vector_from<V3d>(json.at("a"));
  if (e.kind != Kind::constant) {
    e.b = vector_from<V3d>(json.at("b"));
    e.axis = direction_from(json.at("axis")).normalized();
  }
  for (int c = 0; c < 3; ++c)
    require(e.a[c] + std::min(e.b[c], e.kind == Kind::cosine ? -e.b[c] : 0.0) >= 0, "negative somewhere");
  if (e.kind == Kind::lobe) e.exponent = json.at("exponent").get<double>();
  if (e.kind == Kind::disc) e.degrees = json.at("degrees").get<double>();
  require(e.exponent >= 0 && e.degrees > 0 && e.degrees <= 180, "exponent or degrees out of range");
  return e;
}

/// x, y and z of the fabric's frame in the world, of either hand.
std::array<V3d, 3> frame_from(const nlohmann::json& list) {
  std::array<V3d, 3> axes;
  require(list.is_array() && list.size() == 3, "not three directions");
  for (std::size_t i = 0; i < 3; ++i) {
    axes[i] = direction_from(list[i]);
    for (std::size_t k = 0; k < i; ++k) require(std::abs(axes[i].dot(axes[k])) < 0.01, "no right angles");
  }
  return axes;
}

}  // namespace

double ClosedEnvironment::pattern(double cosine) const {
  switch (kind) {
    case Kind::constant:
      return 0;
    case Kind::cosine:
      return cosine;
    case Kind::lobe:
      return cosine > 0 ? std::pow(cosine, exponent) : 0;
    case Kind::disc:
      return cosine > std::cos(degrees * std::numbers::pi / 180) ? 1 : 0;
  }
  return 0;
}

Query query_from(const nlohmann::json& line) {
  Query query;
  query.level = line.at("level").get<double>();
  require(line.contains("texel") != line.contains("uv"), "needs either texel or uv");
  if (line.contains("texel")) query.texel = vector_from<V2i>(line["texel"]);
  if (line.contains("uv")) query.uv = vector_from<V2d>(line["uv"]);
  query.behind = line.value("behind", false);
  V3d view = direction_from(line.at("view"));
  if (line.at("op") == "environment") {
    query.environment = environment_from(line.at("environment"));
    if (line.contains("background")) query.background = vector_from<V3d>(line["background"]);
    if (line.contains("frame")) {
      const auto [x, y, z] = frame_from(line["frame"]);
      for (V3d* d : {&view, &query.environment->axis}) *d = V3d(x.dot(*d), y.dot(*d), z.dot(*d));
      query.environment->axis.normalize();
    }
  } else {
    query.light = V3f(direction_from(line.at("light")));
  }
  query.view = V3f(view);
  return query;
}

}  // namespace selvedge::test
