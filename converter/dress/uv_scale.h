// Measures a garment in its scene: metres of cloth per unit of its texture coordinates, areas and bounds.
#pragma once

#include <Imath/ImathBox.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "format/gltf/materials.h"
#include "format/scene/scene.h"

namespace selvedge {

struct UvSize {
  V2d metres_per_uv{0, 0};      ///< along u and v, per unit of UV: the medians over the area
  V2d metres_per_uv_p5{0, 0};   ///< a twentieth of the area has less
  V2d metres_per_uv_p95{0, 0};  ///< a twentieth of the area has more
  double stretch_p95 = 1;       ///< what 95 % of the area stay below, in times longer or shorter one way
  double stretched_fraction =
      0;  ///< fraction of the area where cloth is more than max_stretch longer or shorter one way
  double fraction_without_uvs = 0;  ///< fraction of the area whose UVs cover no area
  double unusable_fraction =
      0;               ///< fraction of the area without, or where cloth is more than max_usable_stretch off
  int primitives = 0;  ///< instances with area in space and in UV
};

/// Cloth that is stretched by more than this one way shows it.
constexpr double max_stretch = 1.5;
/// Cloth that is stretched by more than this one way is splinters or streaks.
constexpr double max_usable_stretch = 4;

/// |dP/du| and |dP/dv| over all triangles of the given primitives in world space (with node scales), weighted
/// by area. Medians are robust against slivers with nearly no UV area, which would dominate a mean. Cloth of
/// the median size is stretched where a singular value of dP/d(u, v), in medians, is beyond max_stretch or
/// its inverse. `chosen` holds indices into scene.primitives; sets that are not read cover nothing.
UvSize measure_uv(const Scene& scene, const std::set<int>& chosen, int tex_coord);

/// GARMENT_NO_UVS for each material with a fabric that shows in the scene with UVs that cover no area, as
/// under a node of scale 0: dress() refuses it.
Issues check_uv_areas(const Scene& scene);

/// Triangles that hang together in space and in their texture coordinates. Means are weighted by the area
/// that is seen from where the default camera is (format/scene/framing.h); where none is, by all.
struct UvPart {
  int material = 0;
  Imath::Box2d box;     ///< of its UVs
  V2d middle{0, 0};     ///< UVs, the mean
  double nearness = 0;  ///< m towards the camera, the mean
  double weight = 0;    ///< twice the area that is seen, m^2
};

/// The parts of primitives, whose material and set of texture coordinates are given, each where it is first
/// in the scene; by falling weight, but for the first: the nearest of those that have half of the largest
/// weight, which insides of backs have, too.
std::vector<UvPart> uv_parts(const Scene& scene, const std::map<int, V2i>& materials_and_sets);

/// Bounds of the scene's triangles, metres; empty without triangles.
Imath::Box3d bounds_of(const Scene& scene);

struct GarmentBounds {
  Imath::Box3d box;                                 ///< metres; empty without an area
  std::map<std::string, double> stray_distances{};  ///< primitives, and how far from the rest they lie
};

/// The same of `chosen` primitives (indices into scene.primitives) without strays (format/scene/framing.h).
GarmentBounds robust_bounds(const Scene& scene, const std::set<int>& chosen);

struct PrimitiveInScene {
  double twice_area = 0;  ///< twice the area of its first instance, m^2, as it rests
  V3d down_direction{0, -1,
                     0};  ///< the direction of the mesh's frame that grows towards the ground, of any length
};

using PrimitivesInScene = std::map<PrimitiveIndex, PrimitiveInScene>;

/// How large the primitives of a document are in its scene, and which way they hang.
PrimitivesInScene primitives_in(const Scene& scene);

/// The triangles of a material in the scene, in its own variant.
struct MaterialExtent {
  double twice_area = 0;          ///< twice, m^2
  Imath::Box3d box;               ///< m
  bool is_flat_rectangle = true;  ///< each instance is flat, and a rectangle
};

/// By material, those that show.
std::map<int, MaterialExtent> material_extents(const Scene& scene);

/// The fraction of each material's area that has triangles on its back, in the same place within 2e-4 of the
/// scene's diagonal. Materials without any may be missing.
std::map<int, double> double_layer_fractions(const Scene& scene);

/// Returns for each vertex the sum of its triangles' normals, each as long as twice the area.
std::vector<V3d> normal_sums(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles);

/// Twice the area of the triangles, in the unit of the positions.
double twice_area_of(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles);

}  // namespace selvedge
