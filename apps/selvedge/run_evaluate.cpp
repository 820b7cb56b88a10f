// evaluate and compare: what a fabric says, and how far it is from the truth.
#include <fmt/format.h>

#include "apps/report/compare_plot.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/fabric_query.h"
#include "apps/selvedge/report.h"
#include "fitter/training_pairs.h"
#include "format/base/atomic_file.h"
#include "format/quality/compare.h"

namespace selvedge {
namespace {

Json list_of(const V3f& v) { return {v.x, v.y, v.z}; }

/// The level that was asked for must exist, here with texture coordinates too: a wrong number is a slip.
Result<Shading> shading_at(const EvaluateCommand& command, const FabricQuery& query) {
  auto fabric = QueriedFabric::open(command.fabric);
  if (!fabric) return tl::unexpected(fabric.error());
  const int last = fabric->levels() - 1;
  if (!(query.level >= 0 && query.level <= last)) {
    return fail(Code::option_out_of_range, command.fabric, "--level",
                fmt::format("{} is outside of 0 to {}", query.level, last));
  }
  auto shading = fabric->shade(query);
  if (!shading && shading.error().code == Code::option_out_of_range) {
    shading.error().place.insert(0, "--");
  }
  return shading;
}

Json comparison_json(const Comparison& c) {
  Json levels = Json::array();
  for (const LevelComparison& l : c.levels) {
    levels.push_back({{"level", l.level},
                      {"texels", {l.width, l.height}},
                      {"psnr", l.psnr},
                      {"relativeL2", l.relative_l2},
                      {"meanError", l.mean_error},
                      {"alphaRms", l.alpha_rms},
                      {"alphaNoise", l.alpha_noise},
                      {"truthNoisePsnr", l.noise_psnr}});
  }
  return {{"pairs", c.pairs}, {"peak", c.peak}, {"levels", levels}};
}

std::string comparison_text(const Comparison& c) {
  std::string text = fmt::format("  {}: {} pairs, peak {:.4g} 1/sr\n", name_of(c.kind), c.pairs, c.peak);
  text += "    level   texels  PSNR dB  relative L2  mean error  alpha rms  truth's noise dB\n";
  for (const LevelComparison& l : c.levels) {
    text += fmt::format("    {:5}  {:>7}  {:7.2f}  {:11.4f}  {:+9.2f} %  {:9.4f}  {:16.1f}\n", l.level,
                        fmt::format("{}x{}", l.width, l.height), l.psnr, l.relative_l2, 100 * l.mean_error,
                        l.alpha_rms, l.noise_psnr);
  }
  return text;
}

/// The picture of a comparison, as the file's name asks for.
Result<void> draw(const std::string& output, const Fabric& fabric, const PairSamples& held_out,
                  SamplesReader& reader, const std::string& fabric_path) {
  const auto training = read_training_pairs(reader);
  if (!training) return tl::unexpected(training.error());
  const auto drawing =
      plot(fabric, held_out, *training, {fabric_path, reader.name(), size_of_file(fabric_path)});
  if (!drawing) return tl::unexpected(drawing.error());
  const auto failed = [&](Error error) {
    error.file = output;
    return tl::unexpected(std::move(error));
  };
  if (output.ends_with(".svg")) {
    const auto svg = svg_of(*drawing);
    return svg ? write_file(output, *svg) : failed(svg.error());
  }
  const auto png = png_of(*drawing);
  return png ? write_file(output, *png) : failed(png.error());
}

}  // namespace

int run(const EvaluateCommand& command) {
  apply(command.common);
  const FabricQuery query{command.level, command.texel, command.uv, V3f(command.light.normalized()),
                          V3f(command.view.normalized())};
  const auto shading = shading_at(command, query);
  if (!shading) return report_error(shading.error());
  Json json = {{"level", command.level}};
  if (command.texel) json["texel"] = {command.texel->x, command.texel->y};
  if (command.uv) json["uv"] = {command.uv->x, command.uv->y};
  json["light"] = list_of(query.light);
  json["view"] = list_of(query.view);
  json["rgb"] = list_of(shading->radiance);
  json["alpha"] = shading->alpha;
  // The answer is JSON in any case; --json adds the frame that all reports have.
  report(command.common, "evaluate", json, json.dump() + "\n");
  return 0;
}

int run(const CompareCommand& command) {
  apply(command.common);
  if (!command.plot.empty()) {  // said before the work, not after it
    if (const auto writable = AtomicFile::create(command.plot); !writable)
      return report_error(writable.error());
  }
  const std::string& samples = command.files.back();
  auto reader = SamplesReader::open(samples);
  if (!reader) return report_error(reader.error());
  std::array<PairSamples, 3> truth;
  for (const PairKind kind : all_pair_kinds) {
    auto pairs = reader->read_pairs(kind);
    if (!pairs) return report_error(pairs.error());
    truth[static_cast<std::size_t>(kind)] = std::move(*pairs);
  }
  Json fabrics = Json::array();
  std::string text;
  for (std::size_t i = 0; i + 1 < command.files.size(); ++i) {
    const std::string& path = command.files[i];
    const auto fabric = read_fabric(path);
    if (!fabric) return report_error(fabric.error());
    Json entry = {{"fabric", path}, {"bytes", size_of_file(path)}};
    text += fmt::format("{} ({} bytes)\n", path, size_of_file(path));
    double peak = 0;
    for (const PairKind kind : {PairKind::held_out, PairKind::rim, PairKind::validation}) {
      const PairSamples& pairs = truth[static_cast<std::size_t>(kind)];
      if (pairs.pairs.empty()) continue;
      const auto comparison = compare(*fabric, pairs, kind, peak);
      if (!comparison) {
        Error error = comparison.error();
        error.file = path;
        return report_error(error);
      }
      peak = comparison->peak;
      entry[name_of(kind)] = comparison_json(*comparison);
      text += comparison_text(*comparison);
    }
    if (!command.plot.empty()) {
      if (auto ok =
              draw(command.plot, *fabric, truth[static_cast<std::size_t>(PairKind::held_out)], *reader, path);
          !ok)
        return report_error(ok.error());
    }
    fabrics.push_back(entry);
  }
  report(command.common, "compare", {{"samples", samples}, {"fabrics", fabrics}}, text);
  return 0;
}

}  // namespace selvedge
