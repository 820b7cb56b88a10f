// Chooses the layers of every level, for the smallest error on the validation pairs within a budget of bytes.
// The same pairs, and measured ones, set the brightness of products, three numbers.
//
// Candidates of a level are coefficients in a basis that all texels share, with several steps of
// quantisation, and the paper's model (lobes, with and without the view table), from the finest level on
// where a few texels show that products may not be better for fewer bytes. The chosen combination minimises
// the sum over levels of log(error) for its bytes (a Lagrange multiplier by bisection). The held-out pairs
// are not used.
#pragma once

#include <limits>
#include <map>
#include <vector>

#include "fitter/fit.h"
#include "fitter/products/texel_basis.h"
#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// The truth of one level: alpha r of every pair and texel.
struct LevelTruth {
  int width = 0;
  int height = 0;
  std::vector<std::vector<V3d>> pairs;  ///< [pair][texel]
};

/// The truth of all levels down to 1 x 1, the finest first.
std::vector<LevelTruth> level_truths(const PairSamples& truth);

/// Mean squared error over pairs, texels and channels by the reference evaluation. `fabric`: the level's; its
/// levels are not used.
double level_error(const FabricLevel& level, const Fabric& fabric, const std::vector<DirectionPair>& pairs,
                   const LevelTruth& truth);

class BasisList;

/// One way to store a level.
struct LevelCandidate {
  BasisFit basis;     ///< of products
  FabricLevel lobes;  ///< the paper's model; without layers for products
  double error = 0;   ///< mean squared error of alpha f on the validation pairs
  double bytes = 0;   ///< estimated size in the file, without the shared functions
};

struct LayerFit {
  Fabric fabric;
  std::vector<double> errors;  ///< by level, root mean square on the validation pairs, 1/sr
  double bytes = 0;            ///< estimated size of its layers in a file
};

class LayerFitter {
 public:
  LayerFitter(LayerFitter&&) = default;
  LayerFitter& operator=(LayerFitter&&) = default;

  /// Fits all candidates; `measured` is as for fit(). `room`: of choose(), where it is known;
  /// lobes that would not be chosen within them are not searched. Errors as of fit(),
  /// OPTION_OUT_OF_RANGE for more than 512 lights, and SAMPLES_MALFORMED without validation pairs.
  static Result<LayerFitter> create(SampleLevel samples, const SamplesHeader& header,
                                    const PairSamples& validation, const FitOptions& options,
                                    const Progress& progress = {}, PairSamples measured = {},
                                    double room = std::numeric_limits<double>::infinity());

  /// The best fabric whose layers have an estimated size of at most `room` bytes, or else the smallest. A
  /// file has some `typical_overhead` bytes beside them.
  LayerFit choose_within(double room) const;
  static constexpr double typical_overhead_bytes = 12000;

 private:
  struct Level {
    FabricLevel dark;  ///< the paper's layers, of which only frame and opacity are fitted
    std::vector<LevelCandidate> candidates;
  };
  using Chosen = std::vector<const LevelCandidate*>;  ///< by level
  LayerFitter() = default;
  /// Throws Failure.
  void add_lobes(std::size_t first, const SampleLevel& samples, SamplesHeader header, FitOptions options,
                 const Progress& progress, const PairSamples& measured, const PairSamples& pairs,
                 const std::vector<LevelTruth>& truths);
  void add_estimate(std::size_t level, const SampleLevel& samples, SamplesHeader header, FitOptions options,
                    const PairSamples& pairs, const LevelTruth& truth);
  /// Adds candidates with quantised coefficients; `bytes`: of the other layers.
  void add_quantised(std::size_t level, const BasisFit& basis, double bytes);
  void add_products(const std::vector<SampleLevel>& pooled, const PairSamples& measured,
                    const PairSamples& pairs, const std::vector<LevelTruth>& truths);
  /// The mean of alpha f over the pairs divided by what the basis shows, for each channel, at level `level`;
  /// 4/5 to 5/4, and 1 for less than 16 pairs.
  V3d brightness(std::size_t level, const BasisFit& basis, const LevelTruth& truth,
                 const std::vector<DirectionPair>& pairs) const;
  /// alpha f of every texel, l_z max(0, sum over m of c_m phi_m(v) psi_m(l)) times its opacity.
  std::vector<V3f> shown(std::size_t level, const BasisFit& basis, const DirectionPair& pair) const;
  /// The best of all candidates, or of lobes alone, which need no shared functions; and the better of both.
  Chosen best_of(bool lobes_alone, double room) const;
  Chosen best(double room) const;
  double size_of(const Chosen& chosen) const;
  double cost_of(const Chosen& chosen) const;
  Fabric fabric_;     ///< without levels
  double scale_ = 1;  ///< samples and pairs were divided by it
  std::vector<Level> levels_;
  mutable std::map<Chosen, double> sizes_;  ///< found before
};

}  // namespace selvedge
