// Samples of yarn by the splatter of cell images (format/cells/cell_image.h), which shows it near by: pieces
// are seen once a view, shadows cast once a light, and what is seen is shaded for all lights.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "converter/bake/texels.h"
#include "converter/mesh/yarn_cell.h"
#include "format/simd/group.h"

namespace selvedge {

/// Points of each texel that the sampler takes if `samples` are wanted: a square, 36 at least (16 of many
/// texels).
int points_of_texel(const V2i& texels, int samples);

class YarnSampler {
 public:
  /// `lit`: the yarn with its light. `plane`: SamplesHeader::reference_height. Texels of one repeat.
  YarnSampler(const YarnData& lit, const YarnCell& cell, float plane, const V2i& texels, bool both_sides);
  ~YarnSampler();

  /// Samples of all texels with `samples` points each (points_of_texel()); from behind where view.z < 0.
  /// Points on the two colours of a chequerboard are the halves of which NoiseSum tells.
  ViewSamples view(const V3f& view, std::span<const V3f> lights, int samples, NoiseSum& noise) const;
  PairSamples pair(const DirectionPair& pair, int samples, NoiseSum& noise) const;

 private:
  struct SideOfYarn;
  /// Sums over the points of one colour, over the number of all points.
  struct Half {
    std::vector<float> alpha;   ///< [texel]
    std::vector<V3f> radiance;  ///< [light * texels + texel], times opacity
  };
  std::array<Half, 2> halves(const V3f& view, std::span<const V3f> lights, int samples,
                             std::vector<V3f>* normals) const;
  /// Adds the points of one light to its radiance, which begins at `begin`, and to the opacity.
  void add_points(std::span<const Group> raw, int points, std::size_t begin, bool opacity,
                  std::array<Half, 2>& halves) const;

  std::vector<std::unique_ptr<SideOfYarn>> sides_;  ///< the face, and the back turned over
  V2i texels_;
};

}  // namespace selvedge
