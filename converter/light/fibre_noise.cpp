#include "converter/light/fibre_noise.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "format/fabric/yarn_strands.h"

namespace selvedge {
namespace {

/// Place of a point, from those of the corners that lie on the same yarn as the nearest one.
YarnPlace place_at(const CellMesh& mesh, const SurfacePoint& point) {
  const V3i& corner = mesh.triangles[point.triangle];
  const std::array<float, 3> share{1 - point.u - point.v, point.u, point.v};
  const auto nearest = std::max_element(share.begin(), share.end()) - share.begin();
  YarnPlace place = mesh.places[corner[static_cast<int>(nearest)]];
  if (place.skin < 0) return place;
  const YarnPlace origin = place;
  float sum = 0;
  float along = 0;
  float around = 0;
  for (int i = 0; i < 3; ++i) {
    const YarnPlace& other = mesh.places[corner[i]];
    if (other.skin != origin.skin) continue;
    // Corners may lie on either side of where the yarn, or a turn about it, begins again.
    const float ahead = other.along - origin.along;
    const float turned = other.around - origin.around;
    sum += share[i];
    along += share[i] * (ahead - std::round(ahead));
    around += share[i] * (turned - std::round(turned));
  }
  place.along += along / sum;
  place.around += around / sum;
  return place;
}

}  // namespace

void add_fibre_noise(const CellMesh& mesh, const SurfacePoint& point, YarnSurface& surface) {
  if (mesh.places.empty() || point.view == V3f(0, 0, 0)) return;
  const YarnPlace place = place_at(mesh, point);
  if (place.skin < 0) return;
  YarnStrands strands = strands_of(mesh, place.skin);
  if (point.hair >= 0) strands.count = 0;
  const auto change =
      strand_change(strands, static_cast<double>(place.around), static_cast<double>(place.along));
  // Strands lie on the outside of a translucent wall; its colour is that of both sides.
  const bool inside = point.back && !mesh.transmission.empty();
  if (strands.count > 0 && !inside) turn_to_strand(change, V3d(point.view), surface.normal, surface.fibre);
  for (int c = 0; c < 3; ++c) surface.albedo[c] = std::clamp(surface.albedo[c] * change.brightness, 0.0, 1.0);
}

}  // namespace selvedge
