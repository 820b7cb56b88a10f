// Compressed garments, dressed: the sizes that they have, and that unwrapped ones are what plain ones would
// be.
#include <doctest/doctest.h>

#include <array>
#include <filesystem>

#include "converter/dress/dress.h"
#include "format/gltf/read_scene.h"
#include "tests/converter/workshop.h"
#include "tests/format/encoded_cloths.h"
#include "tests/format/raw_glb.h"
#include "tests/require.h"

using namespace selvedge;
using test::RawGlb;
using test::Workshop;
namespace fs = std::filesystem;

namespace {

/// Means over the corners of all triangles: of positions, texture coordinates, and their products, each of
/// which notices corners that got the values of others; and the number of triangles.
std::vector<double> moments(const std::string& path) {
  const Scene scene = test::need(read_scene(path));
  std::vector<double> sums(11, 0);
  double corners = 0;
  for (const ScenePrimitive& primitive : scene.primitives) {
    for (const std::uint32_t i : primitive.indices) {
      const V3d p(primitive.positions[i]);
      const V2d uv = primitive.tex_coords[0][i];
      const std::array<double, 11> terms{
          p.x, p.y, p.z, uv.x, uv.y, p.x * uv.x, p.y * uv.x, p.z * uv.x, p.x * uv.y, p.y * uv.y, p.z * uv.y};
      for (std::size_t k = 0; k < terms.size(); ++k) sums[k] += terms[k];
      ++corners;
    }
  }
  for (double& sum : sums) sum /= corners;
  sums.push_back(corners / 3);
  return sums;
}

/// Bytes of the fabric and of the pictures that a dressed file has and its garment had not.
std::size_t added_bytes(const RawGlb& dressed, const RawGlb& garment) {
  const auto bytes_of = [](const RawGlb& file) {
    std::size_t sum = 0;
    const Json& extension = member(member(file.json, "extensions"), names::gltf::fabric_extension);
    for (const Json& list :
         {array_member(file.json, "images"), array_member(extension, names::gltf::fabrics)})
      for (const Json& entry : list)
        sum +=
            file.json["bufferViews"][entry["bufferView"].get<std::size_t>()]["byteLength"].get<std::size_t>();
    return sum;
  };
  return bytes_of(dressed) - bytes_of(garment);
}

}  // namespace

TEST_CASE("dress: compressed in, compressed out") {
  constexpr std::size_t json = 3072;  // materials, textures and samplers of the fallback
  for (const std::string& prefix : test::encoded_cloths()) {
    for (const std::string encoding :
         {"draco_edgebreaker", "draco_sequential", "meshopt_high", "meshopt_medium", "quantized", "plain"}) {
      Workshop workshop;
      workshop.garment = prefix + encoding + ".glb";
      CAPTURE(workshop.garment);
      const RawGlb before(workshop.garment);
      const auto size = static_cast<double>(fs::file_size(workshop.garment));
      const auto grown = [&] {
        const std::size_t added = json + added_bytes(RawGlb(workshop.output), before);
        return (static_cast<double>(fs::file_size(workshop.output)) - static_cast<double>(added)) / size;
      };
      REQUIRE(workshop.dress({.all_cloth = true}));
      CHECK(grown() < 1.1);
      CHECK(RawGlb(workshop.output).streams() == before.streams());
      CHECK(moments(workshop.output) == moments(workshop.garment));

      REQUIRE(workshop.dress({.all_cloth = true, .unwrap = Unwrapping::always}));
      CHECK(grown() < 1.6);
      CHECK(RawGlb(workshop.output).streams().empty() == before.streams().empty());
      const std::vector<double> packed = moments(workshop.output);
      // The same garment without an encoding to return to.
      GltfDocument document = test::need(load_gltf(workshop.garment));
      document.original_encoding = {};
      workshop.garment = workshop.folder / "plain.glb";
      REQUIRE(save_gltf(document, workshop.garment));
      REQUIRE(workshop.dress({.all_cloth = true, .unwrap = Unwrapping::always}));
      const std::vector<double> plain = moments(workshop.output);
      for (std::size_t k = 0; k < plain.size(); ++k) {
        CAPTURE(k);
        CHECK(packed[k] == doctest::Approx(plain[k]).epsilon(1e-4));
      }
    }
  }
}

TEST_CASE("dress: a backing is compressed as its garment, which keeps its streams") {
  for (const std::string encoding : {"draco_edgebreaker", "meshopt_high"}) {
    Workshop workshop;
    workshop.garment = test::encoded_cloths()[0] + encoding + ".glb";
    const std::vector<std::string> before = RawGlb(workshop.garment).streams();
    REQUIRE(workshop.dress({.all_cloth = true, .backing = V3f(0, 0, 0)}));
    std::vector<std::string> after = RawGlb(workshop.output).streams();
    CHECK(after.size() == before.size() + 1);
    after.resize(before.size());
    CHECK(after == before);
    CHECK(test::need(read_scene(workshop.output)).primitives.size() == 2);
  }
}
