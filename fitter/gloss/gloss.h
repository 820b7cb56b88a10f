// Gloss of slabs: a factor on the tables of a level's entries,
//
//   f(l, v) = g(l', v') F(entry, l, v),   g = max(0, l'_z) (rho + sum_j size_j max(0, d_j . (l' * v'))^n_j ),
//
// with one g for every kind of texel. Few kinds take few bytes, and the texels of a kind together determine
// how their tables change with the view.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fitter/lobes/lobe_moments.h"
#include "fitter/slabs/slab_tables.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// The grids of a level's samples.
struct GlossDirections {
  std::vector<V3d> views;
  std::vector<V3d> lights;
  std::size_t count() const { return views.size() * lights.size() * 3; }  ///< values of a g
};

GlossDirections gloss_directions(const DirectionGrid& views, const DirectionGrid& lights);

struct GlossKind {
  V3d normal{0, 0, 1};   ///< unit
  V3d tangent{1, 0, 0};  ///< unit, perpendicular to it
  std::array<double, 3> rho{1, 1, 1};
  std::vector<LobeShape> shapes;  ///< of all channels; max |d| = 1
  std::vector<double> sizes;      ///< of the lobes, >= 0
};

struct SlabGloss {
  std::vector<GlossKind> kinds;
  std::vector<std::uint16_t> kind_of;  ///< [texel]
  /// [3 light + channel]: units in which g is of the order of 1; tables are fitted in their inverse.
  std::vector<float> unit;
};

/// g of a kind over its units: [view][3 light + channel].
std::vector<double> gloss_values(const GlossKind& kind, const GlossDirections& directions,
                                 const std::vector<float>& unit);

/// Scales g to a root mean square of 1 over all texels, and sets the units so that g in these units has a
/// root mean square of 1 over texels and views for every light and channel.
void normalise(SlabGloss& gloss, const GlossDirections& directions);

/// The gloss as factors for fit_slabs().
SlabFactors factors_of(const SlabGloss& gloss, const GlossDirections& directions);

/// Sets the layers lobes and frame of a level.
void set_gloss(const SlabGloss& gloss, FabricLevel& level);

}  // namespace selvedge
