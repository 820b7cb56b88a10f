#include "converter/dress/reattach.h"

#include <doctest/doctest.h>

#include <filesystem>

#include "converter/dress/extras_mirror.h"
#include "format/base/atomic_file.h"
#include "format/gltf/read_scene.h"
#include "tests/converter/workshop.h"
#include "tests/require.h"

using namespace selvedge;
using test::square;
using test::Workshop;
namespace fs = std::filesystem;

namespace {

constexpr GltfLimits anywhere{.other_files = OtherFiles::anywhere};

constexpr const char* extension = "SELVEDGE_materials_fabric";

/// Deletes the extension from the JSON, and with it whatever only the extension held.
void drop_extension(Json& json) {
  json.erase("extensions");
  for (Json& material : json["materials"]) {
    if (material.contains("extensions")) material["extensions"].erase(extension);
  }
}

/// Multiplies the scale and adds to the offset of a texture's transform, as an optimiser does that has coded
/// the texture coordinates anew: its new coordinates are (uv - offset) / scale.
void fold(Json& texture_info, const V2d& scale, const V2d& offset) {
  UvTransform transform;
  Json& stored = texture_info["extensions"]["KHR_texture_transform"];
  if (stored.contains("scale")) transform.scale = V2d(stored["scale"][0], stored["scale"][1]);
  if (stored.contains("offset")) transform.offset = V2d(stored["offset"][0], stored["offset"][1]);
  if (stored.contains("rotation")) transform.rotation = stored["rotation"];
  const V2d moved = transform.apply(offset);
  stored["offset"] = {moved.x, moved.y};
  stored["scale"] = {transform.scale.x * scale.x, transform.scale.y * scale.y};
}

Json& material_of(Json& json, std::size_t index = 0) { return json["materials"][index]; }

Json& base_color_of(Json& json, std::size_t index = 0) {
  return material_of(json, index)["pbrMetallicRoughness"]["baseColorTexture"];
}

/// Dresses the workshop's garment, lets `damage` change the JSON, and restores it to "restored.glb".
struct Restoration {
  const Workshop& workshop;
  std::string packed = workshop.folder / "packed.glb";
  std::string restored = workshop.folder / "restored.glb";

  template <class F>
  void pack(const F& damage, const DressOptions& options = {.all = true}) {
    REQUIRE(workshop.dress(options));
    GltfDocument document = test::need(load_gltf(workshop.output));
    damage(document.json);
    REQUIRE(save_gltf(document, packed));
  }

  Result<ReattachReport> reattach(const ReattachOptions& options) const {
    return selvedge::reattach(packed, restored, options);
  }

  /// The error's code, once nothing has been written.
  Code refused(const ReattachOptions& options) const {
    const Error error = test::error_of(reattach(options));
    CHECK_FALSE(fs::exists(restored));
    CHECK(to_line(error).find('\n') == std::string::npos);
    return error.code;
  }
};

}  // namespace

TEST_CASE("reattach: an embedded fabric comes back with the transform of the base colour texture") {
  const Workshop workshop;
  Restoration job{workshop};
  job.pack([](Json& json) {
    drop_extension(json);
    fold(base_color_of(json), V2d(128, 64), V2d(0.25, 0));
  });
  CHECK_FALSE(load_gltf(job.packed)->json.contains("extensions"));
  const auto report = job.reattach({.fabrics = {workshop.fabric}});
  REQUIRE_MESSAGE(report.has_value(), to_line(report.error()));
  CHECK(report->warnings.empty());
  CHECK(report->embedded == 1);
  CHECK(report->bytes == fs::file_size(job.restored));
  const Scene scene = test::need(read_scene(job.restored));
  REQUIRE(scene.materials[0].fabric);
  const UvTransform& transform = scene.materials[0].fabric->transform;
  CHECK(transform.scale == V2d(200 * 128, 250 * 64));
  CHECK(transform.offset == V2d(50, 0));
  CHECK(transform.scale == scene.materials[0].base_color_texture.transform.scale);
  const Result<std::string> file = read_file(workshop.fabric);
  CHECK(std::string(scene.fabrics[0].bytes.begin(), scene.fabrics[0].bytes.end()) == *file);
  const Json json = load_gltf(job.restored)->json;
  CHECK(json["extensionsUsed"].dump().find(extension) != std::string::npos);
  CHECK_FALSE(json.contains("extensionsRequired"));
}

TEST_CASE("reattach: what comes back is what dress has written, if only the extension was dropped") {
  for (const bool fallback : {true, false}) {
    const Workshop workshop;
    DressOptions options{.all = true};
    options.fallback = fallback;
    Restoration job{workshop};
    job.pack(drop_extension, options);
    REQUIRE(job.reattach({.fabrics = {workshop.fabric}}));
    const Json before = load_gltf(workshop.output)->json;
    const Json after = load_gltf(job.restored)->json;
    // Members of objects have no order.
    CHECK(nlohmann::json(after["materials"]) == nlohmann::json(before["materials"]));
    CHECK(after["extensions"][extension]["fabrics"][0]["name"] ==
          before["extensions"][extension]["fabrics"][0]["name"]);
  }
}

TEST_CASE("reattach: where the base colour lies otherwise, the fabric follows its change") {
  Workshop workshop;
  workshop.edit([](Json& json) {
    json["images"] = Json::array({Json{{"uri", "data:image/png;base64,iVBORw0KGgo="}}});
    json["textures"] = Json::array({Json{{"source", 0}}});
    json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {
        {"index", 0},
        {"extensions",
         {{"KHR_texture_transform", {{"scale", {2, 3}}, {"offset", {0.5, 0}}, {"rotation", 0.3}}}}}};
  });
  DressOptions options{.all = true};
  options.fallback = false;
  Restoration job{workshop};
  const V2d scale(16, 0.125);
  const V2d offset(-2, 5);
  job.pack(
      [&](Json& json) {
        drop_extension(json);
        fold(base_color_of(json), scale, offset);
      },
      options);
  const auto report = job.reattach({.fabrics = {workshop.fabric}});
  REQUIRE_MESSAGE(report.has_value(), to_line(report.error()));
  CHECK(report->warnings.empty());
  const UvTransform dressed = read_scene(workshop.output)->materials[0].fabric->transform;
  const UvTransform& now = report->materials[0].transform;
  for (const V2d& uv : {V2d(0, 0), V2d(1, 0), V2d(0.3, 0.7)}) {
    const V2d packed((uv.x - offset.x) / scale.x, (uv.y - offset.y) / scale.y);
    CHECK((now.apply(packed) - dressed.apply(uv)).length() < 1e-9);
  }
}

TEST_CASE("reattach: without a base colour texture the old transform is used, with a warning") {
  const Workshop workshop;
  Restoration job{workshop};
  job.pack([](Json& json) {
    drop_extension(json);
    material_of(json)["pbrMetallicRoughness"].erase("baseColorTexture");
  });
  const auto report = job.reattach({.fabrics = {workshop.fabric}});
  REQUIRE(report);
  CHECK(report->warnings.size() == 1);
  CHECK(report->materials[0].transform.scale == V2d(200, 250));
}

TEST_CASE("reattach: an optimiser that moves to another UV set is followed") {
  Workshop workshop;
  workshop.edit([](Json& json) {
    Json& attributes = json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_1"] = attributes["TEXCOORD_0"];
  });
  Restoration job{workshop};
  job.pack(
      [](Json& json) {
        drop_extension(json);
        Json& attributes = json["meshes"][0]["primitives"][0]["attributes"];
        attributes.erase("TEXCOORD_1");
        base_color_of(json).erase("texCoord");
      },
      {.all = true, .tex_coord = 1});
  const auto report = job.reattach({.fabrics = {workshop.fabric}});
  REQUIRE_MESSAGE(report.has_value(), to_line(report.error()));
  CHECK(report->materials[0].tex_coord == 0);
}

TEST_CASE("reattach: a fabric beside the glTF is found where the mirror says, else asked for") {
  const Workshop workshop;
  Restoration job{workshop};
  DressOptions options{.all = true};
  options.embed = false;
  job.pack(drop_extension, options);
  fs::create_directories(workshop.folder / "out");
  job.restored = workshop.folder / "out/restored.gltf";
  REQUIRE(job.reattach({}));
  CHECK(load_gltf(job.restored, anywhere)->json["extensions"][extension]["fabrics"][0]["uri"] ==
        "../net.exr");
  fs::remove(job.restored);

  fs::rename(workshop.fabric, workshop.folder / "moved.exr");
  const Error error = test::error_of(job.reattach({}));
  CHECK(error.code == Code::gltf_reference);
  CHECK(error.file == job.packed);
  CHECK(error.place == "/materials/0/extras/SELVEDGE_materials_fabric");
  CHECK(error.message.find("net.exr") != std::string::npos);
  CHECK_FALSE(fs::exists(job.restored));
  REQUIRE(job.reattach({.fabrics = {workshop.folder / "moved.exr"}}));
  CHECK(load_gltf(job.restored, anywhere)->json["extensions"][extension]["fabrics"][0]["uri"] ==
        "../moved.exr");
}

TEST_CASE("reattach: of several fabrics each goes to its own material, by digest or by name") {
  Workshop workshop(square(2));
  const std::string other = workshop.folder / "felt.exr";
  REQUIRE(write_fabric(other, test::lambert_fabric(V2d(5, 5), 4, V3f(0.5F, 0.5F, 0.5F))));
  const std::string half = workshop.folder / "half.glb";
  REQUIRE(dress(workshop.garment, other, half, {.materials = {"cloth 1"}}));
  workshop.garment = half;
  Restoration job{workshop};
  job.pack(drop_extension, {.materials = {"cloth 0"}});
  // Under other names the digests tell them apart.
  fs::copy_file(workshop.fabric, workshop.folder / "a.exr");
  fs::copy_file(other, workshop.folder / "b.exr");
  const auto fabric_of = [&](std::size_t material, const ReattachReport& report) {
    return fs::path(report.materials[material].fabric).filename().string();
  };
  const auto by_digest = job.reattach({.fabrics = {workshop.folder / "b.exr", workshop.folder / "a.exr"}});
  REQUIRE_MESSAGE(by_digest.has_value(), to_line(by_digest.error()));
  CHECK(fabric_of(0, *by_digest) == "a.exr");
  CHECK(fabric_of(1, *by_digest) == "b.exr");
  CHECK(by_digest->warnings.empty());
  const auto by_name = job.reattach(
      {.fabrics = {"felt=" + (workshop.folder / "a.exr"), "net=" + (workshop.folder / "b.exr")}});
  REQUIRE_MESSAGE(by_name.has_value(), to_line(by_name.error()));
  CHECK(fabric_of(0, *by_name) == "b.exr");
  CHECK(by_name->warnings.size() == 2);  // each is another fabric than before
  fs::remove(job.restored);
  CHECK(job.refused({.fabrics = {workshop.folder / "a.exr"}}) == Code::gltf_reference);
  CHECK(job.refused({.fabrics = {"linen=" + (workshop.folder / "a.exr")}}) == Code::gltf_reference);
}

TEST_CASE("reattach: materials with a fabric are left alone, and without any lost one it is an error") {
  Workshop workshop(square(3));
  Restoration job{workshop};
  job.pack([](Json& json) { material_of(json, 1)["extensions"].erase(extension); },
           {.materials = {"cloth 0", "cloth 1"}});
  const auto report = job.reattach({});  // the entry of the root array is still there
  REQUIRE_MESSAGE(report.has_value(), to_line(report.error()));
  CHECK(report->attached == std::vector<int>{0});
  REQUIRE(report->materials.size() == 1);
  CHECK(report->materials[0].index == 1);
  CHECK(report->embedded == 0);
  CHECK(load_gltf(job.restored)->json["extensions"] == load_gltf(job.packed)->json["extensions"]);
  fs::remove(job.restored);
  job.packed = workshop.output;
  CHECK(job.refused({}) == Code::material_missing);
  job.packed = workshop.garment;
  CHECK(job.refused({}) == Code::material_missing);
}

TEST_CASE("reattach: bad input is one error and no output") {
  const Workshop workshop;
  Restoration job{workshop};
  const auto with = [&](const auto& damage) {
    job.pack([&](Json& json) {
      drop_extension(json);
      damage(json);
    });
    return job.refused({.fabrics = {workshop.fabric}});
  };
  CHECK(with([](Json& json) { material_of(json)["extras"][extension] = 1; }) == Code::gltf_extension);
  CHECK(with([](Json& json) { material_of(json)["extras"][extension]["name"] = 1; }) == Code::gltf_extension);
  CHECK(with([](Json& json) { material_of(json)["extras"][extension] = Json::object(); }) ==
        Code::gltf_extension);
  CHECK(with([](Json& json) { json["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0"); }) ==
        Code::garment_no_uvs);
  job.pack(drop_extension);
  CHECK(job.refused({}) == Code::gltf_reference);
  CHECK(job.refused({.fabrics = {workshop.folder / "none.exr"}}) == Code::file_missing);
  CHECK(job.refused({.fabrics = {workshop.garment}}) == Code::exr_malformed);
  job.packed = workshop.folder / "none.glb";
  CHECK(job.refused({}) == Code::file_missing);
}

TEST_CASE(
    "reattach: a transform by which no fabric lies on a surface is refused, from the mirror and from the "
    "texture") {
  for (const bool in_texture : {false, true}) {
    CAPTURE(in_texture);
    const Workshop workshop;
    Restoration job{workshop};
    job.pack([&](Json& json) {
      drop_extension(json);
      const Json none = {{"KHR_texture_transform", {{"scale", {0, 1}}}}};
      material_of(json)["extras"][extension]["extensions"] = none;
      if (in_texture) base_color_of(json)["extensions"] = none;
      if (!in_texture) material_of(json)["pbrMetallicRoughness"].erase("baseColorTexture");
    });
    CHECK(job.refused({.fabrics = {workshop.fabric}}) == Code::gltf_extension);
  }
}
