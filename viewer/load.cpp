#include "viewer/load.h"

#include <filesystem>

#include "format/gltf/memory.h"
#include "format/gltf/read_scene.h"
#include "viewer/scene/packed_fabric.h"

namespace selvedge {

Result<OpenScene> open_scene(const std::string& path, const SceneChoice& choice, const SceneLimits& limits) {
  Result<Scene> scene = read_scene(path, limits, choice);
  if (!scene) return tl::unexpected(scene.error());
  const Result<MemoryAccount> memory = check_drawable(*scene, limits.document.memory);
  if (!memory) return tl::unexpected(memory.error());
  OpenScene open{std::move(*scene), {}, 0, *memory};
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

Result<Fabric> read_levels_within(FabricReader& reader, const LevelRange& range, MemoryAccount& memory) {
  const FabricHeader& header = reader.header();
  const auto take = [&](std::uint64_t bytes) -> Result<void> {
    if (memory.take(bytes, 1)) return {};
    return tl::unexpected(beyond_memory(
        reader.name(), "", "the values of " + levels_text(range.first, range.last), memory.limit()));
  };
  reader.allow_memory(memory.left());
  if (auto good = take(reader.memory_of(range.first, range.last) + packed_memory(header, range)); !good)
    return tl::unexpected(good.error());
  Result<Fabric> fabric = reader.read_levels(range.first, range.last);
  if (!fabric) return fabric;
  if (const auto yarns = fabric->levels.front().yarns()) {
    const YarnData& data = yarns->data();
    // Once more for smooth light (yarn_sky.h), and all of it turned over.
    const std::uint64_t sides = header.side_of(Side::back) != nullptr ? 2 : 1;
    const std::uint64_t sky = sizeof(float) * (data.light.size() + data.through.size());
    if (auto good = take(sides * (static_cast<std::uint64_t>(memory_of(data, yarns->period())) + sky)); !good)
      return tl::unexpected(good.error());
  }
  return fabric;
}

Result<std::vector<Fabric>> read_fabrics(OpenScene& open, std::span<const LevelRange> ranges) {
  std::vector<Fabric> fabrics;
  for (std::size_t i = 0; i < open.readers.size(); ++i) {
    FabricReader& reader = open.readers[i];
    const LevelRange range = ranges.empty() ? LevelRange{0, reader.header().levels - 1} : ranges[i];
    Result<Fabric> fabric = read_levels_within(reader, range, open.memory);
    if (!fabric) return tl::unexpected(fabric.error());
    fabrics.push_back(std::move(*fabric));
  }
  return fabrics;
}

std::uint64_t bytes_read(const OpenScene& open) {
  std::uint64_t sum = 0;
  for (const FabricReader& reader : open.readers) sum += reader.bytes_read();
  return sum;
}

}  // namespace selvedge
