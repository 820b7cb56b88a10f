// Writes the seed corpus: small files of every kind, by our own writers. Same program, same bytes.
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <string>

#include "converter/mesh/file.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/atomic_file.h"
#include "format/fabric/file.h"
#include "format/picture/image.h"
#include "format/samples/samples.h"
#include "tests/format/fabric_sides.h"
#include "tests/fuzz/corpus_gltf.h"

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

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void put(const fs::path& path, const std::string& bytes) { checked(write_file(path.string(), bytes)); }

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
      {"rle.exr", {without(test::random_fabric(2, 1, {1, 1}, 1, 5), true, false, 1), {.codec = "rle"}}},
      {"piz.exr", {without(test::random_fabric(4, 4, {1, 1}, 1, 6), false, true, 1), {.codec = "piz"}}},
      {"uncompressed.exr", {test::lambert_fabric(2, 2, {0.5F, 0.5F, 0.5F}), {.codec = "none"}}},
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
  auto writer = checked(SamplesWriter::create((path / name).string(), header));
  const auto texels = static_cast<std::size_t>(header.texels());
  const auto lights = static_cast<std::size_t>(header.lights.count());
  for (int v = 0; v < header.views.count(); ++v) {
    ViewSamples view{std::vector<float>(texels, 0.75F), std::vector<V3f>(texels, V3f(0, 0.6F, 0.8F)),
                     std::vector<V3f>(texels * lights, V3f(0.25F, 0.125F, 0.0625F))};
    checked(writer.write_view(view));
  }
  for (const PairKind kind : all_pair_kinds) {
    PairSamples pairs;
    pairs.pairs = header.pairs[static_cast<std::size_t>(kind)];
    const std::size_t count = pairs.pairs.size() * texels;
    pairs.alpha.assign(count, 0.5F);
    pairs.alpha_noise.assign(count, -0.25F);
    pairs.radiance.assign(count, V3f(1, 2, 3));
    pairs.noise.assign(count, V3f(0.5F, -0.5F, 0));
    checked(writer.write_pairs(kind, pairs));
  }
  checked(writer.commit());
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

void make_stitches(const fs::path& path) {
  put(path / "all-members.json",
      R"({"selvedge_stitch":1,"name":"two","period_mm":[2,1.5],"yarns":[{"name":"wave","radius_mm":0.3,)"
      R"("albedo":[0.5,0.4,0.3],"gloss":0.25,"roughness":0.4,"plies":3,"twist_per_mm":-0.5,"segments":)"
      R"([[[0,0.5,0],[0.4,0.6,0.2],[0.7,0.5,0.3],[1,0.5,0.1]],[[1,0.5,0.1],[1.3,0.5,-0.1],[1.6,0.4,0],)"
      R"([2,0.5,0]]]},{"radius_mm":0.2,"albedo":[0,0,1],"segments":[[[1,0,0.5],[1,0.5,0.5],[1,1,0.5],)"
      R"([1,1.5,0.5]]]}]})");
  put(path / "smallest.json",
      R"({"selvedge_stitch":1,"name":"a","period_mm":[1,1],"yarns":[{"radius_mm":0.25,"albedo":[0,1,0.5],)"
      R"("segments":[[[0,0,0],[0.3,0,0],[0.6,0,0],[1,0,0]]]}]})");
}

void make_charts(const fs::path& path) {
  put(path / "all.txt",
      "# all that a chart has\nname: all\nwale_mm: 4\ncourse_mm: 3\nyarn A: albedo=#aa3322 radius_mm=0.5 "
      "yarn=wool\n"
      "yarn B: albedo=0.1,0.2,0.3 plies=2\n4: k yo k2tog k 2, p2 [A B2 A4]\n3: k7 [B]\n2: p c4f ssk yo\n1: k "
      "7\n");
  put(path / "smallest.txt", "1: k");
}

/// The first byte chooses the reader: 0 OBJ, 1 PLY (mesh_target.cpp).
void put_mesh(const fs::path& path, char format, const std::string& bytes) {
  std::string all(1, format);
  all += bytes;
  put(path, all);
}

void make_meshes(const fs::path& path) {
  CellMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0.5F}, {0, 1, 0}};
  mesh.normals.assign(4, V3f(0, 0, 1));
  mesh.albedo.assign(4, V3f(0.5F, 0.25F, 0.125F));
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const std::string ending : {"obj", "ply"}) {
    const std::string file = (path / ("written." + ending)).string();
    checked(write_mesh(file, mesh));
    put_mesh(file, ending == "obj" ? '0' : '1', bytes_of(file));
  }
  put_mesh(path / "corners.obj", '0',
           "v 0 0 0\nv 1 0 0 1\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\nvt 0 0\nvn 0 0 1\n"
           "f 1/1/1 2/1/1 3/1/1\nf -4 -2 \\\n-1 # joined\n");
  put_mesh(
      path / "ascii.ply", '1',
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty double y\nproperty int z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n3 0 1 2\n");
  put_mesh(path / "garment.ply", '1',
           "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
           "property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n"
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0 0 1 0 0\n"
           "1 0 0 0 0 1 1 0\n1 1 0 0 0 1 1 1\n0 1 0 0 0 1 0 1\n4 0 1 2 3\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_fuzz_corpus FOLDER\n";
    return 2;
  }
  const fs::path root = argv[1];
  make_fabrics(folder(root, "fabric"));
  make_samples(folder(root, "samples"));
  make_stitches(folder(root, "stitch"));
  make_charts(folder(root, "chart"));
  make_meshes(folder(root, "mesh"));
  const std::array<fs::path, 2> garments{folder(root, "gltf"), folder(root, "dress")};
  const std::vector<std::uint8_t> png = checked(encode_png({1, 1, 3, {0.5F, 0.25F, 0.125F}}));
  const fs::path pictures = folder(root, "picture");
  put(pictures / "rgb.png", {png.begin(), png.end()});
  const std::vector<std::uint8_t> grey = checked(encode_png({3, 2, 2, std::vector<float>(12, 0.5F)}));
  put(pictures / "grey-alpha.png", {grey.begin(), grey.end()});
  put(pictures / "short.webp", std::string("RIFF\4\0\0\0", 8));
  put(pictures / "start.jpg", "\xFF\xD8\xFF\xE0");
  for (const auto& [name, bytes] :
       fuzz::gltf_seeds(bytes_of(root / "fabric" / "one-texel.exr"), {png.begin(), png.end()})) {
    for (const fs::path& garment : garments) put(garment / name, bytes);
  }
}
