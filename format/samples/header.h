// The header of a samples file, and its text (spec/samples.md).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "format/fabric/fabric.h"

namespace selvedge {

/// Random pairs of directions with the truth for each: the validation set, by which things may be chosen;
/// the held-out set, by which they are only judged; the rim, judged apart.
enum class PairKind { validation, held_out, rim };
inline constexpr std::array<PairKind, 3> all_pair_kinds{PairKind::validation, PairKind::held_out,
                                                        PairKind::rim};

inline std::size_t index_of(PairKind kind) { return static_cast<std::size_t>(kind); }

/// As the part of the file is called: "validation", "held-out", "rim".
const char* name_of(PairKind kind);

/// Without a radiance scale: it is 1.
struct SamplesHeader : FabricInfo {
  int width = 32;
  int height = 32;
  int samples_per_texel = 0;                        ///< rays per texel and view
  int truth_samples = 0;                            ///< rays per texel of the pair sets
  std::array<std::vector<DirectionPair>, 3> pairs;  ///< by PairKind
  std::optional<SlabShape> slabs;                   ///< of the heights, where the file has them

  int texels() const { return width * height; }
};

/// The header as the file's attribute has it, and back; `file` is for messages. Refuses (samples_malformed)
/// what is not as spec/samples.md has it.
std::string samples_header_to_json(const SamplesHeader& header);
Result<SamplesHeader> samples_header_from_json(const std::string& text, const std::string& file);

}  // namespace selvedge
