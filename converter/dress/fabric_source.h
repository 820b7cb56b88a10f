// A fabric file on disk as the source of a glTF's reference or embedded fabric, and what edits of garments
// have in common.
#pragma once

#include <string>

#include "format/base/guard.h"
#include "format/base/json_text.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/materials.h"

namespace selvedge {

/// The fabric at `fabric_path` for a glTF at `output_path`: with `embed` its bytes, else its URI relative to
/// the output's folder. The name is the file's without its last ending. Refuses an output that is the fabric
/// itself. Does not check that the file is a fabric.
Result<FabricSource> source_of(const std::string& fabric_path, const std::string& output_path, bool embed);

/// One line for each file that a document, moved to its output's folder, names outside of it: readers of the
/// output refuse those. Buffers and the pictures of a .glb, which are still to be written into it, are left
/// out.
std::vector<std::string> outside_warnings(const GltfDocument& document, const std::string& output_path);

/// Loads a garment and moves it to the output's folder, so that the URIs of all fabrics are relative to that.
/// Throws Failure.
GltfDocument load_garment(const std::string& path, const std::string& output_path, const GltfLimits& limits);

/// Returns the primitive at a place, and its JSON pointer.
Json& primitive_at(GltfDocument& document, const PrimitiveIndex& place);
std::string member_pointer(const PrimitiveIndex& place);

/// Appends an accessor of vectors of any component type; normalized ones are signed and stand for -1 to 1.
/// `shape.count` is ignored.
int append_accessor(GltfDocument& document, std::span<const float> values, AccessorShape shape);

/// As catch_failure(); GLTF_MALFORMED of the garment for a wrong JSON type in an unchecked part of it.
template <class Work>
auto result_of_edit(const std::string& garment_path, const Work& work) -> decltype(catch_failure(work)) {
  try {
    return catch_failure(work);
  } catch (const nlohmann::json::exception& error) {
    return fail(Code::gltf_malformed, garment_path, "", exception_message(error));
  }
}

}  // namespace selvedge
