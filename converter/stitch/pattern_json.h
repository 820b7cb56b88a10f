// Stage "describe": text <-> stitch pattern. A stitch description is a JSON text (spec/stitch.md):
//
// clang-format off
//   { "selvedge_stitch": 1,                   version of this form
//     "name": "plain-knit",
//     "period_mm": [5, 4],                    size of the repeating cell along x and y
//     "yarns": [
//       { "name": "course",                   optional
//         "radius_mm": 0.6,
//         "albedo": [0.5, 0.1, 0.1],          linear red, green, blue in [0, 1]; or "colour": "#aa3322" (sRGB)
//         "fibre": "wool",                    optional: a smooth tube
//         "gloss": 0.2, "roughness": 0.3,     optional: the values of the fibre, or no gloss
//         "plies": 2, "twist_per_mm": 0.2,    optional: a round yarn without twist
//         "segments": [                       cubic Bézier curves, end to end
//           [[0,0,0], [1,0,0], [2,0,0], [5,0,0]] ] } ] }
// clang-format on
//
// Lengths are in millimetres; pattern.h has the frame and the rules. Unknown members are ignored.
#pragma once

#include <string>
#include <string_view>

#include "converter/stitch/pattern.h"

namespace selvedge {

/// Largest text that is read, bytes.
constexpr std::size_t max_stitch_text = 16U << 20U;

/// Parses and validates. Refuses malformed JSON (place: line and column), wrong types and missing members
/// (place: JSON pointer), other versions, and invalid patterns (validate()). `file` is for the message.
Result<StitchPattern> read_stitch(std::string_view text, const std::string& file);

/// The same from a file on disk.
Result<StitchPattern> read_stitch_file(const std::string& path);

/// The description of a pattern, ending in a newline. read_stitch restores the numbers to the bit.
std::string to_json(const StitchPattern& pattern);

}  // namespace selvedge
