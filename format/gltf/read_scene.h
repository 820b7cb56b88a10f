// Reading a glTF file as a Scene.
#pragma once

#include <string>

#include "format/base/error.h"
#include "format/gltf/limits.h"
#include "format/scene/scene.h"

namespace selvedge {

struct GltfDocument;

/// The scene and the variant to read, by name or number; empty: the file's own choice.
struct SceneChoice {
  std::string scene;                 ///< else the default scene, else the first, else all root nodes
  std::string variant;               ///< of KHR_materials_variants; else the primitives' own materials
  bool loads_unused_fabrics = true;  ///< also fabrics that nothing wears are loaded
};

/// Reads a scene of a .gltf or .glb file.
///
/// Strips and fans become triangles; points and lines are left out with a remark. A primitive without normals
/// gets flat ones, as glTF requires: its vertices are no longer shared. Node transforms and copies by
/// EXT_mesh_gpu_instancing are kept beside the primitives (SceneInstance). Morph targets are applied with
/// their default weights, skins as their joints rest; animations are not played (remarked). Pictures that
/// core materials use are loaded; a missing one is remarked and the texture left out. Materials keep their
/// order; scene material -1 is glTF's default one. Fabrics' files are not opened.
///
/// Refused are broken rules of glTF in everything that is read (places are JSON pointers), NaN or infinite
/// numbers in attributes, and nodes that are their own ancestors or have two parents. OPTION_OUT_OF_RANGE for
/// a choice that the file does not have.
Result<Scene> read_scene(const std::string& path, const SceneLimits& limits = {},
                         const SceneChoice& choice = {});

/// The same from a loaded document.
Result<Scene> read_scene(const GltfDocument& document, const SceneLimits& limits = {},
                         const SceneChoice& choice = {});

/// For a checker: reads every node and every mesh, in a scene or not, and adds all errors to `issues`. Broken
/// nodes and meshes are missing in the scene.
Scene read_whole_document(const GltfDocument& document, const SceneLimits& limits, IssueSink& issues);

}  // namespace selvedge
