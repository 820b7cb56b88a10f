// The knitted sweater, as worn by nobody.
#pragma once

#include "samples/assembly.h"

namespace selvedge::samples {

struct SweaterOptions {
  int levels = 3;  ///< of subdivision; 3 gives some 34,000 triangles without the bands
  int drape_steps = 900;
};

/// A crew-neck sweater with set-in sleeves, hanging on an invisible body, 0.65 m high, in metres, y up,
/// facing +z, the hem's edge on y = 0. Patches: front, back, sleeves (material "sweater"), hem, collar and
/// cuffs (material "trim"). Its surface has four boundary loops. One unit of the texture coordinates is one
/// metre of cloth; wales run along v, downwards on the body and towards the cuffs on the sleeves.
Assembly make_sweater(const SweaterOptions& options = {});

}  // namespace selvedge::samples
