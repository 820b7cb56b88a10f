// Bounds of a garment in reports.
#pragma once

#include <Imath/ImathBox.h>

#include "apps/common/report.h"
#include "format/base/vec.h"

namespace selvedge {

/// Corners, metres; null without triangles.
inline Json bounds_json(const Imath::Box3d& bounds) {
  if (bounds.isEmpty()) return nullptr;
  const auto corner = [](const V3d& v) { return Json{v.x, v.y, v.z}; };
  return {corner(bounds.min), corner(bounds.max)};
}

}  // namespace selvedge
