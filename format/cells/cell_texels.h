// Texels of a fabric's levels, as cell images show them: of fabrics without yarn, and of all from afar.
#pragma once

#include <span>
#include <vector>

#include "format/cells/cell_view.h"
#include "format/fabric/fabric.h"
#include "format/simd/group.h"

namespace selvedge {

/// Below this number of pixels along a repeat, in the mean of both sides, texels show in place of yarn; of
/// yarn with many nodes, which cost their time in each image, also where a pixel shows more than this number.
inline constexpr float min_repeat_pixels = 2;
inline constexpr float max_nodes_per_pixel = 80;

/// The upper half of light from all around as twelve lamps, none below `least`: polynomials of z up to degree
/// 5 have their integrals.
std::vector<CellLamp> lamps_of_smooth_light(const SmoothLight& around, float least);

/// Width of the pixels at which texels take over from the yarn itself, in texels of level 0; 0 without yarn.
float max_yarn_pixel_texels(const Fabric& fabric);

/// For pixels of `pixel` repeats along u and v, or tiles of a map. The finer level has 2 to 4 texels along a
/// pixel. A `forced` level shows alone; -1: none is forced.
CellLevels shown_levels(const Fabric& fabric, const V2f& pixel, int forced);
/// Size of images that show texels alone: samples are the texels of this level.
CellSize texel_cell_size(const Fabric& fabric, const V2f& pixel, int level);

/// One side of a fabric. Immutable: for any number of threads.
class CellTexels {
 public:
  /// `fabric` must outlive the object.
  explicit CellTexels(const Fabric& fabric);

  /// Adds texels by their weights to the samples of an image, [row][column][plane], the lowest row
  /// first: radiance times opacity, and opacity in the first plane.
  void add_to_samples(const CellView& view, std::span<Group> samples) const;

 private:
  /// The fabric, or its side that lets light through.
  struct Layer {
    const Fabric* fabric = nullptr;
    std::vector<float> response;  ///< smooth_response()
  };
  void add_level(const CellView& view, int level, float weight, std::span<Group> samples) const;

  Layer front_, through_;  ///< a null fabric: nothing comes through
};

}  // namespace selvedge
