// Dressed garments through tinygltf and back: what a program that knows nothing of fabrics leaves of them.
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include "converter/dress/dress.h"
#include "format/base/atomic_file.h"
#include "format/check/gltf.h"
#include "format/fabric/file.h"
#include "format/gltf/document.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/read_scene.h"
#include "tests/converter/fabrics.h"
#include "tests/format/garments.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

/// Reads and writes a document by tinygltf, with pictures as they are; the fault, or nothing.
std::string pass_through_tinygltf(const std::string& from, const std::string& to, bool binary) {
  tinygltf::TinyGLTF tiny;
  tiny.SetImageLoader(
      [](tinygltf::Image* image, const int, std::string*, std::string*, int, int, const unsigned char* bytes,
         int size, void*) {
        image->image.assign(bytes, bytes + size);
        image->as_is = true;
        return true;
      },
      nullptr);
  tinygltf::Model model;
  std::string errors;
  std::string warnings;
  const bool loaded = from.ends_with(".glb") ? tiny.LoadBinaryFromFile(&model, &errors, &warnings, from)
                                             : tiny.LoadASCIIFromFile(&model, &errors, &warnings, from);
  if (!loaded) return from + " is not read: " + errors;
  return tiny.WriteGltfSceneToFile(&model, to, !binary, !binary, true, binary) ? "" : to + " is not written";
}

}  // namespace

TEST_CASE("tinygltf keeps extension, embedded fabric and transforms") {
  const Folder folder;
  REQUIRE(write_garment(folder / "sheet.glb", test::square()));
  REQUIRE(write_fabric(folder / "net.exr", test::net_fabric()));
  for (const bool embed : {true, false}) {
    for (const bool binary : {true, false}) {
      CAPTURE(embed);
      CAPTURE(binary);
      const std::string ending = binary ? ".glb" : ".gltf";
      DressOptions options{.all_cloth = true, .embed = embed};
      REQUIRE(dress(folder / "sheet.glb", folder / "net.exr", folder / ("dressed" + ending), options));
      REQUIRE(pass_through_tinygltf(folder / ("dressed" + ending), folder / ("again" + ending), binary) ==
              "");

      const auto before = test::need(load_gltf(folder / ("dressed" + ending)));
      const auto after = test::need(load_gltf(folder / ("again" + ending)));
      const std::string place = "/materials/0/extensions/SELVEDGE_materials_fabric";
      for (const std::string& pointer : {place, std::string("/extensions/SELVEDGE_materials_fabric")}) {
        const Json::json_pointer at(pointer);
        // tinygltf sorts the members: the difference of two values does not look at their order.
        CHECK(Json::diff(before.json[at], after.json[at]).empty());
      }
      const auto fabrics = test::need(read_fabric_entries(after));
      REQUIRE(fabrics.size() == 1);
      if (embed) {
        const std::string whole = *read_file(folder / "net.exr");
        CHECK(std::equal(whole.begin(), whole.end(), fabrics[0].bytes.begin(), fabrics[0].bytes.end(),
                         [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; }));
      } else {
        CHECK(fabrics[0].path == folder / "net.exr");
      }
      const auto scene = test::need(read_scene(after));
      const FabricReference& reference = *scene.materials[0].fabric;
      // A metre of cloth of 5 x 4 mm.
      CHECK(reference.transform.scale == V2d(200, 250));
      CHECK(scene.materials[0].base_color_texture.transform.scale == V2d(200, 250));
      std::string issues;
      for (const Error& issue : check_gltf(folder / ("again" + ending))) issues += to_line(issue) + "\n";
      CHECK(issues == "");
    }
  }
}
