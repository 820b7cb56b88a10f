#include "apps/selvedge/fit_report.h"

#include <fmt/format.h>

namespace selvedge {
namespace {

std::string size_text(const LevelReport& level) { return fmt::format("{}x{}", level.width, level.height); }

std::string decibels(const std::optional<FitError>& error) {
  return error ? fmt::format("{:.2f}", error->psnr) : "-";
}

std::string relative(const std::optional<FitError>& error) {
  return error ? fmt::format("{:.4f}", error->relative_l2) : "-";
}

std::string rounds(const LevelReport& level) {
  return level.iterations ? fmt::format("{:.1f}", *level.iterations) : "-";
}

std::string count(const std::optional<int>& texels) { return texels ? fmt::format("{}", *texels) : "-"; }

Json error_json(const std::optional<FitError>& error) {
  if (!error) return nullptr;
  return {{"pairs", error->pairs}, {"psnr", error->psnr}, {"relativeL2", error->relative_l2}};
}

Json level_json(const LevelReport& level, std::size_t index) {
  Json layer_bytes = Json::object();
  for (const auto& [name, bytes] : level.layer_bytes) layer_bytes[name] = bytes;
  Json json = {{"level", index},
               {"texels", {level.width, level.height}},
               {"layers", level.layers},
               {"bytes", level.bytes},
               {"layerBytes", layer_bytes},
               {"heldOut", error_json(level.held_out)},
               {"training", error_json(level.training)}};
  if (level.validation) json["validationError"] = *level.validation;
  if (level.iterations) {
    json["trainingError"] = level.training_error;
    json["iterations"] = *level.iterations;
    json["converged"] = *level.converged;
    json["atLimit"] = *level.at_limit;
    json["seconds"] = level.seconds;
  }
  return json;
}

}  // namespace

Json yarn_json(const FabricReader& reader) {
  const YarnCounts& yarns = reader.header().shape.yarns;
  if (!reader.header().layer(LayerKind::yarns)) return nullptr;
  Json json{
      {"curves", yarns.curves},
      {"nodes", yarns.nodes},
      {"bytes", reader.packed_bytes(LayerKind::yarns, 0) + reader.packed_bytes(LayerKind::indirect, 0)}};
  if (yarns.fields >= fields_with_strands) json["strands"] = true;
  return json;
}

std::string yarn_text(const Json& yarn) {
  const int curves = yarn["curves"].get<int>();
  return fmt::format("{} curve{}{}, {} nodes, {} bytes", curves, curves == 1 ? "" : "s",
                     yarn.contains("strands") ? " of strands" : "", yarn["nodes"].dump(),
                     yarn["bytes"].dump());
}

FitOutcome read_outcome(const std::string& path, const std::vector<LevelReport>& fitted) {
  const auto reader = must(FabricReader::open(path));
  const FabricHeader& header = reader.header();
  IssueSink sink(path);
  FitOutcome outcome;
  outcome.output = path;
  if (auto record = fit_record_of(header.provenance, header.levels, sink))
    outcome.record = std::move(*record);
  outcome.bytes = size_of_file(path);
  outcome.shared_bytes = reader.packed_bytes(LayerKind::bases, 0);
  outcome.yarn = yarn_json(reader);
  outcome.record.levels.resize(header.levels);
  for (int k = 0; k < header.levels; ++k) {
    LevelReport& level = outcome.record.levels[k];
    level.width = level_size(header.width, k);
    level.height = level_size(header.height, k);
    level.iterations = fitted[k].iterations;  // with all digits
    level.training_error = fitted[k].training_error;
    level.seconds = fitted[k].seconds;
    for (const LayerKind layer : all_layers) {
      if (layers_of_no_level.contains(layer) || !header.has(layer, k)) continue;
      level.layer_bytes.emplace_back(name_of(layer), reader.packed_bytes(layer, k));
    }
  }
  return outcome;
}

Json fit_json(const FitOutcome& outcome) {
  Json levels = Json::array();
  for (const LevelReport& level : outcome.record.levels) levels.push_back(level_json(level, levels.size()));
  Json warnings = Json::array();
  for (const Error& warning : outcome.record.warnings) warnings.push_back(to_json(warning));
  Json sides = Json::object();
  for (const Side side : other_sides) {
    for (const LevelReport& level : outcome.record.sides[index_of(side) - 1]) {
      Json& list = sides[name_of(side)];
      list.push_back({{"level", list.size()},
                      {"layers", level.layers},
                      {"bytes", level.bytes},
                      {"heldOut", error_json(level.held_out)}});
    }
  }
  return {{"output", outcome.output},
          {"bytes", outcome.bytes},
          {"sharedBytes", outcome.shared_bytes},
          {"yarn", outcome.yarn},
          {"peak", outcome.record.peak},
          {"seconds", outcome.seconds},
          {"levels", levels},
          {"sides", sides},
          {"warnings", warnings}};
}

std::string fit_text(const FitOutcome& outcome) {
  std::string text =
      "level   texels  held-out dB  rel. L2  training dB  rel. L2  iterations  at limit    bytes  layers\n";
  for (std::size_t k = 0; k < outcome.record.levels.size(); ++k) {
    const LevelReport& l = outcome.record.levels[k];
    text += fmt::format("{:5}  {:>7}  {:>11}  {:>7}  {:>11}  {:>7}  {:>10}  {:>8}  {:>7}  {}\n", k,
                        size_text(l), decibels(l.held_out), relative(l.held_out), decibels(l.training),
                        relative(l.training), rounds(l), count(l.at_limit), l.bytes, l.layers);
  }
  for (const Side side : other_sides) {
    const auto& levels = outcome.record.sides[index_of(side) - 1];
    if (levels.empty()) continue;
    std::string errors;
    std::uint64_t bytes = 0;
    for (const LevelReport& l : levels) {
      errors += (errors.empty() ? "" : ", ") + decibels(l.held_out);
      bytes += l.bytes;
    }
    text += fmt::format("{}: held-out {} dB by level, {} bytes\n", name_of(side), errors, bytes);
  }
  if (!outcome.yarn.is_null()) text += fmt::format("yarn: {}\n", yarn_text(outcome.yarn));
  return text +
         fmt::format("fitted in {:.1f} s -> {} ({} bytes)\n", outcome.seconds, outcome.output, outcome.bytes);
}

}  // namespace selvedge
