// The lobes, diffuse terms and frames of the kinds of texels, for given tables.
#pragma once

#include <vector>

#include "fitter/gloss/form.h"

namespace selvedge {

/// Gives every kind the lobe of a dictionary that lowers the error most, one kind after the other; one of no
/// size where none does. The error never rises.
void add_lobe(const GlossForm& form, const GlossDirections& directions, SlabGloss& gloss);

/// Levenberg-Marquardt over all kinds, at most so many steps. Returns the error, which never rises. Tables
/// that are kept fixed hold the other kinds' gloss in place: blocks of one kind are enough of the matrix.
double search_gloss(const GlossForm& form, const GlossDirections& directions, int steps, SlabGloss& gloss);

}  // namespace selvedge
