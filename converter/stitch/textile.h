// Textile numbers of a stitch: weight, thickness, tightness, and the area that its yarn covers.
#pragma once

#include <vector>

#include "converter/stitch/pattern.h"

namespace selvedge {

struct TextileNumbers {
  std::vector<double> tex;  ///< of each yarn, g/km
  /// Root of tex over the length of yarn in a stitch, cm (Munden 1962); 0 without `stitches`.
  double tightness = 0;
  double weight_g_per_m2 = 0;  ///< g/m2
  /// Between the plates of a gauge (ISO 5084), each of which a tenth of the covered area rises into.
  double thickness_mm = 0;
  double cover_fraction =
      0;  ///< fraction of the area that yarn covers seen along the normal, and with its hairs
  double cover_fraction_with_hairs = 0;
};

/// `stitches`: loops in a repeat; 0: a weave. Refuses yarn that a fabric file cannot hold.
Result<TextileNumbers> textile_numbers(const StitchPattern& pattern, int stitches);

}  // namespace selvedge
