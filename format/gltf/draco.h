// Draco: compressed primitives become plain ones, and compressed again.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "format/gltf/document.h"

namespace selvedge {

/// Decodes every primitive that carries KHR_draco_mesh_compression (triangle meshes; ids, component counts
/// and sizes are checked), gives its accessors plain data, and removes the extension from primitives and from
/// the lists. Decoded normals, tangents and weights are made valid again: unit length, sign +-1, sum 1; min
/// and max are taken from the decoded values. Throws the first fault: GLTF_ACCESSOR, GLTF_MALFORMED,
/// FILE_DAMAGED for streams that Draco refuses, FILE_TOO_LARGE for counts far beyond a stream's length.
void expand_draco(GltfDocument& document);

/// Gives primitives their stream back if their vertices and indices still come from one
/// (GltfDocument::original_encoding), and encodes new ones of a document that required Draco: with as many
/// bits for each attribute as the most precise stream of the file, and for texture coordinates steps of 2^-17
/// or less. Primitives that Draco cannot encode stay plain, with a remark. Throws Failure.
void repack_draco(GltfDocument& document);

struct DracoCounts {
  std::uint64_t faces = 0;
  std::uint64_t points = 0;  ///< connectivity only: seams of attributes add some
};

/// The counts that the header of a mesh claims, sequential or edgebreaker, of bitstream versions 1.x and 2.x;
/// nothing for a damaged header. They are checked before decoding, because Draco allocates what they claim.
std::optional<DracoCounts> draco_counts(std::span<const std::uint8_t> bytes);

}  // namespace selvedge
