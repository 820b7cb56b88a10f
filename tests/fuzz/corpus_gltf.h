// Small glTF files for the seed corpus.
#pragma once

#include <map>
#include <string>

namespace selvedge::fuzz {

/// File name -> bytes. `fabric` is a whole fabric file that some of them embed.
std::map<std::string, std::string> gltf_seeds(const std::string& fabric);

}  // namespace selvedge::fuzz
