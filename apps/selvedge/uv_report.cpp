#include "apps/selvedge/uv_report.h"

#include <fmt/format.h>

namespace selvedge {

Json uv_json(const UvSize& size) {
  const auto pair = [](const V2d& v) { return Json{v.x, v.y}; };
  return {{"metresPerUv", pair(size.metres)},
          {"metresPerUvLow", pair(size.low)},
          {"metresPerUvHigh", pair(size.high)},
          {"stretched", size.stretched},
          {"withoutUvs", size.without}};
}

std::string uv_text(const UvSize& size) {
  return fmt::format(
      "{:.3g} x {:.3g} m a unit of uv ({:.3g} x {:.3g} to {:.3g} x {:.3g}), {:.0f} % stretched{}",
      size.metres.x, size.metres.y, size.low.x, size.low.y, size.high.x, size.high.y, 100 * size.stretched,
      size.without > 0 ? fmt::format(", {:.1g} % without uv", 100 * size.without) : "");
}

Json bounds_json(const Imath::Box3d& bounds) {
  if (bounds.isEmpty()) return nullptr;
  const auto corner = [](const V3d& v) { return Json{v.x, v.y, v.z}; };
  return {corner(bounds.min), corner(bounds.max)};
}

}  // namespace selvedge
