// make within limits: makes settings in temporary files, and keeps the one that meets the limits.
#include <fmt/format.h>

#include <cmath>

#include "apps/common/paths.h"
#include "apps/selvedge/run_make.h"
#include "converter/presets/held_out.h"
#include "converter/presets/within_limits.h"
#include "format/base/parallel.h"
#include "format/quality/compare.h"

namespace selvedge {
namespace {

std::string figures_text(const MakeFigures& f) {
  return fmt::format("{:.0f} bytes, {:.2f} s, {:.2f} dB", f.bytes, f.seconds, f.held_out);
}

Json to_json(const MakeFigures& f) {
  return {{"bytes", std::round(f.bytes)}, {"seconds", f.seconds}, {"heldOut", f.held_out}};
}

/// The setting as options that replace the limits on the command line.
std::string options_of(const TriedSetting& setting) {
  return "--quality paper" + options_text(setting.options);
}

Json to_json(const TriedSetting& setting) {
  return {{"options", options_of(setting)},
          {"expected", to_json(setting.expected)},
          {"made", to_json(setting.made)}};
}

class Search {
 public:
  explicit Search(const MakeCommand& command) : command_(command) {}

  Result<WithinLimits> run() {
    const auto cell = find_cell(command_.input, command_.cell);
    if (!cell) return tl::unexpected(cell.error());
    const int min_texels =
        cell->stitch ? std::max(cell->stitch->min_texels.x, cell->stitch->min_texels.y) : 1;
    if (min_texels > HeldOutOptions().texels) {
      return fail(Code::option_out_of_range, command_.input, "--texels",
                  fmt::format("its yarns need {}, more than the {} that settings are known for", min_texels,
                              HeldOutOptions().texels));
    }
    return make_within(measured_settings(), command_.limits, command_.options, min_texels, thread_count(),
                       [&](const MakeOptions& options) { return make(options, cell->mesh); });
  }

  const MadeFabric& made(std::size_t index) const { return made_[index]; }
  Result<void> commit(std::size_t index) { return files_[index].commit(); }

 private:
  Result<void> bake_pairs(const CellMesh& mesh) {
    const auto file = AtomicFile::create(command_.output);
    if (!file) return tl::unexpected(file.error());
    BakeOptions base = command_.options.bake;
    base.resumable = false;
    auto pairs = bake_held_out(mesh, command_.input, HeldOutOptions(), base, file->temporary());
    if (!pairs) return tl::unexpected(naming_output(pairs.error(), *file, command_.output));
    held_out_ = std::move(*pairs);
    return {};
  }

  Result<MakeFigures> make(const MakeOptions& options, const CellMesh& mesh) {
    auto file = AtomicFile::create(command_.output);
    if (!file) return tl::unexpected(file.error());
    MakeCommand command = command_;
    command.options = options;
    command.output = file->temporary();
    auto made = make_fabric(command);
    if (!made) return tl::unexpected(naming_output(made.error(), *file, command_.output));
    if (held_out_.pairs.empty()) {
      if (auto ok = bake_pairs(mesh); !ok) return tl::unexpected(ok.error());
    }
    const auto fabric = read_fabric(command.output);
    if (!fabric) return tl::unexpected(fabric.error());
    const auto comparison = compare_with_finer(*fabric, held_out_, PairKind::held_out);
    if (!comparison) return tl::unexpected(comparison.error());
    made->fitted.output = command_.output;
    const MakeFigures figures{static_cast<double>(made->fitted.bytes), made->seconds,
                              comparison->levels.front().psnr};
    made_.push_back(std::move(*made));
    files_.push_back(std::move(*file));
    return figures;
  }

  const MakeCommand& command_;
  PairSamples held_out_;
  std::vector<MadeFabric> made_;
  std::vector<AtomicFile> files_;
};

}  // namespace

Result<int> run_within_limits(const MakeCommand& command) {
  // Tries are written to temporary files, so the user's paths are compared here.
  const auto distinct = check_distinct(
      {{"the input", command.input}, {"--output", command.output}, {"--report", command.report}});
  if (!distinct) return tl::unexpected(distinct.error());
  Search search(command);
  const auto result = search.run();
  if (!result) return tl::unexpected(result.error());
  const TriedSetting& nearest = result->tried[result->nearest];
  if (!result->met) {
    return fail(Code::option_out_of_range, command.input, "limits",
                fmt::format("are met by none of {} settings made; the nearest is {}: {}",
                            result->tried.size(), options_of(nearest), figures_text(nearest.made)));
  }
  if (auto ok = search.commit(result->nearest); !ok) return tl::unexpected(ok.error());
  const MadeFabric& made = search.made(result->nearest);
  Json json = to_json(nearest);
  json["tried"] = Json::array();
  std::string text;
  for (const TriedSetting& tried : result->tried) {
    json["tried"].push_back(to_json(tried));
    text += fmt::format("tried {}: expected {}; made {}\n", options_of(tried), figures_text(tried.expected),
                        figures_text(tried.made));
  }
  json.update(made.json);
  json["fit"] = fit_json(made.fitted);
  if (!command.report.empty()) {
    if (auto ok = write_report(command.report, "make", json, made.fitted); !ok)
      return tl::unexpected(ok.error());
  }
  report(command.common, "make", json,
         fmt::format("{}chosen: {}\n{}", text, options_of(nearest), fit_text(made.fitted)));
  return 0;
}

}  // namespace selvedge
