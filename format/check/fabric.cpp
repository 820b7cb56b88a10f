#include "format/check/fabric.h"

#include <fmt/format.h>

#include "format/fabric/file.h"
#include "format/fabric/warnings.h"

namespace selvedge {
namespace {

/// Warns of levels that the fabric, or a layer of it, lacks.
void warn_of_levels(const FabricHeader& header, IssueSink& sink) {
  const int complete = level_count(header.width, header.height);
  if (header.levels < complete) {
    sink.add(Code::fabric_levels, "/levels",
             fmt::format("{} of {}: the chain stops before 1x1", header.levels, complete));
  }
  for_each_side(header, [&](const FabricHeader& side) {
    // A level with products needs no tables; the fit chooses between them.
    for (const LayerKind layer :
         {LayerKind::lobes, LayerKind::frame, LayerKind::table, LayerKind::opacity, LayerKind::light}) {
      int without = 0;
      for (int k = 0; side.layer(layer) && k < side.levels; ++k) {
        const bool left_out = side.level_of_texels(k) != k;
        if (!left_out && !side.has(layer, k) && !side.has(LayerKind::products, k)) ++without;
      }
      if (without == 0) continue;
      const std::string prefix = side.side == Side::front ? "" : fmt::format("/sides/{}", name_of(side.side));
      sink.add(Code::fabric_levels, fmt::format("{}/layers/{}/levels", prefix, name_of(layer)),
               fmt::format("{} of the {} levels: on the others the layer counts as 1", side.levels - without,
                           side.levels));
    }
  });
}

/// Warns of peaks and of more light going out than coming in.
void warn_of_light(const FabricReader& reader, const Fabric& fabric, IssueSink& sink) {
  const Fabric* const back = fabric.side_of(Side::back);
  const Fabric* const through = fabric.side_of(Side::through);
  const Fabric* const back_through = fabric.side_of(Side::back_through);
  // Light in front goes on to a viewer behind, and the other way round.
  const Fabric* behind = back_through != nullptr ? back_through : through;
  if (back_through == nullptr && back != nullptr && back->views != fabric.views) behind = nullptr;
  for (std::size_t k = 0; k < fabric.levels.size(); ++k) {
    const int level = static_cast<int>(k);
    const auto lit = [&](const Fabric* side) {
      bool own = side != nullptr && !side->levels[k].of_coarser;
      // Its opacity is the back's.
      if (own && side->side == Side::back_through) own = !back->levels[k].of_coarser;
      return own ? LitSide{&side->levels[k], side} : LitSide();
    };
    for_each_side(fabric, [&](const Fabric& side) {
      if (!side.levels[k].of_coarser)
        warn_of_peaks(side.levels[k], side.side, level, reader.is_half(LayerKind::lobes, side.side), sink);
    });
    warn_of_energy(lit(&fabric), lit(behind), level, sink);
    if (lit(back).level != nullptr) warn_of_energy(lit(back), lit(through), level, sink);
  }
}

CheckedFabric check(Result<ExrReader> file, const FabricLimits& limits) {
  if (!file) return {{file.error()}, {}};
  IssueSink sink(file->name());
  CheckedFabric checked;
  if (auto reader = FabricReader::open(std::move(*file), limits, sink)) {
    checked.fabric = reader->read(sink);
    if (checked.fabric) {
      warn_of_levels(reader->header(), sink);
      warn_of_light(*reader, *checked.fabric, sink);
    }
  }
  checked.issues = sink.take();
  return checked;
}

}  // namespace

CheckedFabric check_fabric(const std::string& path, const FabricLimits& limits) {
  return check(ExrReader::open(path, exr_limits(limits)), limits);
}

CheckedFabric check_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                           const FabricLimits& limits) {
  return check(ExrReader::open(bytes, name, exr_limits(limits)), limits);
}

}  // namespace selvedge
