// Stage "describe": text <-> stitch pattern. A stitch description is a JSON text (spec/stitch.md); pattern.h
// has the frame and the rules.
#pragma once

#include <string>
#include <string_view>

#include "converter/stitch/pattern.h"

namespace selvedge {

/// Largest text that is read, bytes.
constexpr std::size_t max_stitch_bytes = 16U << 20U;

/// Parses and validates. Refuses malformed JSON (place: line and column), wrong types and missing members
/// (place: JSON pointer), other versions, and invalid patterns (validate()). `file` is for the message.
Result<StitchPattern> read_stitch(std::string_view text, const std::string& file);

/// The description of a pattern, a line for each yarn. read_stitch restores the numbers to the bit.
std::string to_json(const StitchPattern& pattern);

}  // namespace selvedge
