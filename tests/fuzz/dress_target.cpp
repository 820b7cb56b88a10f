// Bytes -> dress(), with options drawn from the bytes: what it writes is accepted by the checker, but for
// faults that the garment had before, and drawn in a frame of finite numbers. The garment and what becomes of
// it are files of a folder of the run's own; no other file is opened.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "converter/dress/dress.h"
#include "format/check/gltf.h"
#include "format/fabric/file.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/format/yarn_data.h"
#include "tests/fuzz/target.h"
#include "viewer/load.h"
#include "viewer/renderer.h"

using namespace selvedge;

namespace {

struct Wardrobe {
  test::Folder folder;
  std::string fabric = folder / "fabric.exr";

  Wardrobe() {
    fuzz::require(write_fabric(fabric, test::with_yarn(test::lambert_fabric(1, 1, {0.5F, 0.25F, 0.125F}), 3))
                      .has_value(),
                  "a fabric is written");
  }
};

/// Every option by a bit of its own of the sum of all bytes, so that each change of a byte tries others.
DressOptions options_from(std::uint64_t sum) {
  const auto bit = [&sum](int i) { return (sum >> i & 1) != 0; };
  DressOptions options{.all_cloth = true,
                       .limits = {.document = {.file_bytes = 1 << 20, .nesting = 64, .memory = 1 << 28}}};
  options.unwrap = bit(0) ? Unwrapping::always : Unwrapping::where_needed;
  if (bit(1)) options.backing = V3f(0.5F, 0.25F, 0);
  if (bit(2)) options.colourways = {{.name = "other", .color = V3f(0.1F, 0.2F, 0.3F)}};
  options.color_options.keeps_base_color = bit(3);
  if (bit(4)) options.garment_height = 1.7;
  options.tex_coord = bit(5) ? 1 : 0;
  options.embed = !bit(6);
  options.has_fallback = !bit(7);
  return options;
}

void draw(const std::string& garment, const SceneLimits& limits) {
  const Result<LoadedScene> loaded = load_scene(garment, {}, limits);
  if (!loaded) return;
  const Result<std::vector<V3d>> points = world_points(loaded->scene);
  if (!points) return;
  const Result<Camera> camera = make_camera(*points, 1, {});
  if (!camera) return;
  RenderOptions options;
  options.path = RenderPath::raster;
  options.width = options.height = 32;
  options.lights = default_lights(*camera);
  options.shadow_map_size = 64;
  const Result<Frame> frame = render(loaded->scene, loaded->fabrics, *camera, options);
  if (!frame) return;
  for (const V4f& p : frame->pixels)
    fuzz::require(std::isfinite(p.x + p.y + p.z + p.w), "a frame has finite numbers");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Wardrobe wardrobe;
  const std::string garment = wardrobe.folder / "garment.glb";
  const std::string dressed = wardrobe.folder / "dressed.glb";
  std::filesystem::remove(dressed);  // the garment could name it
  test::write_bytes(garment, std::string(reinterpret_cast<const char*>(data), size));
  const DressOptions options = options_from(std::accumulate(data, data + size, std::uint64_t{0}));
  if (!dress(garment, wardrobe.fabric, dressed, options)) return 0;
  draw(dressed, options.limits);
  // A garment that is no good may stay so. But pictures and the fabrics that it wears are not decoded, and
  // pictures of other addresses stay: whatever is wrong with these alone, the rest is good.
  const Issues before = check_gltf(garment, options.limits);
  const auto is_handed_on = [](const Error& issue) {
    return issue.code == Code::image_unreadable ||
           issue.place.starts_with("/extensions/SELVEDGE_materials_fabric/fabrics/");
  };
  const auto is_of_garment = [&](const Error& issue) {
    return severity_of(issue.code) == Severity::error && !is_handed_on(issue);
  };
  if (std::any_of(before.begin(), before.end(), is_of_garment)) return 0;
  const auto was_there = [&](const Error& issue) {
    return is_handed_on(issue) && std::any_of(before.begin(), before.end(), [&](const Error& old) {
             return old.code == issue.code && old.message == issue.message;
           });
  };
  for (const Error& issue : check_gltf(dressed, options.limits))
    fuzz::require(severity_of(issue.code) != Severity::error || was_there(issue), to_line(issue).c_str());
  return 0;
}
