// Errors of a fabric against ray-traced truth: per level, over pairs of directions that no fit has used.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// Errors of alpha * f over all texels, holes included, and all three channels.
struct LevelComparison {
  int level = 0;  ///< -1: the yarn
  int width = 0;
  int height = 0;
  /// dB, against Comparison::peak. 200 if nothing differs; 0 if the truth is black and the fit is not.
  double psnr = 0;
  double relative_l2 = 0;      ///< sqrt(sum (fit - truth)^2 / sum truth^2); 1 if only the truth is black
  double relative_bias = 0;    ///< mean of fit - truth, as a fraction of the mean truth
  double alpha_rms = 0;        ///< root mean square error of alpha
  double alpha_noise_rms = 0;  ///< the part of alpha_rms that is sampling noise of the truth
  double noise_psnr = 0;       ///< dB, the sampling noise of the truth against the same peak
};

struct Comparison {
  int pair_count = 0;
  double peak = 0;  ///< 1/sr, of all PSNR
  std::vector<LevelComparison> levels;
};

/// `peak`: 0 means the 99.9th percentile of alpha * r of these pairs at level 0, or if that is 0, the
/// largest; to compare figures of several sets, pass the held-out set's peak for all. FABRIC_MISMATCH unless
/// the samples have the texels of the fabric's level 0.
Result<Comparison> compare(const Fabric& fabric, const PairSamples& truth, PairKind kind, double peak = 0);

/// As compare(), of the yarn, level -1, at the sizes of all levels; at 1 x 1 its mean over a repeat counts.
/// Preconditions: the fabric has yarn, and compare() takes the truth.
Comparison compare_yarn(const Fabric& fabric, const PairSamples& truth, double peak);

/// Errors of a fit on held-out pairs, which become the member `accuracy` of a fabric (spec/fabric.md).
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
