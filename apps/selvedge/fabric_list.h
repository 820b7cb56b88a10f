// A list of fabrics to make (docs/many.md): a JSON file with the options of `selvedge make` for each.
#pragma once

#include <string>
#include <vector>

#include "apps/selvedge/command_line.h"

namespace selvedge {

struct ListedFabric {
  std::string place;    ///< JSON pointer into the list
  MakeCommand command;  ///< its paths are joined to the list's folder
  int shards = 1;       ///< parts of its bake in a job array
};

/// The fabrics in the list's order, a variant after the other in the order of their names. JSON_MALFORMED for
/// what is no list, also where two have one output, OPTION_OUT_OF_RANGE for options that make refuses.
Result<std::vector<ListedFabric>> read_fabric_list(const std::string& path);

}  // namespace selvedge
