// repack: rewrites a fabric file, also in another precision or codec, or with fewer levels or layers.
#include <fmt/format.h>

#include <sstream>

#include "apps/selvedge/commands.h"
#include "format/fabric/file.h"
#include "format/quality/fit_record.h"

namespace selvedge {
namespace {

struct RepackCommand {
  CommonOptions common;
  std::string input;
  std::string output;
  LayerSet to_half;   ///< layers to be stored in 16 bits
  LayerSet to_float;  ///< layers to be stored in 32 bits; all others keep their precision
  LayerSet layers = LayerSet::all();
  std::optional<V2i> levels;  ///< first and last; default: all
  int sides_from = 0;
  std::string codec = FabricWriteOptions{}.codec;
};

LayerSet layers_from(const std::string& text) {
  LayerSet layers;
  std::stringstream names(text);
  for (std::string name; std::getline(names, name, ',');) {
    const auto layer = layer_named(name);
    if (!layer) refuse("--layers", fmt::format("\"{}\" is not a layer", name));
    layers.insert(*layer);
  }
  return layers;
}

void declare(Options& options, RepackCommand& command) {
  options.common(command.common);
  options.text("fabric", command.input, "FILE", "The fabric file; unknown parts and attributes are left out")
      .required()
      .rewrites();
  options.output(command.output, "The fabric file to write").required();
  const auto add_precision = [&](const char* half, const char* whole, const LayerSet& layers,
                                 const char* names) {
    const Option flag = options.flag(
        half, [&command, layers] { command.to_half.insert(layers); }, fmt::format("{} in 16 bits", names));
    options
        .flag(
            whole, [&command, layers] { command.to_float.insert(layers); },
            fmt::format("{} in 32 bits", names))
        .excludes(flag);
  };
  add_precision("--half-lobes", "--float-lobes", {LayerKind::lobes}, "Lobes");
  add_precision("--half-tables", "--float-tables", table_layers, "Tables and frames");
  options.text("--codec", command.codec, "NAME", "none, rle, zips, zip or piz");
  options.text("--levels", "A-B", "Only these levels; A becomes level 0", [&command](const std::string& t) {
    const auto n = whole_numbers_from("--levels", t, '-', 1, 2, "1-3");
    command.levels = V2i(n.front(), n.back());
  });
  options
      .number("--sides-from", command.sides_from, "K",
              "Levels of the output before this one leave its back and the light through it out: they show "
              "the next coarser one's")
      .in(0, 30);
  options.text("--layers", "NAMES", "Only these layers: lobes,frame,table,opacity",
               [&command](const std::string& t) { command.layers = layers_from(t); });
}

/// The levels to keep; they must exist.
Result<V2i> levels_to_keep(const RepackCommand& command, int levels) {
  if (!command.levels) return V2i(0, levels - 1);
  const V2i& range = *command.levels;
  if (range.x < 0 || range.y < range.x || range.y >= levels) {
    return fail(Code::option_out_of_range, command.input, "--levels",
                fmt::format("{}-{} is not within 0-{}", range.x, range.y, levels - 1));
  }
  return range;
}

/// The layers of the written fabric and their precision.
Json layers_json(const Fabric& fabric, const FabricWriteOptions& options) {
  Json layers = Json::object();
  for (const LayerKind layer : all_layers) {
    for (const FabricLevel& level : fabric.levels) {
      if (level.has(layer)) layers[name_of(layer)] = options.half.contains(layer) ? "half" : "float";
    }
  }
  return layers;
}

/// Whether the values of the fabric differ from the values whose errors its record has.
bool is_changed(const RepackCommand& command, const FabricReader& reader, const V2i& levels,
                const FabricWriteOptions& options) {
  LayerSet rounded = options.half;
  rounded.erase(reader.half());
  bool changed = levels != V2i(0, reader.header().levels - 1) ||
                 (command.sides_from > 0 && !reader.header().sides.empty());
  for (const LayerKind layer : all_layers) {
    const bool was = reader.header().layer(layer).has_value();
    changed = changed || (was && (rounded.contains(layer) || !command.layers.contains(layer)));
  }
  return changed;
}

Result<int> run(const RepackCommand& command) {
  auto reader = must(FabricReader::open(command.input));
  const auto levels = must(levels_to_keep(command, reader.header().levels));
  FabricWriteOptions options;
  options.codec = command.codec;
  options.half = reader.half();
  options.half.insert(command.to_half);
  options.half.erase(command.to_float);
  auto fabric = must(reader.read_levels(levels.x, levels.y, command.layers));
  leave_sides_out(fabric, command.sides_from);
  if (is_changed(command, reader, levels, options)) fabric.provenance = without_fit_record(fabric.provenance);
  must(write_fabric(command.output, fabric, options));
  const Json warnings = report_warnings(command.common, precision_warnings(command.output, fabric, options));
  const FabricLevel& base = fabric.levels.front();
  const auto before = size_of_file(command.input);
  const auto after = size_of_file(command.output);
  report(command.common, "repack",
         {{"output", command.output},
          {"bytes", after},
          {"bytesBefore", before},
          {"texels", {base.width, base.height}},
          {"levels", fabric.levels.size()},
          {"layers", layers_json(fabric, options)},
          {"codec", options.codec},
          {"warnings", warnings}},
         fmt::format("{} bytes -> {} ({} bytes)\n", before, command.output, after));
  return 0;
}

}  // namespace

void add_repack_verb(Program& program) {
  program.add<RepackCommand>(
      {"repack", "Write a fabric again: other precision, codec, levels or layers",
       "selvedge repack k.fabric.exr -o small.fabric.exr --levels 1-3 --layers lobes,opacity"},
      declare, run);
}

}  // namespace selvedge
