// Pictures in WebP, which textures name by EXT_texture_webp.
#include <doctest/doctest.h>

#include "format/gltf/read_scene.h"
#include "format/picture/image.h"
#include "format/picture/picture_type.h"
#include "tests/converter/workshop.h"
#include "tests/format/raw_glb.h"
#include "tests/require.h"

using namespace selvedge;
using test::Workshop;

namespace {

/// 3 x 2 pixels, of which the lossless one has red, half of green, blue; nothing, dark, brown: written
/// by libwebp (npm sharp) as a lossless picture, a lossy one, and a canvas with alpha.
constexpr const char* pictures[] = {
    "UklGRkoAAABXRUJQVlA4TD0AAAAvAkAAEC9AkG1TiXndX+YaZNI27Vv/emZtYhpiOrj1b4lA0mZLvjd/"
    "4DucJavaBArZRoBD9wKdwkX0P4YX"
    "AA==",
    "UklGRmoAAABXRUJQVlA4IF4AAABwAgCdASoDAAIAAMASJagCdLoAD1APxANCle7AAP7Sv2/t/saf9Rp/+Z/pXtH/"
    "7+uZg0vz3OPgAlrWh4//"
    "nMf+xlv1c/ub/+8Z/1d/uMt+rn9zf/Qj8tvxt+VO9+AA",
    "UklGRogAAABXRUJQVlA4WAoAAAAQAAAAAgAAAQAAQUxQSAcAAAAA/4D/AP//"
    "AFZQOCBaAAAA8AEAnQEqAwACAADAEiWoAnS6AAMJBv3sAP78"
    "dr/+P+DJz/6XL3sk40P+/0RPvW0WiV3dwDT/89//2Mt+rn9zf/3ZP/cP9xlv1c/ub/7F3+LTM+O/wPZr4XAA"};

}  // namespace

TEST_CASE("dress: pictures in WebP are read, kept as a print, and pass through as they are") {
  for (const char* picture : pictures) {
    Workshop workshop;
    workshop.edit([&](Json& json) {
      json["extensionsUsed"] = {"EXT_texture_webp"};
      json["extensionsRequired"] = {"EXT_texture_webp"};
      json["images"] = Json::array({Json{{"uri", std::string("data:image/webp;base64,") + picture}}});
      json["textures"] = Json::array({Json{{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}}});
      json["materials"][0]["pbrMetallicRoughness"] = {{"baseColorTexture", {{"index", 0}}}};
    });
    const Scene scene = test::need(read_scene(workshop.garment));
    CHECK(scene.remarks.empty());
    const SceneImage& encoded = scene.images.at(scene.materials[0].base_color_texture.image);
    CHECK(picture_size(encoded.bytes) == Imath::Vec2<std::int64_t>(3, 2));
    const Image image = test::need(decode_image(encoded.bytes, "webp", Transfer::keep));
    REQUIRE(image.pixels.size() == 24);
    if (picture == pictures[0]) {
      const std::vector<int> expected{255, 0, 0, 255, 0,  255, 0,  128, 0,   0,   255, 255,
                                      0,   0, 0, 0,   10, 20,  30, 255, 200, 100, 50,  255};
      for (std::size_t i = 0; i < expected.size(); ++i)
        CHECK(image.pixels[i] * 255 == doctest::Approx(expected[i]));
    }
    CHECK(test::error_of(decode_image(encoded.bytes, "webp", Transfer::keep, {.pixels = 5})).code ==
          Code::file_too_large);
    REQUIRE(workshop.dress({.all_cloth = true, .color_options = {.keeps_base_color = true}}));
    const Scene dressed = test::need(read_scene(workshop.output));
    CHECK(dressed.images.at(dressed.materials[0].base_color_texture.image).bytes == encoded.bytes);
  }
}
