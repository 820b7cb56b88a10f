// Options of render and show that would be taken without a word and change nothing.
#pragma once

#include <functional>
#include <string>

#include "apps/selvedge-view/command_line.h"

namespace selvedge {

/// The first option that would count for nothing with this input, or beside the others, and why: "--zoom is
/// for scenes, not for a swatch"; empty: none. `given` tells whether an option was on the command line.
std::string idle_option(const RenderCommand& command, const std::function<bool(const char*)>& given);
std::string idle_option(const ShowCommand& command, const std::function<bool(const char*)>& given);

}  // namespace selvedge
