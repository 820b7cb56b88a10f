// Conversion between layers of a level and pixels of the file's parts, and validation of values.
#pragma once

#include "format/base/error.h"
#include "format/exr/exr.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// A layer of values that belong to no texel: they fill channel after channel.
Layer layer_from_values(const std::vector<float>& values, int texels);

/// The pixels of a layer, planes in the order of channel_names(); zeros if the level does not have the layer.
ExrPixels layer_pixels(const FabricLevel& level, LayerKind kind, const LayerShape& shape);

/// The inverse of layer_pixels(): sets the layer. planes[i]: values of channel i by texel. Products need
/// level.pairs to be set, and keep that many channels.
void set_layer_pixels(FabricLevel& level, LayerKind kind, const LayerShape& shape,
                      const std::vector<const std::vector<float>*>& planes);

/// Makes yarn that can be traced of the layers yarns and indirect, which the level has. FABRIC_MALFORMED, the
/// place being "yarns/node 17", for yarn that validate() refuses; FILE_TOO_LARGE for more than `memory`
/// bytes.
void restore_yarns(FabricLevel& level, const LayerShape& shape, const V2f& period, std::uint64_t memory,
                   IssueSink& sink);

/// Gives yarn, if there is any, the light that comes through.
void restore_light_through(FabricLevel& front, const FabricLevel& through);

/// Adds FABRIC_NOT_FINITE for values of a layer out of range (spec/fabric.md, the table of parts): the first
/// eight with their places, the others as a count. Precondition: the level has the layer, with arrays of the
/// right sizes.
void check_values(const FabricLevel& level, int level_index, LayerKind kind, const LayerShape& shape,
                  IssueSink& sink);

}  // namespace selvedge
