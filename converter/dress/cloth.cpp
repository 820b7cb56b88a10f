#include "converter/dress/cloth.h"

#include <fmt/format.h>

#include <cmath>

#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/fabric/file.h"

namespace selvedge {
namespace {

/// `shape`: mm of a repeat.
Result<void> check_options(const DressOptions& options, const V2d& shape) {
  if (options.tex_coord < 0 || options.tex_coord > 1) {
    return fail(Code::option_out_of_range, "", "tex_coord", "only the UV sets 0 and 1 are read");
  }
  const V2d one(1, 1);
  const V2d repeats = options.repeats.value_or(one);
  const V2d period = options.mm_per_repeat.value_or(one);
  for (const auto& [name, value] :
       {std::pair("repeats", std::abs(repeats.x)), std::pair("repeats", std::abs(repeats.y)),
        std::pair("mm_per_repeat", period.x), std::pair("mm_per_repeat", period.y),
        std::pair("scale", options.scale), std::pair("unit", options.unit),
        std::pair("height", options.height.value_or(1))}) {
    if (!(value > 0) || !std::isfinite(value))
      return fail(Code::option_out_of_range, "", name, fmt::format("{} is not positive", value));
  }
  if (std::remainder(options.rotation, 90) != 0 && shape.x != shape.y) {
    return fail(
        Code::option_out_of_range, "", "rotation",
        fmt::format("only right angles: the repeat is {:.5g} x {:.5g} mm, not a square", shape.x, shape.y));
  }
  return {};
}

}  // namespace

const Fallback& Cloth::fallback() {
  if (!baked) baked = bake_fallback(fabric);
  return *baked;
}

Cloth read_cloth(const std::string& path, const std::string& output_path, const DressOptions& options,
                 SceneLimits& limits) {
  FabricReader reader = value_or_throw(FabricReader::open(path, {.memory = limits.document.memory}));
  Cloth cloth{value_or_throw(reader.read()), {}, {}};
  limits.document.memory -= reader.memory();
  value_or_throw(check_options(options, options.mm_per_repeat.value_or(V2d(cloth.fabric.period_mm))));
  cloth.source =
      value_or_throw(source_of(path, output_path, options.embed.value_or(has_ending(output_path, ".glb"))));
  cloth.digest = value_or_throw(digest_of_fabric(path));
  return cloth;
}

}  // namespace selvedge
