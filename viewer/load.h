// Reads scenes with their fabrics.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "format/fabric/file.h"
#include "format/gltf/clip.h"
#include "format/gltf/read_scene.h"
#include "format/scene/scene.h"

namespace selvedge {

struct LoadedScene {
  Scene scene;                      ///< its memory_left is without the fabrics
  std::vector<Fabric> fabrics;      ///< of Scene::fabrics
  std::uint64_t fabric_memory = 0;  ///< bytes that the fabrics take at most, decoded and turned over
};

/// Reads a glTF file and its fabrics. Materials whose fabric file is missing keep their core parameters, with
/// a remark; a broken file is an error. FILE_TOO_LARGE for fabrics that take more than the limits' memory,
/// reading and drawing. Also the errors of read_scene().
Result<LoadedScene> load_scene(const std::string& path, const SceneChoice& choice = {},
                               const SceneLimits& limits = {});

/// The same from a loaded document.
Result<LoadedScene> load_scene(const GltfDocument& document, const SceneChoice& choice,
                               const SceneLimits& limits);

/// A document that one of its clips moves.
class Motion {
 public:
  /// Errors as load_gltf() and Clip::read().
  static Result<Motion> load(const std::string& path, const std::string& clip, const SceneChoice& choice,
                             const SceneLimits& limits);

  const Clip& clip() const { return clip_; }
  std::vector<std::string> names() const;  ///< of all clips
  /// Another clip, by its name or number. Errors as Clip::read(); the clip before stays.
  Result<void> choose(const std::string& wanted);
  /// The scene at the beginning of the clip, with its fabrics.
  Result<LoadedScene> load_scene();
  /// Gives a scene that was loaded from the document the vertices, instances, lights and cameras of a time,
  /// s.
  Result<void> pose(double time, Scene& scene);

 private:
  GltfDocument document_;  ///< posed
  Json nodes_, animations_;
  Clip clip_;
  SceneChoice choice_;
  SceneLimits limits_;
};

/// Reads a glTF file as it begins its first clip, which `motion` plays; without one that can be read at rest,
/// and without `motion`. Errors as load_scene().
Result<LoadedScene> load_first_clip(const std::string& path, const SceneLimits& limits,
                                    std::optional<Motion>& motion);

/// Reads a fabric that can also be drawn within `memory`.
Result<Fabric> load_fabric(FabricReader& reader, MemoryBudget& memory);

}  // namespace selvedge
