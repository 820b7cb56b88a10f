#include "format/gltf/ply.h"

#include <doctest/doctest.h>

#include <bit>

#include "format/gltf/read_scene.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

/// A square of two triangles or one quad, 2 x 1, with texture coordinates at its vertices.
std::string square(const std::string& u = "s", const std::string& v = "t") {
  return "ply\nformat ascii 1.0\ncomment TextureFile the red.png\nelement vertex 4\nproperty float x\n"
         "property float y\nproperty float z\nproperty uchar red\nproperty float " +
         u + "\nproperty float " + v +
         "\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
         "0 0 0 255 0 0\n2 0 0 255 1 0\n2 1 0 255 1 1\n0 1 0 255 0 1\n4 0 1 2 3\n";
}

/// The same in binary, with texture coordinates at the corners of its faces, of which the second has none.
std::string binary(bool big) {
  std::string text = "ply\r\nformat binary_" + std::string(big ? "big" : "little") +
                     "_endian 1.0\r\nelement vertex 4\r\nproperty double x\r\nproperty double y\r\n"
                     "property double z\r\nproperty float nx\r\nproperty float ny\r\nproperty float nz\r\n"
                     "element face 2\r\nproperty list uchar uint vertex_index\r\n"
                     "property list uchar float texcoord\r\nproperty int texnumber\r\nend_header\r\n";
  const auto put = [&](auto value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i)
      text += static_cast<char>(value >> 8 * (big ? size - 1 - i : i) & 255U);
  };
  const auto real = [&](double value) { put(std::bit_cast<std::uint64_t>(value), 8); };
  const auto single = [&](float value) { put(std::bit_cast<std::uint32_t>(value), 4); };
  for (const auto& [x, y] : {std::pair(0.0, 0.0), {2.0, 0.0}, {2.0, 1.0}, {0.0, 1.0}}) {
    for (const double value : {x, y, 0.0}) real(value);
    for (const float value : {0.0F, 0.0F, 2.0F}) single(value);
  }
  for (const bool with : {true, false}) {
    put(3U, 1);
    for (const std::uint32_t corner : {0U, with ? 1U : 2U, with ? 2U : 3U}) put(corner, 4);
    put(with ? 6U : 0U, 1);
    if (with) {
      for (const float value : {0.0F, 0.0F, 1.0F, 0.0F, 1.0F, 1.0F}) single(value);
    }
    put(0U, 4);
  }
  return text;
}

Error refusal(const std::string& text) { return test::error_of(load_ply(text, "in/g.ply", {})); }

}  // namespace

TEST_CASE("a garment of PLY has the texture coordinates of its vertices, upside down, and its picture") {
  const Folder folder;
  test::write_bytes(folder / "the red.png", "png");
  for (const auto& [u, v] : {std::pair("s", "t"), {"u", "v"}, {"texture_u", "texture_v"}}) {
    test::write_bytes(folder / "g.ply", square(u, v));
    const GltfDocument document = test::need(load_gltf(folder / "g.ply"));
    CHECK(document.json["images"][0]["uri"] == "the%20red.png");
    const Scene scene = test::need(read_scene(document));
    REQUIRE(scene.primitives.size() == 1);
    const ScenePrimitive& p = scene.primitives[0];
    CHECK(p.indices == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
    CHECK(p.positions[2] == V3f(2, 1, 0));
    CHECK(p.tex_coords[0] == std::vector<V2d>{{0, 1}, {1, 1}, {1, 0}, {0, 0}});
    CHECK(p.normals[0] == V3f(0, 0, 1));
    CHECK(scene.materials[p.material].name == "cloth");
    CHECK(scene.materials[p.material].double_sided);
  }
}

TEST_CASE("a garment of binary PLY has the texture coordinates of its faces, and those without apart") {
  for (const bool big : {false, true}) {
    const GltfDocument document = test::need(load_ply(binary(big), "g.ply", {}));
    const Scene scene = test::need(read_scene(document));
    REQUIRE(scene.primitives.size() == 2);
    const bool first = !scene.primitives[0].tex_coords[0].empty();
    const ScenePrimitive& with = scene.primitives[first ? 0 : 1];
    const ScenePrimitive& without = scene.primitives[first ? 1 : 0];
    CHECK(with.tex_coords[0] == std::vector<V2d>{{0, 1}, {1, 1}, {1, 0}});
    CHECK(with.positions == std::vector<V3f>{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}});
    CHECK(with.normals == std::vector<V3f>(3, V3f(0, 0, 1)));
    CHECK(without.tex_coords[0].empty());
    CHECK(without.positions == std::vector<V3f>{{0, 0, 0}, {2, 1, 0}, {0, 1, 0}});
  }
}

TEST_CASE("PLY garments that are damaged, empty or too large are refused in one line") {
  const std::string good = square();
  const std::string whole = binary(false);
  for (std::size_t size = 4; size < whole.size(); ++size) {
    const Error error = refusal(whole.substr(0, size));
    CHECK((error.code == Code::file_damaged || error.code == Code::gltf_malformed));
    CHECK(to_line(error).find('\n') == std::string::npos);
  }
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  CHECK(refusal(with("4 0 1 2 3", "4 0 1 2 4")).code == Code::file_damaged);
  CHECK(refusal(with("4 0 1 2 3", "4 0 1 2 -1")).code == Code::file_damaged);
  CHECK(refusal(with("4 0 1 2 3", "2 0 1")).code == Code::gltf_malformed);
  CHECK(refusal(with("2 1 0 255", "2 1e99 0 255")).code == Code::mesh_not_finite);
  CHECK(refusal(with("255 1 1", "255 nan 1")).code == Code::file_damaged);
  CHECK(refusal(with("element vertex 4", "element vertex 4000000000000")).code == Code::file_damaged);
  CHECK(refusal(with("element face 1", "element hair 1")).code == Code::gltf_malformed);
  CHECK(refusal(with("TextureFile the red.png", "TextureFile ../../a.png")).code == Code::gltf_reference);
  GltfLimits little;
  little.memory = good.size() + 500;
  CHECK(test::error_of(load_ply(good, "g.ply", little)).code == Code::file_too_large);
}
