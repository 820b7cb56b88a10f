// compare: the errors of fabrics on samples that no fit has used.
#include "format/quality/compare.h"

#include <fmt/format.h>

#include "apps/common/paths.h"
#include "apps/report/compare_plot.h"
#include "apps/selvedge/commands.h"
#include "fitter/training_pairs.h"
#include "format/base/atomic_file.h"
#include "format/fabric/file.h"

namespace selvedge {
namespace {

struct CompareCommand {
  CommonOptions common;
  std::vector<std::string> files;  ///< fabrics, then the samples
  std::string plot;                ///< .svg of the one fabric; empty: none
};

void declare(Options& options, CompareCommand& command) {
  options.common(command.common);
  options.list("files", command.files, "FABRIC... SAMPLES", "Fabric files, then the samples file")
      .required()
      .count(2, 1000);
  options
      .text("--plot", command.plot, "FILE",
            "Draw truth, fit and difference, and the error over angles and levels (.svg)")
      .ends_in({".svg"});
  options.check([&command] {
    if (!command.plot.empty() && command.files.size() != 2) refuse("--plot", "draws one fabric");
  });
}

using Rows = std::vector<LevelComparison>;

Json rows_json(const Rows& rows) {
  Json json = Json::array();
  for (const LevelComparison& l : rows) {
    json.push_back({{"level", l.level},
                    {"texels", {l.width, l.height}},
                    {"psnr", l.psnr},
                    {"relativeL2", l.relative_l2},
                    {"meanError", l.mean_error},
                    {"alphaRms", l.alpha_rms},
                    {"alphaNoise", l.alpha_noise},
                    {"truthNoisePsnr", l.noise_psnr}});
  }
  return json;
}

std::string rows_text(const Rows& rows) {
  std::string text;
  for (const LevelComparison& l : rows) {
    text += fmt::format("    {:5}  {:>7}  {:7.2f}  {:11.4f}  {:+9.2f} %  {:9.4f}  {:16.1f}\n", l.level,
                        fmt::format("{}x{}", l.width, l.height), l.psnr, l.relative_l2, 100 * l.mean_error,
                        l.alpha_rms, l.noise_psnr);
  }
  return text;
}

void draw(const std::string& output, const Fabric& fabric, const PairSamples& held_out, SamplesReader& reader,
          const std::string& fabric_path) {
  const auto training = must(read_training_pairs(reader));
  must(write_file(output, must(compare_plot(fabric, held_out, training,
                                            {fabric_path, reader.name(), size_of_file(fabric_path)}))));
}

Result<int> run(const CompareCommand& command) {
  must(check_writable({command.plot}));
  const std::string& samples = command.files.back();
  auto reader = must(SamplesReader::open(samples));
  std::array<PairSamples, 3> truth;
  for (const PairKind kind : all_pair_kinds) {
    truth[static_cast<std::size_t>(kind)] = must(reader.read_pairs(kind));
  }
  Json fabrics = Json::array();
  std::string text;
  for (std::size_t i = 0; i + 1 < command.files.size(); ++i) {
    const std::string& path = command.files[i];
    const auto fabric = must(read_fabric(path));
    Json entry = {{"fabric", path}, {"bytes", size_of_file(path)}};
    text += fmt::format("{} ({} bytes)\n", path, size_of_file(path));
    double peak = 0;
    for (const PairKind kind : {PairKind::held_out, PairKind::rim, PairKind::validation}) {
      const PairSamples& pairs = truth[static_cast<std::size_t>(kind)];
      if (pairs.pairs.empty()) continue;
      const auto comparison = compare(fabric, pairs, kind, peak);
      if (!comparison) {
        Error error = comparison.error();
        error.file = path;
        return tl::unexpected(error);
      }
      peak = comparison->peak;
      Json& json = entry[name_of(kind)];
      json = {{"pairs", comparison->pairs}, {"peak", peak}, {"levels", rows_json(comparison->levels)}};
      text += fmt::format("  {}: {} pairs, peak {:.4g} 1/sr\n", name_of(kind), comparison->pairs, peak);
      text += "    level   texels  PSNR dB  relative L2  mean error  alpha rms  truth's noise dB\n";
      if (fabric.levels.front().yarns()) {
        const Comparison yarn = compare_yarn(fabric, pairs, kind, peak);
        json["yarn"] = rows_json(yarn.levels);
        text += rows_text(yarn.levels);
      }
      text += rows_text(comparison->levels);
    }
    if (!command.plot.empty())
      draw(command.plot, fabric, truth[static_cast<std::size_t>(PairKind::held_out)], reader, path);
    fabrics.push_back(entry);
  }
  report(command.common, "compare", {{"samples", samples}, {"fabrics", fabrics}}, text);
  return 0;
}

}  // namespace

void add_compare_verb(Program& program) {
  program.add<CompareCommand>({"compare", "Error of fabrics against held-out samples, per level",
                               "selvedge compare k.fabric.exr k.samples.exr"},
                              declare, run);
}

}  // namespace selvedge
