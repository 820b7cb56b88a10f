// bake and merge, and the bake of make.
#include "apps/selvedge/bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "apps/selvedge/commands.h"
#include "apps/selvedge/option_groups.h"
#include "converter/stitch/find_cell.h"

namespace selvedge {
namespace {

/// Uses as many texels for each repeat, and those that the stitch demands, by default; refuses fewer.
Result<void> ensure_texels(const Cell& cell, const std::string& input, bool given, BakeOptions& options) {
  constexpr int max_texels = 4096;
  if (!cell.stitch) return {};
  const V2i min_texels = cell.stitch->min_texels;
  if (!given) {
    options.width = std::max(options.width * cell.stitch->repeats, min_texels.x);
    options.height = std::max(options.height * cell.stitch->repeats, min_texels.y);
  }
  if (options.width >= min_texels.x && options.height >= min_texels.y &&
      std::max(min_texels.x, min_texels.y) <= max_texels) {
    return {};
  }
  const bool too_few = std::max(min_texels.x, min_texels.y) <= max_texels;
  return fail(Code::option_out_of_range, input, "--texels",
              fmt::format("its yarns need {}x{} texels; {}", min_texels.x, min_texels.y,
                          too_few ? fmt::format("{}x{} were asked for", options.width, options.height)
                                  : fmt::format("at most {} a side are made", max_texels)));
}

}  // namespace

Result<BakeReport> bake_cell(const BakeCommand& command, const CommonOptions& common) {
  const auto cell = must(find_cell(command.input, command.cell));
  const CellMesh* mesh = &cell.mesh;
  BakeOptions options = command.bake;
  must(ensure_texels(cell, command.input, command.texels_given, options));
  // The hue of yarn that scatters inside comes from many bounces.
  if (!command.bounces_given && !mesh->transmission.empty()) options.bounces = unlimited_bounces;
  TerminalProgress progress("bake", common.quiet);
  BakeWatcher watcher;
  if (const Progress show = progress.callback()) {
    watcher = [show, &progress](const BakeProgress& p) {
      progress.note(
          fmt::format("{:.1f} million rays/s, noise {:.2g} %", p.rays_per_second * 1e-6, 100 * p.noise));
      show(p.fraction);
    };
  }
  const Json provenance = {{"software", "selvedge " SELVEDGE_VERSION},
                           {"stitch", std::filesystem::path(command.input).filename().string()},
                           {"vertices", mesh->positions.size()},
                           {"triangles", mesh->triangles.size()}};
  const std::string text = provenance.dump(-1, ' ', false, Json::error_handler_t::replace);
  auto result = command.shard
                    ? bake_shard(*mesh, command.input, options, text, *command.shard, command.output, watcher)
                    : bake(*mesh, command.input, options, text, command.output, watcher);
  // After the work, so that an error is a single line.
  if (result) report_remarks(common, command.input, cell, result->remarks);
  return result;
}

Json bake_json(const BakeReport& r, const std::string& output) {
  return {{"output", output},
          {"bytes", size_of_file(output)},
          {"seconds", r.seconds},
          {"rays", r.rays},
          {"raysPerSecond", static_cast<double>(r.rays) / r.seconds},
          {"units", r.units},
          {"resumed", r.resumed},
          {"coverage", r.coverage},
          {"samples", r.samples},
          {"truthSamples", r.truth_samples},
          {"noise", r.noise},
          {"truthNoise", r.truth_noise},
          {"referenceHeight", r.reference_height},
          {"indirect", name_of(r.indirect)},
          {"remarks", r.remarks}};
}

/// Without an output its line is left out.
std::string bake_text(const BakeReport& r, const std::string& output) {
  const double rays = static_cast<double>(r.rays) * 1e-6;
  return fmt::format(
      "baked in {:.1f} s, {:.1f} million rays ({:.1f} million/s){}, {} samples, noise {:.2g} %{}\n",
      r.seconds, rays, rays / r.seconds,
      r.resumed > 0 ? fmt::format(", {} views and pairs from the journal", r.resumed) : "", r.samples,
      100 * r.noise, output.empty() ? "" : fmt::format(" -> {} ({} bytes)", output, size_of_file(output)));
}

namespace {

void declare(Options& options, BakeCommand& command) {
  options.common(command.common);
  add_cell(options, command.input, command.cell);
  add_bake(options, command.bake);
  options.text("--shard", "I/N", "Bake part I (from 0) of N, for selvedge merge",
               [&command](const std::string& t) { command.shard = shard_from("--shard", t); });
  options.group("");
  options.output(command.output, "The samples file, or with --shard the part").required();
  add_quality(options, command.quality);
  options.check([&options, &command] {
    command.texels_given = options.given("--texels");
    command.bounces_given = options.given("--bounces");
    MakeOptions make;
    make.bake = command.bake;
    apply_quality(options, command.quality, make);
    command.bake = make.bake;
  });
}

Result<int> run(const BakeCommand& command) {
  const auto result = must(bake_cell(command, command.common));
  report(command.common, "bake", bake_json(result, command.output), bake_text(result, command.output));
  return 0;
}

struct MergeCommand {
  CommonOptions common;
  std::vector<std::string> shards;
  std::string output;
};

void declare(Options& options, MergeCommand& command) {
  options.common(command.common);
  options.list("shards", command.shards, "SHARD...", "The parts that bake --shard wrote, in any order")
      .required()
      .reads();
  options.output(command.output, "The samples file").required();
}

Result<int> run(const MergeCommand& command) {
  const auto result = must(merge_shards(command.shards, command.output));
  report(command.common, "merge",
         {{"output", command.output},
          {"bytes", size_of_file(command.output)},
          {"shards", command.shards.size()},
          {"seconds", result.seconds},
          {"coverage", result.coverage},
          {"noise", result.noise},
          {"truthNoise", result.truth_noise}},
         fmt::format("{} shards -> {} ({} bytes), noise {:.2g} %\n", command.shards.size(), command.output,
                     size_of_file(command.output), 100 * result.noise));
  return 0;
}

}  // namespace

void add_bake_verb(Program& program) {
  program.add<BakeCommand>(
      {"bake", "Light a cell from all sides: stitch -> samples", "selvedge bake plain-knit -o k.samples.exr"},
      declare, run);
}

void add_merge_verb(Program& program) {
  program.add<MergeCommand>({"merge", "Join the parts of a bake: shards -> samples",
                             "selvedge merge k.0.shard k.1.shard -o k.samples.exr"},
                            declare, run);
}

}  // namespace selvedge
