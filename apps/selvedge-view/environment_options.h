// Options that pictures and pages share: what lights from all around, and frames.
#pragma once

#include <string>

#include "apps/common/options.h"
#include "format/picture/environment.h"

namespace selvedge {

/// --fps.
void add_fps(Options& options, double& fps);
/// --environment with its turn and strength; `otherwise` says what is taken without it.
void add_environment(Options& options, std::string& name, EnvironmentOptions& environment,
                     const std::string& otherwise);

}  // namespace selvedge
