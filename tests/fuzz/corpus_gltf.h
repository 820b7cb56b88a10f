// Small glTF files for the seed corpus.
#pragma once

#include <map>
#include <string>

namespace selvedge::fuzz {

/// File name -> bytes. `fabric` and `picture` are whole files, EXR and PNG, that some of them embed.
std::map<std::string, std::string> gltf_seeds(const std::string& fabric, const std::string& picture);

}  // namespace selvedge::fuzz
