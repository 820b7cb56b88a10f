// How an imported mesh lies in its cell: its period, unit and axes, guessed where they are not given.
#pragma once

#include <optional>
#include <string>

#include "converter/mesh/raw_mesh.h"

namespace selvedge {

enum class UpAxis { x, y, z };

const char* name_of(UpAxis axis);

/// From the file's axes to the cell's: y: (x, y, z) -> (x, -z, y); x: (x, y, z) -> (y, z, x).
template <class Vector>
Vector turned(const Vector& v, UpAxis up) {
  if (up == UpAxis::y) return {v.x, -v.z, v.y};
  return up == UpAxis::x ? Vector(v.y, v.z, v.x) : v;
}

/// How a mesh was read, and where each choice comes from, in words: "given" or the reason of a guess.
struct MeshChoices {
  V2d period{1, 1};  ///< mm
  std::string period_from;
  double scale_to_mm = 1;
  std::string scale_from;
  UpAxis up_axis = UpAxis::z;  ///< the file's axis out of the cloth
  std::string up_axis_from;
};

/// `period`, `scale_to_mm` and `up_axis` are those given. The rest is guessed: the axis out of the cloth is
/// the one along which the mesh is flattest (z where no other is flatter than 9/10 of it); a unit is a metre
/// where the mesh is smaller than 0.1 units in the plane, else a millimetre; the period is what a comment of
/// ours in the file says, else the extent of the mesh, which is 0 where it has none.
MeshChoices choose(const RawMesh& raw, const std::string& bytes, const std::optional<V2d>& period,
                   const std::optional<double>& scale_to_mm, const std::optional<UpAxis>& up_axis);

}  // namespace selvedge
