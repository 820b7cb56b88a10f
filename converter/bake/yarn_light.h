// The light that reaches yarn by way of other yarn, as a fabric file holds it (format/fabric/yarns.h).
#pragma once

#include "converter/bake/setup.h"
#include "converter/light/irradiance_cache.h"
#include "format/fabric/yarns.h"

namespace selvedge {

struct YarnLightOptions {
  int paths = 128;  ///< without a cache, from each place around every station
  int bounces = 12;
  std::uint64_t seed = 1;
  bool both_sides = false;  ///< YarnData::through, too
};

/// Gives the curves their indirect light, and all light from below if that is wanted, in the cell that they
/// are the yarn of: as a cache of the cell has it, or traced (null). Heights of `data` are above its lowest
/// point. Places that other yarn covers count for next to nothing. Values are whole multiples of a power of
/// two a curve and colour: 8 bits of the brightest colour, or of each where light passes through. The same
/// for any number of threads.
void trace_yarn_light(const TracedCell& cell, const YarnLightOptions& options, IrradianceCache* cache,
                      YarnData& data);

}  // namespace selvedge
