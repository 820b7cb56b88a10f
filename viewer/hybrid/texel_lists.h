// The texels under sixteen pixels, with their weights (format/scene/footprint.h): the last step of the index
// pass.
#pragma once

#include "viewer/hybrid/index_pass.h"

namespace selvedge {

/// What a pixel shows of its fabric.
struct TexelInputs {
  alignas(64) LaneFloats u;  ///< of its centre, in [0, 1]
  alignas(64) LaneFloats v;
  alignas(64) LaneFloats lower;   ///< the finer of its two levels in the file
  alignas(64) LaneFloats upper;   ///< the coarser
  alignas(64) LaneFloats weight;  ///< of the coarser
  alignas(64) LaneFloats size;    ///< pixel_size() in texels of level 0 of the whole fabric
  alignas(64) LaneFloats width;   ///< of level 0 of the whole fabric
  alignas(64) LaneFloats height;
  alignas(64) LaneFloats counts;  ///< weight of texels: 0 without a fabric, less than 1 beside yarn
};

/// Fills the block's texels. The block has the changes of texture coordinates.
void list_texels(const TexelInputs& inputs, const LevelOptions& options, PixelBlock& block);

}  // namespace selvedge
