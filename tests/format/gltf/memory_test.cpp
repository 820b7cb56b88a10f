#include "format/gltf/memory.h"

#include <doctest/doctest.h>

#include "format/check/gltf.h"
#include "format/gltf/read_scene.h"
#include "format/picture/picture_type.h"
#include "tests/format/gltf_square.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;
using test::Square;

namespace {

constexpr std::uint64_t mib = std::uint64_t{1} << 20;

SceneLimits within(std::uint64_t bytes) { return {.document = {.memory = bytes}}; }

std::string png_header(std::uint32_t width, std::uint32_t height) {
  std::string bytes("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16);
  for (const std::uint32_t side : {width, height})
    for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>(side >> shift);
  return bytes;
}

std::uint64_t pixels_of(const std::string& bytes) {
  return picture_pixel_count({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

/// The code of reading, the same as of checking; nothing if both accept it.
std::optional<Code> verdict(const Folder& folder, const Square& square, const SceneLimits& limits) {
  test::write_bytes(folder / "case.glb", test::glb(square.json.dump(), square.bytes));
  const Issues issues = check_gltf(folder / "case.glb", limits);
  const Result<Scene> scene = read_scene(folder / "case.glb", limits);
  const auto drawn = check_scene_memory(scene ? *scene : Scene(), limits.document.memory);
  if (drawn) CHECK(check_texture_memory(*scene, *drawn).has_value());
  CHECK(has_error(issues) == (!scene || !drawn));
  if (scene && drawn) return std::nullopt;
  return scene ? drawn.error().code : scene.error().code;
}

}  // namespace

TEST_CASE("memory: an account is empty once it has been asked for too much, and no product wraps around") {
  MemoryBudget account(100);
  CHECK(account.try_spend(9, 10));
  CHECK(account.try_spend(1 << 30, 0));
  CHECK(account.unspent_bytes() == 10);
  CHECK_FALSE(account.try_spend(11, 1));
  CHECK_FALSE(account.try_spend(1, 1));
  MemoryBudget large(std::uint64_t{1} << 40);
  CHECK_FALSE(large.try_spend(std::uint64_t{1} << 63, 256));
}

TEST_CASE("memory: a picture has the pixels of its header") {
  CHECK(pixels_of(png_header(8000, 8000)) == 64'000'000);
  CHECK(pixels_of(png_header(0xFFFFFFFF, 0xFFFFFFFF)) == 0xFFFFFFFFULL * 0xFFFFFFFFULL);
  CHECK(pixels_of(png_header(0, 7)) == 0);
  const std::string flat = png_header(70, 5);
  const auto sides = picture_size({reinterpret_cast<const std::uint8_t*>(flat.data()), flat.size()});
  CHECK(V2i(sides) == V2i(70, 5));
  const std::string jpeg("\xFF\xD8\xFF\xE0\0\4ab\xFF\xFF\xC4\0\2\xFF\xC2\0\x11\10\3\0\4\0\3", 23);
  CHECK(pixels_of(jpeg) == 0x300 * 0x400);
  for (const std::string& bytes : {png_header(8, 8), jpeg}) {
    for (std::size_t size = 0; size < bytes.size(); ++size) (void)pixels_of(bytes.substr(0, size));
    CHECK(pixels_of(bytes.substr(0, 10)) == 0);
  }
}

TEST_CASE("memory: a garment is refused by what it declares, in its checker as in its reader") {
  const Folder folder;
  CHECK_FALSE(verdict(folder, Square(), {}).has_value());
  CHECK_FALSE(verdict(folder, Square(), within(mib)).has_value());
  CHECK(verdict(folder, Square(), within(1000)) == Code::file_too_large);

  Square pictures;
  pictures.dress();
  const std::string png = png_header(8000, 8000);
  const auto offset = pictures.bytes.size();
  pictures.bytes += png;
  pictures.at("/bufferViews/5") = {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", png.size()}};
  pictures.at("/buffers/0")["byteLength"] = pictures.bytes.size();
  test::write_bytes(folder / "the net.exr", "");
  test::write_bytes(folder / "case.glb", test::glb(pictures.json.dump(), pictures.bytes));
  const Scene scene = test::need(read_scene(folder / "case.glb"));
  // A garment may be drawn from afar that takes more from near.
  const auto whole = [&](std::uint64_t bytes) {
    return check_texture_memory(scene, test::need(check_scene_memory(scene, bytes)));
  };
  CHECK(check_scene_memory(scene, mib).has_value());
  CHECK(whole(2940 * mib).has_value());
  const Error error = test::error_of(whole(2900 * mib));
  CHECK(error.code == Code::file_too_large);
  CHECK(error.message.find("--max-memory") != std::string::npos);

  Square instances;
  instances.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  instances.json["accessors"].push_back(Json::parse(R"({"componentType":5126,"count":1000,"type":"VEC3"})"));
  instances.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = 5;
  CHECK_FALSE(verdict(folder, instances, {}).has_value());
  CHECK(verdict(folder, instances, within(mib)) == Code::file_too_large);

  Square nodes;
  for (int i = 1; i < 1000; ++i) {
    nodes.json["nodes"].push_back({{"mesh", 0}});
    nodes.json["scenes"][0]["nodes"].push_back(i);
  }
  CHECK_FALSE(verdict(folder, nodes, {}).has_value());
  CHECK(verdict(folder, nodes, within(mib)) == Code::file_too_large);

  Square primitives;
  for (int i = 0; i < 2000; ++i)
    primitives.at("/meshes/0/primitives").push_back(Json(primitives.primitive()));
  CHECK(verdict(folder, primitives, within(3 * mib)) == Code::file_too_large);

  Square values;
  values.json["extras"] = std::vector<int>(100'000, 1);
  CHECK_FALSE(verdict(folder, values, within(20 * mib)).has_value());
  CHECK(verdict(folder, values, within(12 * mib)) == Code::file_too_large);
}

TEST_CASE("memory: fabrics that share a view are as many copies") {
  const Folder folder;
  Square square;
  square.dress();
  square.bytes.resize(mib);
  square.at("/buffers/0")["byteLength"] = mib;
  square.json["bufferViews"].push_back({{"buffer", 0}, {"byteLength", mib}});
  Json& fabrics = square.root_fabrics();
  for (int i = 0; i < 40; ++i) fabrics.push_back({{"mimeType", "image/x-exr"}, {"bufferView", 6}});
  test::write_bytes(folder / "case.glb", test::glb(square.json.dump(), square.bytes));
  CHECK(read_scene(folder / "case.glb").has_value());
  CHECK(test::error_of(read_scene(folder / "case.glb", within(20 * mib))).code == Code::file_too_large);
}
