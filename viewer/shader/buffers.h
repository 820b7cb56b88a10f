// Fabrics as one array of words for shaders (shader_evaluation.h reads it). Loaded once.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "format/fabric/fabric.h"

namespace selvedge {

/// Word i of the array is where fabric i begins. Numbers are 32-bit floats, but for tables whose values half
/// precision holds exactly: two of those share a word. Places are word numbers; place 0 means that there is
/// no such layer. Preconditions: validate() passed, and the whole has less than 2^32 words.
///
/// A fabric:  0 levels, 1-2 columns and rows of the views' grid, 3-4 of the lights', 5 radiance scale, 6
/// place of phi, 7 place of psi, 8-9 cells per mm upwards along u and v if a level had one cell, 10 reference
/// height, 11-12 texels of level 0 of the whole fabric, 13 which of its levels level 0 is, 14 + k: place of
/// level k.
///
/// A level:  0-1 width and height, 2 number of lobes, 3 place of lobes, 4 of frames, 5 of T, 6 whether T is
/// halves, 7 place of opacity, 8 halves, 9 place of S, 10 halves, 11 number of products, 12 entries of a
/// texel, 13 place of pairs, 14 of coefficients, 15 of heights (top and bottom of every entry), 16-18
/// columns, rows and slabs, 19 highest top, 20 lowest bottom.
std::vector<std::uint32_t> shader_words(std::span<const Fabric> fabrics);

}  // namespace selvedge
