// glTF -> Scene.
#pragma once

#include <cstdint>
#include <string>

#include "format/error.h"
#include "format/scene.h"

namespace selvedge {

struct SceneLimits {
  /// Of all primitives together, after expansion; no more than unbacked_elements in any case.
  std::size_t vertices = std::size_t{1} << 27;
  std::size_t instances = std::size_t{1} << 20;
  std::uint64_t image_bytes = std::uint64_t{1} << 30;  ///< of all encoded pictures; beyond, they are left out
};

struct GltfDocument;

/// Reads the default scene (else the first, else all root nodes) of a .gltf or .glb file.
///
/// Strips and fans become triangles; points and lines are left out with a remark. A primitive without normals
/// gets flat ones, as glTF asks for: its vertices are no longer shared. Node transforms are kept beside the
/// primitives (SceneInstance); skins, morph targets and animations are not applied (remarked). Pictures that
/// base colours use are loaded; a missing one is remarked and the texture left out. Materials keep their
/// order; scene material -1 is glTF's default one. Fabrics' files are not opened.
///
/// Refused: everything that glTF forbids and that would be read (places are JSON pointers), NaN or infinite
/// positions and texture coordinates, nodes that are their own ancestors or have two parents.
Result<Scene> read_scene(const std::string& path, const SceneLimits& limits = {});

/// The same from a loaded document.
Result<Scene> read_scene(const GltfDocument& document, const SceneLimits& limits = {});

}  // namespace selvedge
