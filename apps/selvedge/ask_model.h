// Asks a program of others, which answers queries as `answer` does, for a model's values at pairs of
// directions.
#pragma once

#include <string>

#include "format/quality/compare.h"

namespace selvedge {

/// Runs `command` in a shell, writes to it one query of spec/conformance (`evaluate` of a texel of a level)
/// for each pair, each of `levels` levels and each texel of `truth`, and reads its answers, in the same
/// order. Each query names `file`. JSON_MALFORMED, with the number of the answer, for one that is missing,
/// too many, an error, or without finite `rgb` and `alpha` in [0, 1], and if the command fails.
Result<ByPairKind<PairAnswers>> ask_model(const std::string& command, const std::string& file, int levels,
                                          const ByPairKind<PairSamples>& truth);

}  // namespace selvedge
