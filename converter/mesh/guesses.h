// Guesses the period, unit and up axis of an imported mesh where they are not given.
#pragma once

#include <optional>
#include <string>

#include "format/mesh/mesh_file.h"

namespace selvedge {

enum class UpAxis { x, y, z };

const char* name_of(UpAxis axis);

/// From the file's axes to the cell's: y: (x, y, z) -> (x, -z, y); x: (x, y, z) -> (y, z, x).
template <class Vector>
Vector to_cell_axes(const Vector& v, UpAxis up) {
  if (up == UpAxis::y) return {v.x, -v.z, v.y};
  return up == UpAxis::x ? Vector(v.y, v.z, v.x) : v;
}

/// How a mesh was read, and why: each *_from is "given" or the reason of a guess, for people.
struct MeshChoices {
  V2d period{1, 1};  ///< mm
  std::string period_source;
  double scale_to_mm = 1;
  std::string scale_source;
  UpAxis up_axis = UpAxis::z;  ///< the file's axis out of the cloth
  std::string up_axis_source;
};

/// A line for each guess.
std::vector<std::string> remarks_on(const MeshChoices& choices);

/// Guesses `period`, `scale_to_mm` and `up_axis` where they are not given. The up axis is the one of least
/// extent (z unless another has less than 9/10 of its extent); a unit is a metre if the mesh is smaller than
/// 0.1 units in the plane, else a millimetre; the period comes from the comment of write_mesh(), else it is
/// the extent of the mesh, which may be 0.
MeshChoices guess_mesh_choices(const MeshFile& file, const std::string& bytes,
                               const std::optional<V2d>& period, const std::optional<double>& scale_to_mm,
                               const std::optional<UpAxis>& up_axis);

}  // namespace selvedge
