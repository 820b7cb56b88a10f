// Pages of one file, which browsers show by themselves.
#pragma once

#include <string>
#include <vector>

#include "apps/common/shared_options.h"
#include "apps/selvedge-view/environment_options.h"
#include "format/gltf/limits.h"

namespace selvedge {

struct PageCommand {
  CommonOptions common;
  std::vector<std::string> inputs;
  std::string output;
  SceneLimits limits;
  std::string environment = "studio";
  EnvironmentOptions environment_options;
  bool has_backdrop = false;
  double backdrop_blur = 0;
  double fps = 30;
};

/// The path of a file that lies beside the programs: pages without garments, and the sample garment.
std::string shared_file(const std::string& name);

/// Fills the page of a verb, `verb`.html, with garments, fabrics and `elements`, writes it and reports it.
Result<int> write_page(const char* verb, const PageCommand& command, const std::string& elements);

}  // namespace selvedge
