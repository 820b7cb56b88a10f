// The record of a fit: its errors on held-out pairs, which become the member `accuracy` of a fabric
// (spec/fabric.md).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/quality/compare.h"

namespace selvedge {

struct FitRecord {
  int pair_count = 0;  ///< held-out pairs of all sides
  double peak = 0;     ///< 1/sr, the peak of all PSNR
  /// PSNR by level in dB, by index_of(Side); empty for a side that the fabric does not have.
  std::array<std::vector<double>, all_sides.size()> psnr;
};

/// Measures a side by compare(), and adds its errors; the first side sets the peak. Nothing happens without
/// pairs. Fails as compare() does.
Result<void> add_side_accuracy(const Fabric& side, const PairSamples& held_out, FitRecord& record);

/// The member `accuracy` but for the yarn; "{}" without pairs.
std::string accuracy_json(const FitRecord& record);
/// "2 lobes x table", "30 products".
std::string layers_text(const FabricLevel& level);

}  // namespace selvedge
