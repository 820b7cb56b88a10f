// Woven stitches from drawdowns: which yarn is over at which crossing, as yarns of a pattern.
#pragma once

#include <string>
#include <vector>

#include "converter/stitch/pattern.h"

namespace selvedge {

/// One repeat of a weave. Warp yarns run along y and are counted along x, weft yarns run along x and are
/// counted along y, both from 0 at the lower left of the face.
struct Weave {
  std::vector<Yarn> warp;  ///< without segments
  std::vector<Yarn> weft;
  std::vector<double> warp_mm;  ///< room that each warp yarn takes, along x
  std::vector<double> weft_mm;
  std::vector<bool> warp_is_over;  ///< at warp i and weft j: [j * warp.size() + i]
  bool over(std::size_t i, std::size_t j) const { return warp_is_over[j * warp.size() + i]; }
};

/// The yarns of the weave, straight in the plane and waving from crossing to crossing, thin enough at
/// RelaxOptions::start of their radius. Precondition: at least one yarn each way and arrays of matching
/// sizes.
StitchPattern draw_weave(const Weave& weave, const std::string& name);

}  // namespace selvedge
