// What plan is told, in the words of CLI11: cameras as selvedge-view render takes them.
#pragma once

#include <CLI/CLI.hpp>

#include "converter/plan/scene_plan.h"

namespace selvedge {

void add_plan(CLI::App& app, PlanOptions& plan);

/// Throws CLI's errors for options that exclude each other.
void check_plan_usage(const CLI::App& plan);

}  // namespace selvedge
