// repack: a fabric file read and written again, as it was or in another precision, codec, choice of levels or
// layers.
#include <fmt/format.h>

#include "apps/selvedge/commands.h"
#include "apps/selvedge/report.h"
#include "format/base/atomic_file.h"
#include "format/quality/fit_record.h"

namespace selvedge {
namespace {

/// The levels to keep, which have to exist.
Result<V2i> levels_to_keep(const RepackCommand& command, int levels) {
  if (!command.levels) return V2i(0, levels - 1);
  const V2i& range = *command.levels;
  if (range.x < 0 || range.y < range.x || range.y >= levels) {
    return fail(Code::option_out_of_range, command.input, "--levels",
                fmt::format("{}-{} is not within 0-{}", range.x, range.y, levels - 1));
  }
  return range;
}

/// What is in the written fabric, and in which precision.
Json layers_json(const Fabric& fabric, const FabricWriteOptions& options) {
  Json layers = Json::object();
  for (const LayerKind layer : all_layers) {
    for (const FabricLevel& level : fabric.levels) {
      if (level.has(layer)) layers[name_of(layer)] = options.half.contains(layer) ? "half" : "float";
    }
  }
  return layers;
}

/// Writes the fabric with what is still true of the record of its fit.
Result<void> write_recorded(const RepackCommand& command, const FabricReader& reader, const V2i& levels,
                            const Fabric& fabric, const FabricWriteOptions& options) {
  IssueSink sink(command.input);
  const auto record = fit_record_of(fabric.provenance, reader.header().levels, sink);
  if (!record) return write_fabric(command.output, fabric, options);
  LayerSet rounded = options.half;
  rounded.erase(reader.half());
  bool changed = false;
  for (const LayerKind layer : all_layers) {
    const bool was = reader.header().layer(layer).has_value();
    changed = changed || (was && (rounded.contains(layer) || !command.layers.contains(layer)));
  }
  return write_fabric(command.output, fabric, record_of_levels(*record, levels.x, levels.y, changed),
                      options);
}

}  // namespace

int run(const RepackCommand& command) {
  apply(command.common);
  // Said before the work, not after it.
  if (const auto writable = AtomicFile::create(command.output); !writable) {
    return report_error(writable.error());
  }
  auto reader = FabricReader::open(command.input);
  if (!reader) return report_error(reader.error());
  const auto levels = levels_to_keep(command, reader->header().levels);
  if (!levels) return report_error(levels.error());
  FabricWriteOptions options;
  options.codec = command.codec;
  options.half = reader->half();
  options.half.insert(command.to_half);
  options.half.erase(command.to_float);
  const auto fabric = reader->read_levels(levels->x, levels->y, command.layers);
  if (!fabric) return report_error(fabric.error());
  if (auto ok = write_recorded(command, *reader, *levels, *fabric, options); !ok) {
    return report_error(ok.error());
  }
  Json warnings = Json::array();
  for (const Error& warning : precision_warnings(command.output, *fabric, options)) {
    warnings.push_back(to_json(warning));
    if (!(command.common.quiet || command.common.json)) report_issue(warning);
  }
  const FabricLevel& base = fabric->levels.front();
  const auto before = size_of_file(command.input);
  const auto after = size_of_file(command.output);
  report(command.common, "repack",
         {{"output", command.output},
          {"bytes", after},
          {"bytesBefore", before},
          {"texels", {base.width, base.height}},
          {"levels", fabric->levels.size()},
          {"layers", layers_json(*fabric, options)},
          {"codec", options.codec},
          {"warnings", warnings}},
         fmt::format("{} bytes -> {} ({} bytes)\n", before, command.output, after));
  return 0;
}

}  // namespace selvedge
