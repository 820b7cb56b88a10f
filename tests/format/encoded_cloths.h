// The garment that is there in several encodings.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace selvedge::test {

/// One cloth in several encodings, each "PREFIX" + encoding + ".glb": ours, and the cloth of the shared data
/// where it is there.
inline std::vector<std::string> encoded_cloths() {
  std::vector<std::string> prefixes{SELVEDGE_SOURCE_DIR "/tests/data/encodings/scarf_"};
  const std::string shared = SELVEDGE_DATA_DIR "/garments/encodings/enc__SheenCloth__";
  if (std::filesystem::exists(shared + "plain.glb")) prefixes.push_back(shared);
  return prefixes;
}

}  // namespace selvedge::test
