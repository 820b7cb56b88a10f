// Yarn of large repeats in few bytes: light as sums of a few functions of its own (the Karhunen-Loeve
// transform of all stations), and nodes on a grid.
#pragma once

#include "format/fabric/yarns.h"

namespace selvedge {

/// The yarn packed (YarnPacking), if it has more stations than a few stitches. Nodes move by at most 1/128 of
/// the thinnest radius, and light by a tenth of its mean square root: 45 dB and more close by beside the yarn
/// given. Unchanged where its numbers exceed what a file takes.
YarnData packed_if_large(YarnData yarn);

}  // namespace selvedge
