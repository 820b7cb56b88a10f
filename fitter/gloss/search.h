// Searches for lobes, diffuse terms and frames of the kinds of texels, for given tables.
#pragma once

#include <vector>

#include "fitter/gloss/form.h"

namespace selvedge {

/// Adds the lobe of a dictionary that lowers the error most, with the same shape and size for all kinds; of
/// size 0 if no lobe lowers the error.
void add_lobe(const GlossForm& form, const GlossDirections& directions, SlabGloss& gloss);

/// At most `steps` steps of Levenberg-Marquardt over all kinds. Returns the error, which never rises. As the
/// tables are fixed, kinds depend on each other little: only the matrix's blocks of one kind are used.
double search_gloss(const GlossForm& form, const GlossDirections& directions, int steps, SlabGloss& gloss);

}  // namespace selvedge
