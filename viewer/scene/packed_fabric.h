// Packs a fabric for the evaluation of many pixels at once: all numbers in groups of four, which are fetched
// for several pixels and transposed to vectors.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "format/fabric/header.h"
#include "format/simd/group.h"

namespace selvedge {

/// The numbers that a level has. Texels of levels with equal layouts can be evaluated together.
struct PackedLayout {
  bool is_flat = false;     ///< neither lobes nor frames: g is the cosine of the light
  int lobes = 0;            ///< without the diffuse term
  bool has_views = false;   ///< T or alpha; if not, both are 1
  bool has_table = false;   ///< T or S: the formula's bracket has a first term
  bool has_lights = false;  ///< S; if not, S = 1
  int products = 0;
  std::vector<V2i> pairs;  ///< of the products
  bool operator==(const PackedLayout&) const = default;
  /// Whether radiance is linear in what texels have (mean_products.h).
  bool is_linear() const { return products > 0 && is_flat && !has_table; }
  /// Groups of a texel: normal and red rho; tangent and green rho; blue rho and padding; then (Cx, Cy, Cz, n)
  /// for [channel][lobe].
  int texel_groups() const { return 3 + 3 * lobes; }
  /// Groups of a texel's coefficients, padded with 0 to whole vectors.
  int coefficient_groups() const { return (products + 15) / 16 * 4; }
};

struct PackedLevel {
  int width = 0;
  int height = 0;
  int layout = 0;                   ///< index into PackedFabric::layouts
  std::vector<Group> texels;        ///< [texel][texel_groups]
  std::vector<Group> views;         ///< [texel][view]: alpha T, alpha; empty if T is 1
  std::vector<float> opacity;       ///< [texel][view]; empty if `views` has it
  std::vector<Group> lights;        ///< [texel][light]: S, 0
  std::vector<Group> coefficients;  ///< [texel][coefficient_groups]
};

/// Below so many pixels a repeat, in the mean of both sides, texels show in place of cell images.
inline constexpr float least_cell_pixels = 2;

struct PackedFabric {
  float largest_cell_pixel = 0;    ///< pixels so wide, in texels of level 0, show cell images; 0: no yarn
  const Fabric* fabric = nullptr;  ///< its source
  std::vector<PackedLevel> levels;
  std::vector<PackedLayout> layouts;
  int view_functions = 0;          ///< phi_a, a > 0
  int light_functions = 0;         ///< psi_b
  int view_stride = 0;             ///< numbers of a row of view_basis, and groups of one of light_basis:
  int light_stride = 0;            ///< padded with 0 to whole vectors
  std::vector<float> view_basis;   ///< [view][a - 1]
  std::vector<Group> light_basis;  ///< [light][b]: psi_b, 0
  /// Response of the psi_b to smooth light (smooth_light.h): [b][function][colour], the cosine included.
  std::vector<float> around_basis;
  std::vector<float> yarn_sky;  ///< sky_of() the yarn; empty without yarn
  bool needs_views = false;     ///< some level looks views up
  bool needs_lights = false;
  /// Lit from behind, by lights mirrored in the plane of the cloth; null: nothing comes through.
  std::shared_ptr<const PackedFabric> through;
  std::shared_ptr<const PackedFabric> turned;  ///< as seen from behind; null: as from in front
  std::shared_ptr<const Fabric> own;           ///< the source, if nobody else has it

  /// The visible side, 1 for the front and -1 for the back.
  const PackedFabric& seen_from(float side) const { return side < 0 && turned ? *turned : *this; }
};

/// Bytes that the fabric of a file takes once more, packed, all sides included.
std::uint64_t packed_memory(const FabricHeader& header);

/// `fabric` must outlive the result. Precondition: validate() holds.
PackedFabric pack(const Fabric& fabric);

}  // namespace selvedge
