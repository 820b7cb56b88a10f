#include "apps/selvedge/slab_options.h"

#include <fmt/format.h>

namespace selvedge {

void check_slabs(const CLI::App& app, const BakeCommand& bake, const FitCommand& fit,
                 const MakeCommand& make) {
  const auto refuse = [&](const char* verb, const char* option, const char* why) {
    if (app.get_subcommand(verb)->count(option) > 0)
      throw CLI::ValidationError(option, fmt::format("counts for nothing without {}", why));
  };
  if (bake.bake.slabs == 0) refuse("bake", "--cells", "--slabs");
  // Whether the samples have heights is seen when they are read.
  if (!fit.options.budget) {
    refuse("fit", "--slab-lobes", "--budget");
    refuse("fit", "--glossy-slabs", "--budget");
  }
  // Limits choose slabs and budgets, and refuse these options.
  if (make.limits.any()) return;
  if (!make.options.budget) {
    refuse("make", "--slab-lobes", "--budget, or a --quality that has one");
    refuse("make", "--glossy-slabs", "--budget, or a --quality that has one");
    // Samples that are kept can be fitted with one.
    if (app.get_subcommand("make")->count("--keep-samples") == 0) refuse("make", "--slabs", "--budget");
  }
  if (make.options.bake.slabs == 0) {
    refuse("make", "--cells", "--slabs");
    refuse("make", "--slab-lobes", "--slabs");
  }
}

}  // namespace selvedge
