// Converts drawdowns of weaves to patterns: yarns that pass over and under each other.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "converter/stitch/pattern.h"

namespace selvedge {

/// One repeat of a weave. Warp yarns run along y and are counted along x, weft yarns run along x and are
/// counted along y, both from 0 at the lower left of the face.
struct Weave {
  std::vector<Yarn> warp;  ///< segments are ignored
  std::vector<Yarn> weft;
  std::vector<double> warp_spacing_mm;  ///< width of each warp yarn's lane, along x
  std::vector<double> weft_spacing_mm;
  std::vector<bool> warp_is_over;  ///< at warp i and weft j: [j * warp.size() + i]
  bool is_warp_over(std::size_t i, std::size_t j) const { return warp_is_over[j * warp.size() + i]; }
};

/// The yarns of the weave, straight in the plane, waving from crossing to crossing; they do not overlap at
/// RelaxOptions::start_fraction of their radius. Precondition: at least one yarn each way and arrays of
/// matching sizes.
StitchPattern draw_weave(const Weave& weave, const std::string& name);

/// Numbers of the kinds of crossings along each yarn of a drawn weave, by the sides of the 3 x 3 crossings
/// and the yarns about them, of any colours. Empty where the yarns are not evenly spaced.
std::vector<std::vector<std::uint32_t>> crossing_kinds(const StitchPattern& weave);

/// The first yarns of a weave each way, all where there are fewer.
Weave corner_of(const Weave& weave, std::size_t warps, std::size_t wefts);

}  // namespace selvedge
