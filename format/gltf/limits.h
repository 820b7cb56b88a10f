// Limits of a reader of glTF files for documents that are not trusted.
#pragma once

#include <cstddef>
#include <cstdint>

#include "format/base/memory.h"

namespace selvedge {

/// Files beside a document that it may name by a URI: none (data URIs alone), those in its own folder and
/// below, or any.
enum class ExternalFiles { none, in_folder, anywhere };

/// A file beyond one of these is refused with FILE_TOO_LARGE; nesting with GLTF_MALFORMED.
struct GltfLimits {
  std::uint64_t file_bytes = std::uint64_t{1} << 31;
  std::uint64_t buffer_bytes = std::uint64_t{1} << 32;  ///< of all buffers together
  int nesting = 128;                                    ///< of JSON brackets
  int members = 1024;  ///< of one JSON object, whose members are looked up one after the other
  std::uint64_t memory = default_memory_limit;  ///< of the whole document
  ExternalFiles external_files =
      ExternalFiles::in_folder;  ///< GLTF_REFERENCE for others; GLTF_UNSUPPORTED with `none`
};

struct SceneLimits {
  GltfLimits document;
  /// Vertices of all primitives together, after expansion; no more than max_unbacked_elements in any case.
  std::size_t vertices = std::size_t{1} << 27;
  std::size_t instances = std::size_t{1} << 20;
  std::uint64_t image_bytes = std::uint64_t{1} << 30;  ///< of all encoded pictures; beyond, they are left out
};

}  // namespace selvedge
