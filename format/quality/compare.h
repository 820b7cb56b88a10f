// How far a fabric is from the truth: per level, over pairs of directions that took no part in the fit.
#pragma once

#include <string>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// Errors of alpha * f over black, all texels counted (holes too), all three channels together.
struct LevelComparison {
  int level = 0;
  int width = 0;
  int height = 0;
  /// dB; peak: the truth's 99.9th percentile at level 0, or its largest value where that is 0; one for all
  /// levels. 200 where nothing differs; 0 where the truth is black and the fit is not.
  double psnr = 0;
  double relative_l2 = 0;  ///< sqrt(sum (fit - truth)^2 / sum truth^2); 1 where the truth alone is black
  double mean_error = 0;   ///< mean of fit - truth, as a share of the mean truth
  double alpha_rms = 0;    ///< root mean square error of alpha
  double alpha_noise = 0;  ///< the part of alpha_rms that is the truth's own sampling noise
  double noise_psnr = 0;   ///< dB, the truth's own sampling noise against the same peak
};

/// The same of one pair of directions.
struct PairComparison {
  double psnr = 0;     ///< dB, the peak being that of the comparison
  double squared = 0;  ///< sum (fit - truth)^2
  double energy = 0;   ///< sum truth^2
};

struct Comparison {
  PairKind kind = PairKind::held_out;
  int pairs = 0;
  double peak = 0;  ///< 1/sr
  std::vector<LevelComparison> levels;
  std::vector<PairComparison> by_pair;  ///< at level 0
};

/// The peak of a comparison with these pairs alone, 1/sr.
double peak_of(const PairSamples& truth);

/// `peak`: 0 takes it from these pairs; the tool takes the held-out set's for all sets, so that figures
/// compare. Refuses (fabric_mismatch) samples of another texel count than the fabric's level 0.
Result<Comparison> compare(const Fabric& fabric, const PairSamples& truth, PairKind kind, double peak = 0);

/// The same against pairs of 2^d times as many texels along both sides as the fabric's level 0 has, d >= 0:
/// the levels are those of the truth. Where the fabric has no level as fine, its level 0 stands for it, each
/// texel for the 2^k x 2^k that lie within it. So fabrics of different sizes have figures that compare.
/// FABRIC_MISMATCH for other sizes.
Result<Comparison> compare_with_finer(const Fabric& fabric, const PairSamples& truth, PairKind kind,
                                      double peak = 0);

}  // namespace selvedge
