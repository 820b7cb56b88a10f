// The verbs fit and make: their options and the checks between them.
#include "apps/selvedge/command_line.h"

#include <fmt/format.h>

#include <array>
#include <sstream>

#include "apps/selvedge/commands.h"
#include "apps/selvedge/option_groups.h"
#include "apps/selvedge/run_fit.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

void declare(Options& options, FitCommand& command) {
  options.common(command.common);
  options.text("samples", command.input, "FILE", "The samples file").required().reads();
  add_fit(options, command.options);
  options.group("");
  options.output(command.output, "The fabric file").required();
  add_quality(options, command.quality);
  options.check([&options, &command] { apply_quality(options, command.quality, command.options); });
}

/// Refuses options that the limits choose or do not know of.
void check_limits(const Options& options) {
  options.refuse_if(true, "is chosen by --max-bytes, --min-db and --max-seconds",
                    {"--texels", "--views", "--lights", "--samples", "--bounces", "--lobes", "--no-table",
                     "--budget", "--half-lobes", "--float-tables"});
  options.refuse_if(true, "excludes --max-bytes, --min-db and --max-seconds",
                    {"--quality", "--keep-samples"});
}

/// --max-bytes, --min-db and --max-seconds beside --quality, and the options that they exclude.
void add_choice(Options& options, MakeCommand& command) {
  MakeLimits& limits = command.limits;
  add_quality(options, command.quality);
  options.bytes("--max-bytes", limits.bytes, "Choose the settings: at most so many bytes (K, M: KiB, MiB)");
  options
      .number("--min-db", limits.held_out, "X",
              "Choose the settings: at least so many dB on held-out directions at 64x64 texels; the cheapest")
      .in(0, 200);
  options.number("--max-seconds", limits.seconds, "S", "Choose the settings: at most so long to bake and fit")
      .in(1e-3, 1e9);
  options.check([&options, &command] {
    if (command.limits.any()) {
      check_limits(options);
      // The knobs of the table's rows are laid over the paper's.
      (void)set_knobs(knobs_of(MakeOptions()), "", "", command.options);
      command.options.budget_texels = 0;
    } else {
      apply_quality(options, command.quality, command.options);
    }
  });
}

/// --list and what goes with it, which excludes the options of a single fabric.
void add_list(Options& options, MakeCommand& command) {
  ListOptions& list = command.list;
  options.group("Many fabrics");
  options
      .text("--list", list.path, "FILE",
            "Make the fabrics that this file lists (JSON, docs/many.md) and that are not up to date")
      .reads();
  options.text("--task", "I/N",
               "Only every N-th fabric of the list, from I (0 to N - 1) on: a task of a job array",
               [&list](const std::string& t) {
                 list.task = shard_from("--task", t);
                 list.as_task = true;
               });
  options.flag("--parts", list.bakes_parts,
               "Bake the parts of the listed fabrics that have \"shards\", for the tasks that make them");
  options.flag("--dry-run", list.dry_run, "Only tell what would be made");
  options.flag("--keep-going", list.keep_going, "Go on after a fabric that cannot be made");
  options.text("--page", list.page, "DIR", "A folder for a page with a picture of each fabric").writes();
  options.check([&options, &list] {
    const bool many = !list.path.empty();
    options.refuse_if(!many, "needs --list", {"--task", "--parts", "--dry-run", "--keep-going", "--page"});
    const std::string single = options.as_given({"--list", "--task", "--parts", "--dry-run", "--keep-going",
                                                 "--page", "--json", "--quiet", "--threads"});
    if (many && options.given("input")) refuse("--list", "excludes a stitch");
    // A page is of the whole list.
    options.refuse_if(list.as_task || list.bakes_parts || list.dry_run, "is for a run over the whole list",
                      {"--page"});
    if (many && !single.empty())
      refuse(single.substr(0, single.find('=')), "is of a single fabric: write it into the list");
    if (!many && !options.given("input")) refuse("input", "is required, or --list");
    if (!many && !options.given("--output")) refuse("--output", "is required");
  });
}

void declare(Options& options, MakeCommand& command) {
  options.common(command.common);
  add_cell(options, command.input, command.cell).required(false);
  add_bake(options, command.options.bake);
  add_fit(options, command.options);
  options.group("");
  options.text("--keep-samples", command.samples, "FILE", "Keep the samples in this file").writes();
  options.output(command.output, "The fabric file");
  options.text("--shard", "I/N", "Bake part I (from 0) of N beside the output, for a make with --shards N",
               [&command](const std::string& t) { command.shard = shard_from("--shard", t); });
  options.number("--shards", command.shards, "N", "Merge the N parts beside the output in place of a bake")
      .in(1, 4096);
  options
      .text("--depfile", command.depfile, "FILE",
            "Write the files that were read as a rule for Make and Ninja")
      .writes();
  add_list(options, command);
  add_choice(options, command);
  options.check([&options, &command] {
    options.refuse_if(command.limits.any(), "excludes --max-bytes, --min-db and --max-seconds",
                      {"--shard", "--shards"});
    options.refuse_if(command.shard.has_value(), "excludes --shard",
                      {"--shards", "--keep-samples", "--depfile"});
    // Those that are left out make no other bytes.
    command.asked = options.as_given({"--output", "--json", "--quiet", "--threads", "--keep-samples",
                                      "--shard", "--shards", "--depfile"});
    command.line = "selvedge make " + shell_word(command.input);
    std::istringstream given(
        options.as_given({"--json", "--quiet", "--threads", "--shard", "--shards", "--depfile"}));
    for (std::string word; std::getline(given, word);) command.line.append(" ").append(shell_word(word));
    command.texels_given = options.given("--texels");
    command.bounces_given = options.given("--bounces");
  });
}

}  // namespace

Result<MakeCommand> make_command_of(const std::vector<std::string>& words, const std::string& file,
                                    const std::string& place) {
  MakeCommand command;
  const auto good =
      parse_words([&command](Options& options) { declare(options, command); }, words, file, place);
  if (!good) return tl::unexpected(good.error());
  return command;
}

void add_fit_verb(Program& program) {
  program.add<FitCommand>(
      {"fit", "Fit a fabric to samples: samples -> fabric", "selvedge fit k.samples.exr -o k.fabric.exr"},
      declare, run);
}

void add_make_verb(Program& program) {
  program.add<MakeCommand>({"make", "Stitch, bake and fit in one: stitch -> fabric",
                            "selvedge make plain-weave -o weave.fabric.exr"},
                           declare, run);
}

}  // namespace selvedge
