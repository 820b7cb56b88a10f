#include "apps/selvedge-view/garment_writer.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <numbers>

#include "apps/selvedge-view/workbench.h"
#include "converter/dress/dress.h"
#include "format/base/atomic_file.h"
#include "format/base/guard.h"

namespace selvedge {
namespace {

/// The file of a fabric; of an embedded one, a new file. Throws Failure.
std::string file_of(const SceneFabric& fabric, TemporaryFolder& bench) {
  if (!fabric.path.empty()) return fabric.path;
  std::string path = bench.next_path(".exr");
  value_or_throw(write_file(path, fabric.bytes));
  return path;
}

/// The options that give a material the fabric as it lies there.
DressOptions options_for(int material, const SceneMaterial& worn, const SceneLimits& limits) {
  const UvTransform& transform = worn.fabric->transform;
  DressOptions options;
  options.materials = {fmt::format("#{}", material)};
  options.limits = limits;
  options.tex_coord = worn.fabric->tex_coord;
  options.repeats = transform.scale;
  options.offset = transform.offset;
  // Right angles are exact in degrees.
  options.rotation_degrees = std::round(transform.rotation * 180 / std::numbers::pi * 1e9) / 1e9;
  options.color_options.tint = worn.garment_textures.tint;
  options.embed = true;
  return options;
}

/// Dresses the materials one after the other; those on no triangles stay as they are. Throws Failure.
std::string save(TemporaryFolder& bench, const SceneLimits& limits, const std::string& garment,
                 const Scene& worn, const std::string& output) {
  std::string from = garment;
  std::vector<std::string> remarks;
  for (std::size_t i = 0; i < worn.materials.size(); ++i) {
    const SceneMaterial& wears = worn.materials[i];
    if (!wears.fabric) continue;
    const std::string fabric = file_of(worn.fabrics[wears.fabric->fabric], bench);
    const std::string to = bench.next_path(".glb");
    const Result<DressReport> dressed =
        dress(from, fabric, to, options_for(static_cast<int>(i), wears, limits));
    if (!dressed && dressed.error().code == Code::garment_empty) continue;
    const DressReport report = value_or_throw(dressed);
    remarks.insert(remarks.end(), report.warnings.begin(), report.warnings.end());
    from = to;
  }
  if (from == garment)
    throw Failure{
        {Code::garment_empty, garment, "/materials", "nothing wears a fabric: there is nothing to save"}};
  value_or_throw(write_file(output, value_or_throw(read_file(from))));
  return fmt::format("{}", fmt::join(remarks, "\n"));
}

}  // namespace

GarmentWriter make_garment_writer(const SceneLimits& limits) {
  const auto bench = std::make_shared<TemporaryFolder>();
  return GarmentWriter{
      [bench, limits](const std::string& garment, const std::string& fabric) {
        std::string path = bench->next_path(".glb");
        value_or_throw(dress(garment, fabric, path, {.all_cloth = true, .embed = true, .limits = limits}));
        return path;
      },
      [bench, limits](const std::string& garment, const Scene& worn, const std::string& output) {
        return save(*bench, limits, garment, worn, output);
      }};
}

}  // namespace selvedge
