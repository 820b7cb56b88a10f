#include "converter/mesh/guesses.h"

#include <fmt/format.h>

#include <Imath/ImathBox.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace selvedge {
namespace {

/// Size of the bounding box of all used vertices, in the file's axes and units.
V3d extent_of(const MeshFile& file) {
  Imath::Box3d box;
  for (const MeshCorner& corner : file.corners) box.extendBy(file.positions[corner.position]);
  return box.isEmpty() ? V3d(0) : box.max - box.min;
}

/// The period that write_mesh keeps in a comment.
std::optional<V2d> period_in_comment(const std::string& bytes) {
  constexpr std::size_t searched = 4096;
  const std::string start = bytes.substr(0, searched);
  for (const char* mark : {"# period ", "comment period "}) {
    const std::size_t offset = start.find(mark);
    if (offset == std::string::npos) continue;
    V2d period;
    if (std::sscanf(start.c_str() + offset + std::strlen(mark), "%lf x %lf mm", &period.x, &period.y) == 2)
      return period;
  }
  return std::nullopt;
}

}  // namespace

const char* name_of(UpAxis axis) { return axis == UpAxis::x ? "x" : (axis == UpAxis::y ? "y" : "z"); }

std::vector<std::string> remarks_on(const MeshChoices& c) {
  std::vector<std::string> remarks;
  for (const auto& [remark, from] :
       {std::pair(fmt::format("period {:g} x {:g} mm", c.period.x, c.period.y), c.period_source),
        std::pair(fmt::format("{:g} mm per unit", c.scale_to_mm), c.scale_source),
        std::pair(fmt::format("axis {} out of the cloth", name_of(c.up_axis)), c.up_axis_source)})
    if (from != "given") remarks.push_back(fmt::format("{} ({})", remark, from));
  return remarks;
}

MeshChoices guess_mesh_choices(const MeshFile& file, const std::string& bytes,
                               const std::optional<V2d>& period, const std::optional<double>& scale_to_mm,
                               const std::optional<UpAxis>& up_axis) {
  constexpr double clearly = 0.9;      // ratio of extents
  constexpr double smallest_mm = 0.1;  // a smaller cell must be in metres
  const V3d extent = extent_of(file);
  MeshChoices choices{.period_source = "given", .scale_source = "given", .up_axis_source = "given"};
  const auto commented = period_in_comment(bytes);
  if (up_axis) {
    choices.up_axis = *up_axis;
  } else if (commented) {  // thick cloth of few stitches may be flattest along another
    choices.up_axis_source = "a comment in the file";
  } else if (std::min(extent.x, extent.y) < clearly * extent.z) {
    choices.up_axis = extent.y <= extent.x ? UpAxis::y : UpAxis::x;
    choices.up_axis_source = "guessed: the mesh is flattest along it";
  } else {
    choices.up_axis_source = "guessed: no other axis is flatter";
  }
  const V3d size = to_cell_axes(extent, choices.up_axis);
  const V2d plane(std::abs(size.x), std::abs(size.y));
  if (scale_to_mm) {
    choices.scale_to_mm = *scale_to_mm;
  } else if (!period && !commented && std::max(plane.x, plane.y) < smallest_mm) {
    choices.scale_to_mm = 1000;
    choices.scale_source = "guessed: metres, as it is too small for millimetres";
  } else {
    choices.scale_source = "guessed: millimetres";
  }
  if (period) {
    choices.period = *period;
  } else if (commented) {
    choices.period = *commented;
    choices.period_source = "a comment in the file";
  } else {
    choices.period = plane * choices.scale_to_mm;
    choices.period_source = "guessed: the extent of the mesh";
  }
  return choices;
}

}  // namespace selvedge
