// Opens scenes, and reads those levels of their fabrics that are needed.
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

/// A scene whose fabric files are open, but whose levels are not read.
struct OpenScene {
  Scene scene;
  std::vector<FabricReader> readers;     ///< of Scene::fabrics; they use the bytes that the scene holds
  std::uint64_t file_bytes = 0;          ///< of all fabric files
  MemoryAccount memory{default_memory};  ///< for the levels of the fabrics
};

/// Reads a glTF file and the headers of its fabrics. Materials whose fabric file is missing keep their core
/// parameters, with a remark; a broken one is an error. Other errors are those of read_scene().
Result<OpenScene> open_scene(const std::string& path, const SceneChoice& choice = {},
                             const SceneLimits& limits = {});

/// Reads the levels ranges[i] of fabric i, the first of which becomes its level 0; everything if `ranges` is
/// empty. FILE_TOO_LARGE for levels that take more than OpenScene::memory, reading and drawing.
Result<std::vector<Fabric>> read_fabrics(OpenScene& open, std::span<const LevelRange> ranges = {});

/// Reads levels within `memory`.
Result<Fabric> read_levels_within(FabricReader& reader, const LevelRange& range, MemoryAccount& memory);

/// Bytes of the fabric files that were read so far.
std::uint64_t bytes_read(const OpenScene& open);

}  // namespace selvedge
