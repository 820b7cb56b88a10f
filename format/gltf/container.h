// The outermost layer of a glTF file: the chunks of a GLB, the JSON text, and the bytes of the buffers.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/base/issue_sink.h"
#include "format/gltf/document.h"

namespace selvedge {

struct GltfContainer {
  Json json;  ///< an object
  bool is_glb = false;
  bool has_binary = false;           ///< a binary chunk, which may be empty
  std::vector<std::uint8_t> binary;  ///< its bytes, until a buffer takes them
};

/// Takes a .gltf or .glb file apart, told apart by content; `name` is used in the issues. Everything that is
/// wrong with header, chunks and JSON text is added to `issues`, warnings too; nothing comes back if one of
/// them is an error.
std::optional<GltfContainer> read_container(std::span<const std::uint8_t> bytes, const std::string& name,
                                            const GltfLimits& limits, IssueSink& issues);

/// The bytes of json["buffers"][index], exactly byteLength of them (files and chunks may be longer), or none
/// for a buffer that says nowhere where they are. Takes the container's binary chunk if they are there.
/// `room`: what may still be read; less afterwards.
Result<std::vector<std::uint8_t>> read_buffer(const GltfDocument& document, GltfContainer& container,
                                              int index, std::uint64_t& room);

}  // namespace selvedge
