// The coordinates of mesh files that are texts, in double precision: OpenMesh reads them in single, which has
// no digits left for the shape of a mesh that lies far from the origin.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

/// Of the vertices of a plain OBJ text (plain_obj), in order.
std::vector<V3d> obj_points(std::string_view plain);

/// Of the vertices of an OFF text, in order; empty for binary files and for other than three dimensions.
std::vector<V3d> off_points(const std::string& text);

/// An STL text that lies far from the origin, measured by its size, moved to it by `origin`, which is to be
/// added again; the text as it is, and 0, where it lies near.
std::string stl_near_origin(const std::string& text, V3d& origin);

/// Puts the points in the place of positions that a reader has rounded; positions stay where the points are
/// not those that it has read.
void sharpen(std::vector<V3d>& positions, const std::vector<V3d>& points);

/// Whether single precision would blur a mesh between these corners.
bool lies_far(const V3d& low, const V3d& high);

}  // namespace selvedge
