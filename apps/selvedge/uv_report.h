// How large a garment's texture coordinates are, for people and for programs.
#pragma once

#include <Imath/ImathBox.h>

#include <string>

#include "apps/common/report.h"
#include "converter/dress/uv_scale.h"

namespace selvedge {

/// Members of a material's entry in a report.
Json uv_json(const UvSize& size);
/// The same in a line, without an end: in brackets the lengths that nine tenths of the area keep to.
std::string uv_text(const UvSize& size);

/// Corners, metres; null without triangles.
Json bounds_json(const Imath::Box3d& bounds);

}  // namespace selvedge
