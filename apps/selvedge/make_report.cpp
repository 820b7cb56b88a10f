#include "apps/selvedge/make_report.h"

#include <fmt/format.h>

#include "format/base/guard.h"

namespace selvedge {
namespace {

/// Layers whose values belong to no level, though they are stored at level 0.
constexpr LayerSet layers_of_no_level{LayerKind::bases, LayerKind::yarns, LayerKind::indirect};

Json level_json(const FitOutcome& outcome, const FabricReader& reader, Side side, std::size_t k) {
  const Fabric& fabric = side == Side::front ? outcome.fabric : *outcome.fabric.sides[index_of(side) - 1];
  const LevelReport& level = outcome.levels[index_of(side)][k];
  const std::vector<double>& psnr = outcome.record.psnr[index_of(side)];
  Json layer_bytes = Json::object();
  std::uint64_t bytes = 0;
  for (const LayerKind layer : all_layers) {
    if (layers_of_no_level.contains(layer) || !fabric.levels[k].has(layer)) continue;
    const std::uint64_t of_layer = reader.packed_bytes(layer, static_cast<int>(k), side);
    layer_bytes[name_of(layer)] = of_layer;
    bytes += of_layer;
  }
  Json json = {{"level", k},
               {"texels", {level.width, level.height}},
               {"layers", layers_text(fabric.levels[k])},
               {"bytes", bytes},
               {"layerBytes", layer_bytes},
               {"heldOutPsnr", k < psnr.size() ? Json(psnr[k]) : Json()}};
  if (level.iterations > 0) {
    json["trainingError"] = level.training_error;
    json["iterations"] = level.iterations;
    json["atLimit"] = level.at_limit;
  }
  return json;
}

/// `curves`, `nodes`, and `bytes` of both layers of yarn in the file; null without yarn.
Json yarn_json(const FabricReader& reader) {
  const YarnCounts& yarns = reader.header().shape.yarns;
  if (!reader.header().layer(LayerKind::yarns)) return nullptr;
  return {{"curves", yarns.curves},
          {"nodes", yarns.nodes},
          {"bytes", reader.packed_bytes(LayerKind::yarns, 0) + reader.packed_bytes(LayerKind::indirect, 0)}};
}

}  // namespace

Json bake_json(const BakeReport& r, const std::string& output) {
  Json json = Json::object();
  if (!output.empty()) json = {{"output", output}, {"bytes", size_of_file(output)}};
  json.update({{"seconds", r.seconds},
               {"rays", r.rays},
               {"raysPerSecond", static_cast<double>(r.rays) / r.seconds},
               {"coverage", r.coverage},
               {"samples", r.samples},
               {"truthSamples", r.truth_samples},
               {"noise", r.noise},
               {"truthNoise", r.truth_noise},
               {"referenceHeight", r.reference_height},
               {"indirect", name_of(r.indirect)},
               {"remarks", r.remarks}});
  return json;
}

std::string bake_text(const Json& bake) {
  return filled(
             "baked in {seconds:.1f} s, {rays:.3g} rays ({raysPerSecond:.3g} a second), {samples} samples, "
             "noise {noise:.2g}",
             bake) +
         (bake.contains("output") ? filled(" -> {output} ({bytes} bytes)\n", bake) : "\n");
}

Json fit_json(const FitOutcome& outcome, const std::string& output) {
  const auto reader = value_or_throw(FabricReader::open(output));
  Json json = {{"output", output},
               {"bytes", size_of_file(output)},
               {"sharedBytes", reader.packed_bytes(LayerKind::bases, 0)},
               {"yarn", yarn_json(reader)},
               {"peak", outcome.record.peak},
               {"seconds", outcome.seconds},
               {"levels", Json::array()},
               {"sides", Json::object()},
               {"warnings", Json::array()}};
  for (const Side side : all_sides) {
    for (std::size_t k = 0; k < outcome.levels[index_of(side)].size(); ++k)
      (side == Side::front ? json["levels"] : json["sides"][name_of(side)])
          .push_back(level_json(outcome, reader, side, k));
  }
  for (const Error& warning : outcome.warnings) json["warnings"].push_back(to_json(warning));
  return json;
}

std::string fit_text(const Json& fit) {
  std::string text = table_text(fit["levels"], {{"level", "{level}"},
                                                {"texels", "{texels}"},
                                                {"held-out dB", "{heldOutPsnr:.2f}"},
                                                {"iterations", "{iterations:.1f}"},
                                                {"at limit", "{atLimit}"},
                                                {"bytes", "{bytes}"},
                                                {"layers", "{layers}"}});
  for (const auto& [side, levels] : fit["sides"].items()) {
    std::string errors;
    std::uint64_t bytes = 0;
    for (const Json& level : levels) {
      errors += (errors.empty() ? "" : ", ") + filled("{heldOutPsnr:.2f}", level);
      bytes += level["bytes"].get<std::uint64_t>();
    }
    text += fmt::format("{}: held-out {} dB by level, {} bytes\n", side, errors, bytes);
  }
  if (!fit["yarn"].is_null())
    text += filled("yarn: {curves} curves, {nodes} nodes, {bytes} bytes\n", fit["yarn"]);
  return text + filled("fitted in {seconds:.1f} s -> {output} ({bytes} bytes)\n", fit);
}

}  // namespace selvedge
