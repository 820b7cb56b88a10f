#include "viewer/load.h"

#include "format/gltf/access.h"
#include "format/gltf/memory.h"
#include "viewer/scene/fabric_sides.h"

namespace selvedge {

Result<Fabric> load_fabric(FabricReader& reader, MemoryBudget& memory) {
  const FabricHeader& header = reader.header();
  const auto too_large = [&] {
    return tl::unexpected(memory_limit_error(reader.path(), "", "the values of the fabric", memory.limit()));
  };
  reader.set_memory_limit(memory.unspent_bytes());
  if (!memory.try_spend(reader.peak_memory_bytes() + turned_over_bytes(header), 1)) return too_large();
  Result<Fabric> fabric = reader.read();
  if (!fabric) return fabric;
  if (const auto yarns = fabric->levels.front().yarns()) {
    const YarnData& data = yarns->data();
    // Once more for smooth light (yarn_sky.h), and all of it turned over.
    const std::uint64_t sides = header.find_side(Side::back) != nullptr ? 2 : 1;
    const std::uint64_t sky = sizeof(float) * (data.station_light.size() + data.light_through.size());
    if (!memory.try_spend(sides, static_cast<std::uint64_t>(yarn_memory_bytes(data, yarns->period())) + sky))
      return too_large();
  }
  return fabric;
}

Result<LoadedScene> load_scene(const std::string& path, const SceneChoice& choice,
                               const SceneLimits& limits) {
  return load_gltf(path, limits.document).and_then([&](const GltfDocument& document) {
    return load_scene(document, choice, limits);
  });
}

Result<Motion> Motion::load(const std::string& path, const std::string& clip, const SceneChoice& choice,
                            const SceneLimits& limits) {
  Result<GltfDocument> document = load_gltf(path, limits.document);
  if (!document) return tl::unexpected(document.error());
  Motion motion;
  motion.document_ = std::move(*document);
  motion.nodes_ = array_member(motion.document_.json, "nodes");
  motion.animations_ = array_member(motion.document_.json, "animations");
  motion.choice_ = choice;
  motion.limits_ = limits;
  if (auto good = motion.choose(clip); !good) return tl::unexpected(good.error());
  return motion;
}

Result<LoadedScene> load_first_clip(const std::string& path, const SceneLimits& limits,
                                    std::optional<Motion>& motion) {
  motion.reset();
  Result<Motion> first = Motion::load(path, "0", {}, limits);
  if (!first) return load_scene(path, {}, limits);
  motion = std::move(*first);
  return motion->load_scene();
}

std::vector<std::string> Motion::names() const {
  std::vector<std::string> names;
  for (const Json& animation : animations_) {
    const std::string name = string_of(member(animation, "name"));
    names.push_back(name.empty() ? std::to_string(names.size()) : name);
  }
  return names;
}

Result<void> Motion::choose(const std::string& wanted) {
  document_.json["nodes"] = nodes_;
  document_.json["animations"] = animations_;
  const std::uint64_t memory = limits_.document.memory;
  return Clip::read(document_, wanted, memory - std::min(memory, document_.memory_used)).map([&](Clip read) {
    clip_ = std::move(read);
  });
}

Result<LoadedScene> Motion::load_scene() {
  clip_.pose(0, document_);
  Result<LoadedScene> loaded = selvedge::load_scene(document_, choice_, limits_);
  if (!loaded) return loaded;
  std::vector<std::string>& remarks = loaded->scene.remarks;
  remarks.insert(remarks.end(), clip_.remarks().begin(), clip_.remarks().end());
  return loaded;
}

Result<void> Motion::pose(double time, Scene& scene) {
  clip_.pose(time, document_);
  SceneLimits plain = limits_;
  plain.image_bytes = 0;  // the scene has its pictures
  return read_scene(document_, plain, choice_).map([&](Scene posed) {
    scene.primitives = std::move(posed.primitives);
    scene.instances = std::move(posed.instances);
    scene.lights = std::move(posed.lights);
    scene.cameras = std::move(posed.cameras);
  });
}

Result<LoadedScene> load_scene(const GltfDocument& document, const SceneChoice& choice,
                               const SceneLimits& limits) {
  Result<Scene> scene = read_scene(document, limits, choice);
  if (!scene) return tl::unexpected(scene.error());
  Result<MemoryBudget> memory = check_scene_memory(*scene, limits.document.memory);
  if (!memory) return tl::unexpected(memory.error());
  LoadedScene loaded{std::move(*scene), {}, memory->unspent_bytes()};
  std::vector<bool> is_worn(loaded.scene.fabrics.size(), choice.loads_unused_fabrics);
  for (const SceneInstance& instance : loaded.scene.instances) {
    const int material = loaded.scene.primitives[instance.primitive].material;
    if (material >= 0 && loaded.scene.materials[material].fabric)
      is_worn[loaded.scene.materials[material].fabric->fabric] = true;
  }
  std::vector<SceneFabric> present;
  std::vector<int> numbers;  // old -> new
  for (SceneFabric& source : loaded.scene.fabrics) {
    numbers.push_back(-1);
    if (!is_worn[numbers.size() - 1]) continue;
    Result<FabricReader> reader =
        source.path.empty() ? FabricReader::open(source.bytes, source.name) : FabricReader::open(source.path);
    if (!reader && reader.error().code != Code::file_missing) return tl::unexpected(reader.error());
    if (!reader) {
      loaded.scene.remarks.push_back(to_line(reader.error()) + "; the fallback is drawn");
      continue;
    }
    Result<Fabric> fabric = load_fabric(*reader, *memory);
    if (!fabric) return tl::unexpected(fabric.error());
    loaded.fabrics.push_back(std::move(*fabric));
    numbers.back() = static_cast<int>(present.size());
    present.push_back(std::move(source));
  }
  loaded.scene.fabrics = std::move(present);
  loaded.scene.memory_left = memory->unspent_bytes();
  loaded.fabric_memory -= memory->unspent_bytes();
  for (SceneMaterial& material : loaded.scene.materials) {
    if (!material.fabric) continue;
    int& fabric = material.fabric->fabric;
    fabric = numbers[fabric];
    if (fabric < 0) material.fabric.reset();
  }
  return loaded;
}

}  // namespace selvedge
