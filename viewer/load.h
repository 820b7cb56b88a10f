// Garments and their fabrics from disk, as much of them as is asked for.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "format/fabric/file.h"
#include "format/gltf/read_scene.h"
#include "format/scene/level_bounds.h"
#include "format/scene/scene.h"

namespace selvedge {

/// A scene whose fabrics are open, but not read.
struct OpenScene {
  Scene scene;
  std::vector<FabricReader> readers;  ///< of Scene::fabrics; they use the bytes that the scene holds
  std::uint64_t file_bytes = 0;       ///< of all fabric files
};

/// A glTF file and the headers of its fabrics. Materials whose fabric file is not there are left to their
/// core parameters, with a remark; what is there and broken is an error, as those of read_scene() are.
Result<OpenScene> open_scene(const std::string& path, const SceneChoice& choice = {});

/// The levels ranges[i] of fabric i, whose level 0 is then the first of them, with the layers that a picture
/// depends on (seen_layers()); everything where `ranges` is empty.
Result<std::vector<Fabric>> read_fabrics(OpenScene& open, std::span<const LevelRange> ranges = {});

/// A level without lobes looks the same whatever its texels' own frames are.
LayerSet seen_layers(const FabricHeader& header, int level);

/// Bytes of the fabric files that were read so far.
std::uint64_t bytes_read(const OpenScene& open);

struct LoadedScene {
  Scene scene;
  std::vector<Fabric> fabrics;  ///< those of Scene::fabrics
};

/// All of it.
Result<LoadedScene> load_scene(const std::string& path);

}  // namespace selvedge
