#include "converter/light/fibre_noise.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "converter/mesh/yarn_noise.h"

namespace selvedge {
namespace {

// Root mean squares, but for the first; by eye, against traced fibres.
constexpr double roundness = 0.5;  ///< slope of the surface at a strand's edges
constexpr double tilt = 0.22;      ///< slope across the fibre
constexpr double lift = 0.12;      ///< slope along the fibre
constexpr double sway = 0.16;      ///< turn of the fibre in the surface, radians
constexpr double shade = 0.12;     ///< relative change of the albedo
constexpr double min_cosine = 0.05;

// Independent rows of noise.
constexpr std::uint64_t stream_strands = 21;
constexpr std::uint64_t stream_colour = 25;

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
  if (mesh.places.empty() || point.hair >= 0 || point.view == V3f(0, 0, 0)) return;
  const YarnPlace place = place_at(mesh, point);
  if (place.skin < 0) return;
  const YarnSkin& skin = mesh.skins[place.skin];
  const std::uint64_t seed = mix(mesh.seed ^ mix(static_cast<std::uint64_t>(place.skin)));
  const auto along = static_cast<double>(place.along);
  double brightness = 1;
  if (skin.irregularity > 0) {
    brightness +=
        static_cast<double>(skin.irregularity) *
        closed_noise(seed, static_cast<std::int64_t>(stream_colour), skin.swells, along * skin.swells);
  }
  // Strands lie on the outside of a translucent wall; its colour is that of both sides.
  const bool inside = point.back && !mesh.transmission.empty();
  if (skin.strands > 0) {
    const double strand = (static_cast<double>(place.around) - skin.lays * along) * skin.strands;
    const double first = std::floor(strand);
    const auto index = static_cast<std::int64_t>(first - std::floor(first / skin.strands) * skin.strands);
    // Pieces of neighbouring strands begin at different places.
    const double piece = along * skin.pieces + lattice_noise(seed, index, -1);
    const auto noise = [&](std::uint64_t row) {
      return closed_noise(seed ^ mix(stream_strands + row), index, skin.pieces, piece);
    };
    const V3d across = surface.normal.cross(surface.fibre);
    const double slope = roundness * (2 * (strand - first) - 1) + tilt * noise(0);
    V3d normal = (surface.normal + across * slope + surface.fibre * (lift * noise(1))).normalized();
    const V3d view(point.view);
    const double cosine = normal.dot(view);
    if (cosine < min_cosine) normal = (normal + view * (min_cosine - cosine)).normalized();
    const V3d fibre = surface.fibre + across * (sway * noise(2));
    if (!inside) {
      surface.normal = normal;
      surface.fibre = (fibre - normal * fibre.dot(normal)).normalized();
    }
    brightness *= 1 + shade * noise(3);
  }
  for (int c = 0; c < 3; ++c) surface.albedo[c] = std::clamp(surface.albedo[c] * brightness, 0.0, 1.0);
}

}  // namespace selvedge
