// A level's layers as the pixels of the file's parts and back, and the check of their values.
#pragma once

#include "format/base/issue_sink.h"
#include "format/exr/exr.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// Imath's vectors are three floats without padding.
inline std::span<const float> floats_of(std::span<const V3f> vectors) {
  static_assert(sizeof(V3f) == 3 * sizeof(float));
  return {reinterpret_cast<const float*>(vectors.data()), vectors.size() * 3};
}

/// The pixels of a layer, planes in the order of channel_names(); zeros where the level does not have it.
ExrPixels pixels_of(const FabricLevel& level, LayerKind kind, const LayerShape& shape);

/// The inverse: gives the level that layer. planes[i]: the texels' values of channel i. Of products the level
/// has its pairs already, and `entries` of each are kept in every texel.
void set_pixels(FabricLevel& level, LayerKind kind, const LayerShape& shape,
                const std::vector<const std::vector<float>*>& planes, int entries = 1);

/// The place of a value: "table/level 2/table.0003.red/5,7".
std::string place_of(LayerKind kind, int level, const std::string& channel, std::size_t texel, int width);

/// Adds FABRIC_NOT_FINITE for every value of a layer that is out of its range (spec/fabric.md, the table of
/// parts). The first eight are named, the rest is counted. Precondition: the level has the layer, and arrays
/// of the right sizes.
void check_values(const FabricLevel& level, int level_index, LayerKind kind, const LayerShape& shape,
                  IssueSink& sink);

}  // namespace selvedge
