// Writes the seeds that change with our formats: fabrics, samples, and a garment of the folder of seeds,
// dressed.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>

#include "converter/dress/dress.h"
#include "format/fabric/file.h"
#include "format/samples/samples.h"
#include "tests/format/fabric_sides.h"

namespace fs = std::filesystem;
using namespace selvedge;

namespace {

template <class T>
T checked(Result<T> result) {
  if (result) return std::move(*result);
  std::cerr << to_line(result.error()) << "\n";
  std::exit(1);
}

void checked(const Result<void>& result) {
  if (result) return;
  std::cerr << to_line(result.error()) << "\n";
  std::exit(1);
}

fs::path folder(const fs::path& root, const char* name) {
  fs::create_directories(root / name);
  return root / name;
}

/// Only some of the layers, and those on some of the levels.
Fabric without(Fabric fabric, bool table, bool frame, std::size_t levels) {
  fabric.levels.resize(std::min(levels, fabric.levels.size()));
  for (FabricLevel& level : fabric.levels) {
    if (!table) level.remove(LayerKind::table);
    if (!table) level.remove(LayerKind::opacity);
    if (!frame) level.remove(LayerKind::frame);
  }
  return fabric;
}

void make_fabrics(const fs::path& path) {
  const Fabric whole = test::random_fabric(3, 2, {1, 2}, 1, 1);
  Fabric plies = test::with_yarn(test::lambert_fabric(2, 2, {0.5F, 0.5F, 0.5F}), 2);
  plies.levels.front().set_yarns(std::make_shared<const Yarns>(
      test::flattened(test::plied(plies.levels.front().yarns()->data())), plies.period_mm));
  const std::map<std::string, std::pair<Fabric, FabricWriteOptions>> fabrics{
      {"all-layers.exr", {whole, {}}},
      {"sides.exr", {test::four_sides(), {}}},
      {"plies.exr", {plies, {}}},
      {"strands.exr", {test::with_strands(test::with_yarn(test::random_fabric(2, 2, {1, 1}, 1, 7), 3)), {}}},
      {"products.exr", {test::random_product_fabric(2, 1, {1, 2}, 1, 8), {}}},
      {"all-float.exr", {whole, {.half = {}}}},
      {"half-lobes.exr", {test::random_fabric(2, 1, {1, 1}, 1, 2), {.half = LayerSet::all()}}},
      {"lobes-only.exr", {without(test::random_fabric(4, 4, {1, 1}, 2, 3), false, false, 2), {}}},
      {"no-table.exr", {without(test::random_fabric(5, 1, {1, 1}, 1, 4), false, true, 3), {}}},
      {"one-texel.exr", {test::lambert_fabric(1, 1, {0.5F, 0.25F, 0.125F}), {}}},
      {"two-tiles.exr", {without(test::lambert_fabric(33, 3, {0.5F, 0.5F, 0.5F}), false, false, 9), {}}},
  };
  for (const auto& [name, fabric] : fabrics) {
    checked(write_fabric((path / name).string(), fabric.first, fabric.second));
  }
}

void make_samples(const fs::path& path, const std::string& name, const SamplesHeader& header) {
  Samples samples;
  samples.header = header;
  const auto texels = static_cast<std::size_t>(header.texels());
  const auto lights = static_cast<std::size_t>(header.lights.count());
  for (int v = 0; v < header.views.count(); ++v) {
    samples.views.push_back({std::vector<float>(texels, 0.75F), std::vector<V3f>(texels, V3f(0, 0.6F, 0.8F)),
                             std::vector<V3f>(texels * lights, V3f(0.25F, 0.125F, 0.0625F))});
  }
  for (const PairKind kind : all_pair_kinds) {
    PairSamples& pairs = samples.pairs[index_of(kind)];
    pairs.pairs = header.pairs[static_cast<std::size_t>(kind)];
    const std::size_t count = pairs.pairs.size() * texels;
    pairs.alpha.assign(count, 0.5F);
    pairs.alpha_noise.assign(count, -0.25F);
    pairs.radiance.assign(count, V3f(1, 2, 3));
    pairs.noise.assign(count, V3f(0.5F, -0.5F, 0));
  }
  checked(write_samples((path / name).string(), samples));
}

void make_samples(const fs::path& path) {
  SamplesHeader header;
  header.width = 2;
  header.height = 1;
  header.views = {1, 2};
  header.lights = {1, 2};
  make_samples(path, "no-pairs.exr", header);
  for (std::size_t k = 0; k < header.pairs.size(); ++k) header.pairs[k] = random_pairs(2, 0.15, k);
  make_samples(path, "all-pairs.exr", header);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: make_fuzz_corpus SEEDS FOLDER\n";
    return 2;
  }
  const fs::path garment = fs::path(argv[1]) / "gltf" / "textured.glb";
  const fs::path root = argv[2];
  make_fabrics(folder(root, "fabric"));
  make_samples(folder(root, "samples"));
  const fs::path dressed = folder(root, "gltf") / "dressed.glb";
  const fs::path fabric = root / "fabric" / "one-texel.exr";
  checked(dress(garment.string(), fabric.string(), dressed.string(),
                {.all = true, .keep = {.base_color = true}}));
}
