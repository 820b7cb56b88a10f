#include "viewer/load.h"

#include <filesystem>

#include "format/gltf/memory.h"
#include "format/gltf/read_scene.h"

namespace selvedge {

Result<OpenScene> open_scene(const std::string& path, const SceneChoice& choice, const SceneLimits& limits) {
  Result<Scene> scene = read_scene(path, limits, choice);
  if (!scene) return tl::unexpected(scene.error());
  if (const auto good = check_drawable(*scene, limits.document.memory); !good)
    return tl::unexpected(good.error());
  OpenScene open{std::move(*scene), {}, 0};
  std::vector<SceneFabric> present;
  std::vector<int> numbers;  // old -> new
  for (SceneFabric& source : open.scene.fabrics) {
    Result<FabricReader> reader =
        source.path.empty() ? FabricReader::open(source.bytes, source.name) : FabricReader::open(source.path);
    if (!reader && reader.error().code != Code::file_missing) return tl::unexpected(reader.error());
    numbers.push_back(reader ? static_cast<int>(present.size()) : -1);
    if (!reader) {
      open.scene.remarks.push_back(to_line(reader.error()) + "; the fallback is drawn");
      continue;
    }
    open.readers.push_back(std::move(*reader));
    std::error_code unknown;
    open.file_bytes +=
        source.path.empty() ? source.bytes.size() : std::filesystem::file_size(source.path, unknown);
    present.push_back(std::move(source));
  }
  open.scene.fabrics = std::move(present);
  for (SceneMaterial& material : open.scene.materials) {
    if (!material.fabric) continue;
    int& fabric = material.fabric->fabric;
    fabric = numbers[fabric];
    if (fabric < 0) material.fabric.reset();
  }
  return open;
}

Result<std::vector<Fabric>> read_fabrics(OpenScene& open, std::span<const LevelRange> ranges) {
  std::vector<Fabric> fabrics;
  for (std::size_t i = 0; i < open.readers.size(); ++i) {
    FabricReader& reader = open.readers[i];
    const FabricHeader& header = reader.header();
    const LevelRange range = ranges.empty() ? LevelRange{0, header.levels - 1} : ranges[i];
    Fabric fabric = partial_fabric(header, range.first, range.last);
    for (int k = range.first; k <= range.last; ++k) {
      Result<FabricLevel> level = reader.read_level(k);
      if (!level) return tl::unexpected(level.error());
      fabric.levels.push_back(std::move(*level));
    }
    fabrics.push_back(std::move(fabric));
  }
  return fabrics;
}

std::uint64_t bytes_read(const OpenScene& open) {
  std::uint64_t sum = 0;
  for (const FabricReader& reader : open.readers) sum += reader.bytes_read();
  return sum;
}

Result<LoadedScene> load_scene(const std::string& path) {
  Result<OpenScene> open = open_scene(path);
  if (!open) return tl::unexpected(open.error());
  Result<std::vector<Fabric>> fabrics = read_fabrics(*open);
  if (!fabrics) return tl::unexpected(fabrics.error());
  return LoadedScene{std::move(open->scene), std::move(*fabrics)};
}

}  // namespace selvedge
