// compare: the errors of fabrics on samples that no fit has used.
#include "format/quality/compare.h"

#include <array>
#include <optional>

#include "apps/selvedge/commands.h"
#include "format/fabric/file.h"

namespace selvedge {
namespace {

struct CompareCommand {
  CommonOptions common;
  std::vector<std::string> files;  ///< fabrics, then the samples
};

void declare(Options& options, CompareCommand& command) {
  options.list("files", command.files, "FABRIC... SAMPLES", "Fabric files, then the samples file")
      .required()
      .word_count(1, 1000)
      .reads();
  options.add_check([&command] {
    if (command.files.size() == 1) refuse("files", "names no fabric before the samples");
  });
}

Json rows_json(const std::vector<LevelComparison>& rows) {
  Json json = Json::array();
  for (const LevelComparison& l : rows) {
    json.push_back({{"level", l.level},
                    {"texels", {l.width, l.height}},
                    {"psnr", l.psnr},
                    {"relativeL2", l.relative_l2},
                    {"meanError", l.relative_bias},
                    {"alphaRms", l.alpha_rms},
                    {"alphaNoise", l.alpha_noise_rms},
                    {"truthNoisePsnr", l.noise_psnr}});
  }
  return json;
}

/// The kinds of pairs that no lobes were fitted to.
constexpr std::array judged_kinds{PairKind::held_out, PairKind::validation};

/// Adds the report about a kind of pairs to `json`; returns its text.
std::string add_kind(PairKind kind, const Comparison& comparison, const std::optional<Comparison>& yarn,
                     Json& json) {
  Json& report = json[name_of(kind)];
  report = {
      {"pairs", comparison.pair_count}, {"peak", comparison.peak}, {"levels", rows_json(comparison.levels)}};
  Json rows = Json::array();
  if (yarn) rows = report["yarn"] = rows_json(yarn->levels);
  for (const Json& row : report["levels"]) rows.push_back(row);
  return "  " + std::string(name_of(kind)) + fill_pattern(": {pairs} pairs, peak {peak:.4g} 1/sr\n", report) +
         table_text(rows, {{"level", "{level}"},
                           {"texels", "{texels}"},
                           {"PSNR dB", "{psnr:.2f}"},
                           {"relative L2", "{relativeL2:.4f}"},
                           {"mean error", "{meanError:+.4f}"},
                           {"alpha rms", "{alphaRms:.4f}"},
                           {"truth's noise dB", "{truthNoisePsnr:.1f}"}});
}

Result<int> run(const CompareCommand& command) {
  const std::string& samples = command.files.back();
  const ByPairKind<PairSamples> truth =
      side_samples(value_or_throw(read_samples(samples)), Side::front).pairs;
  Json json = {{"samples", samples}, {"fabrics", Json::array()}};
  std::string text;
  for (std::size_t i = 0; i + 1 < command.files.size(); ++i) {
    const std::string& path = command.files[i];
    const Fabric fabric = value_or_throw(read_fabric(path));
    Json judged = {{"fabric", path}, {"bytes", file_size_or_zero(path)}};
    text += fill_pattern("{fabric} ({bytes} bytes)\n", judged);
    double peak = 0;
    for (const PairKind kind : judged_kinds) {
      const PairSamples& pairs = truth[index_of(kind)];
      if (pairs.pairs.empty()) continue;
      auto comparison = compare(fabric, pairs, kind, peak);
      if (!comparison) comparison.error().file = path;
      const Comparison levels = value_or_throw(std::move(comparison));
      std::optional<Comparison> yarn;
      if (fabric.levels.front().yarns()) yarn = compare_yarn(fabric, pairs, levels.peak);
      text += add_kind(kind, levels, yarn, judged);
      peak = levels.peak;
    }
    json["fabrics"].push_back(std::move(judged));
  }
  report(command.common, "compare", json, text);
  return 0;
}

}  // namespace

void add_compare_verb(Program& program) {
  program.add<CompareCommand>({"compare", "Error of fabrics against held-out samples, per level",
                               "selvedge compare k.fabric.exr k.samples.exr"},
                              declare, run);
}

}  // namespace selvedge
