#include "format/picture/environment.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace selvedge {
namespace {

/// A square of even radiance at a distance of 1, whose edges fade.
struct Softbox {
  V3d towards;        ///< its middle; unit
  double half_width;  ///< of the square in the plane at its distance
  double radiance;
};

constexpr double fade = 0.06;  ///< width of a softbox's edge
constexpr double floor_radiance = 0.2;
constexpr double ceiling_radiance = 0.5;

double smooth_step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

double radiance_of(const Softbox& box, const V3d& direction) {
  const double depth = direction.dot(box.towards);
  if (!(depth > 0)) return 0;
  const V3d right = V3d(0, 1, 0).cross(box.towards).normalized();
  const V3d up = box.towards.cross(right);
  const double x = std::abs(direction.dot(right)) / depth;
  const double y = std::abs(direction.dot(up)) / depth;
  const auto fraction = [&](double place) {
    return 1 - smooth_step(box.half_width - fade, box.half_width + fade, place);
  };
  return box.radiance * fraction(x) * fraction(y);
}

}  // namespace

Environment studio_environment(const EnvironmentOptions& options) {
  const std::array boxes{Softbox{V3d(-0.75, 0.60, 0.70).normalized(), 0.26, 16.0},
                         Softbox{V3d(0.70, 0.55, -0.60).normalized(), 0.26, 9.0}};
  Environment room{256, 128, {}, {}};
  room.radiance.reserve(static_cast<std::size_t>(room.width) * room.height);
  for (int y = 0; y < room.height; ++y) {
    for (int x = 0; x < room.width; ++x) {
      const V3d d = room.direction(x, y);
      double sum = floor_radiance + (ceiling_radiance - floor_radiance) * smooth_step(-0.4, 0.5, d.y);
      for (const Softbox& box : boxes) sum += radiance_of(box, d);
      room.radiance.emplace_back(static_cast<float>(sum));
    }
  }
  room.options = options;
  return room;
}

Result<Environment> load_environment(const std::string& name, const EnvironmentOptions& options,
                                     std::uint64_t memory) {
  if (name == "studio") return studio_environment(options);
  return read_environment(name, options, memory);
}

}  // namespace selvedge
