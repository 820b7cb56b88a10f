// Pages of one file, which browsers show by themselves.
#pragma once

#include <string>
#include <vector>

#include "apps/common/shared_options.h"
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
  bool opens = false;  ///< in the browser, when it is written
};

/// The path of a file that lies beside the programs: pages without garments, and the sample garment.
std::string shared_file(const std::string& name);

/// Opens a page in the user's browser, and does not wait for it.
Result<void> open_in_browser(const std::string& page);

/// -o and --open.
void add_page_output(Options& options, PageCommand& command);

/// Fills the page of a verb, `verb`.html, with garments, fabrics and `elements`, writes it and reports it.
Result<int> write_page(const char* verb, const PageCommand& command, const std::string& elements);

}  // namespace selvedge
