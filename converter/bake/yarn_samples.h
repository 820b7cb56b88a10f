// Samples of yarn by the splatter of cell images (format/cells/cell_image.h), which shows it near by: pieces
// are seen once a view, shadows cast once a light, and what is seen is shaded for all lights.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "converter/bake/texels.h"
#include "converter/mesh/cell_mesh.h"
#include "format/base/scratch_pool.h"
#include "format/cells/cell_shadows.h"

namespace selvedge {

/// Points of each texel that the sampler takes if `samples` are wanted: a square, 36 at least (16 of many
/// texels).
int points_per_texel(const V2i& texels, int samples);

class YarnSampler {
 public:
  /// `lit`: the yarn with its light. `plane`: SamplesHeader::reference_height. Texels of one repeat.
  YarnSampler(YarnData lit, const YarnCell& cell, float plane, const V2i& texels, bool both_sides);
  ~YarnSampler();

  /// Samples of all texels with `samples` points each (points_per_texel()); from behind where view.z < 0.
  /// Noise is the difference of the points' two halves, which lie as the two colours of a checkerboard.
  ViewSamples sample_view(const V3f& view, std::span<const V3f> lights, int samples, NoiseSum& noise) const;
  PairSamples sample_pair(const DirectionPair& pair, int samples, NoiseSum& noise) const;
  /// The yarn as it was given; ends the sampling.
  YarnData take_yarn();

 private:
  struct SideOfYarn;
  struct Scratch;
  /// Fills scratch.halves.
  void sample(const V3f& direction, std::span<const V3f> lights, int samples, CellShadows& shadows,
              std::vector<V3f>* normals, Scratch& scratch) const;
  /// Adds the points of `count` of the `lights`, from `first` on, to the halves.
  void add_points(int points, std::size_t lights, std::size_t first, std::size_t count,
                  Scratch& scratch) const;

  std::vector<YarnHairs> hairs_;                    ///< of the curves as they were given
  std::vector<std::unique_ptr<SideOfYarn>> sides_;  ///< the face, and the back turned over
  V2i texels_;
  mutable ScratchPool<Scratch> scratch_;
};

}  // namespace selvedge
