// Small glTF files for the seed corpus.
#pragma once

#include <map>
#include <string>

namespace selvedge::fuzz {

/// File name -> bytes. `fabric` and `picture` are whole files, EXR and PNG, that some of them embed.
std::map<std::string, std::string> gltf_seeds(const std::string& fabric, const std::string& picture);

/// A square as a Draco mesh; `bits`: of its attributes' quantisation, or 0; `company`: with joints, colours
/// and metadata.
std::string compressed(bool edgebreaker, int bits, bool company = false);

/// A square whose views are compressed by meshoptimizer in every mode and by every filter.
std::string meshopt();

}  // namespace selvedge::fuzz
