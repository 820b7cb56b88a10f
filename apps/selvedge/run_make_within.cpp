// make within limits: makes settings in temporary files, and keeps the one that meets the limits.
#include <fmt/format.h>

#include <cmath>

#include "apps/selvedge/run_make.h"
#include "converter/presets/held_out.h"
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

/// A fabric beside the place of the output.
struct Try {
  AtomicFile file;
  MadeFabric made;
};

Try make_beside(const MakeCommand& wanted, const MakeOptions& options) {
  auto file = must(AtomicFile::create(wanted.output));
  MakeCommand command = wanted;
  command.options = options;
  command.output = file.temporary();
  MadeFabric made =
      changing_failures([&] { return make_fabric(command); },
                        [&](const Error& error) { return naming_output(error, file, wanted.output); });
  made.fitted.output = wanted.output;
  return {std::move(file), std::move(made)};
}

Result<PairSamples> bake_pairs(const MakeCommand& command, const CellMesh& mesh) {
  const auto file = must(AtomicFile::create(command.output));
  BakeOptions base = command.options.bake;
  base.resumable = false;
  auto pairs = ensure_held_out(mesh, command.input, HeldOutOptions(), base, file.temporary());
  if (!pairs) return tl::unexpected(naming_output(pairs.error(), file, command.output));
  return pairs;
}

}  // namespace

MadeFabric make_within_limits(const MakeCommand& command) {
  const auto cell = must(find_cell(command.input, command.cell));
  const V2i least = cell.stitch ? cell.stitch->min_texels : V2i(1, 1);
  const int min_texels = std::max(least.x, least.y);
  if (min_texels > HeldOutOptions().texels) {
    throw Failure{{Code::option_out_of_range, command.input, "--texels",
                   fmt::format("its yarns need {}, more than the {} that settings are known for", min_texels,
                               HeldOutOptions().texels)}};
  }
  std::vector<Try> tries;
  PairSamples held_out;
  const auto make = [&](const MakeOptions& options) -> Result<MakeFigures> {
    auto made = make_beside(command, options);
    if (held_out.pairs.empty()) held_out = must(bake_pairs(command, cell.mesh));
    const auto fabric = must(read_fabric(made.file.temporary()));
    const auto comparison = must(compare_with_finer(fabric, held_out, PairKind::held_out));
    tries.push_back(std::move(made));
    return MakeFigures{static_cast<double>(tries.back().made.fitted.bytes), tries.back().made.seconds,
                       comparison.levels.front().psnr};
  };
  const auto result = must(
      make_within(measured_settings(), command.limits, command.options, min_texels, thread_count(), make));
  const TriedSetting& nearest = result.tried[result.nearest];
  if (!result.met) {
    throw Failure{{Code::option_out_of_range, command.input, "limits",
                   fmt::format("are met by none of {} settings made; the nearest is {}: {}",
                               result.tried.size(), options_of(nearest), figures_text(nearest.made))}};
  }
  auto& [file, made] = tries[result.nearest];
  must(file.commit());
  Json json = to_json(nearest);
  json["tried"] = Json::array();
  std::string text;
  for (const TriedSetting& tried : result.tried) {
    json["tried"].push_back(to_json(tried));
    text += fmt::format("tried {}: expected {}; made {}\n", options_of(tried), figures_text(tried.expected),
                        figures_text(tried.made));
  }
  json.update(made.json);
  json["fit"] = fit_json(made.fitted);
  made.json = std::move(json);
  made.text = fmt::format("{}chosen: {}\n{}", text, options_of(nearest), fit_text(made.fitted));
  return std::move(made);
}

}  // namespace selvedge
