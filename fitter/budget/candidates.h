// The best fabric for a budget: per level the set of layers with the least error on the validation pairs.
//
// Candidates of a level are the paper's model (lobes, with and without the view table), products of shared
// functions for every texel, and, where the samples have heights, slabs with products, and with lobes beside
// them: of several shapes, one of which all levels share, and with coefficients coarser or finer. Among all
// combinations the one is taken that makes the sum over levels of log(error) least for its bytes (Lagrange's
// multiplier, by bisection). The held-out pairs take no part.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fitter/budget/level_error.h"
#include "fitter/fit.h"
#include "fitter/gloss/gloss.h"
#include "fitter/slabs/quantise.h"
#include "fitter/slabs/shared_basis.h"
#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// One way to store a level.
struct LevelCandidate {
  enum class Kind { lobes, lobes_and_table, products, slabs, glossy_slabs };
  Kind kind = Kind::products;
  std::size_t shape = 0;  ///< of slabs: which of the fit's shapes
  Products products;      ///< of products and slabs; functions as in the shared lists
  double error = 0;       ///< mean squared error of alpha f on the validation pairs
  double bytes = 0;       ///< in the file, estimated; without the shared functions
};

struct LevelChoice {
  int width = 0;
  int height = 0;
  std::string layers;           ///< as layers_text() (fit_record.h)
  double validation_error = 0;  ///< as LevelCandidate::error
  double bytes = 0;
  std::optional<FitLevelReport> lobes;  ///< how they were fitted, where the level has them
};

struct LayerFit {
  Fabric fabric;
  std::vector<LevelChoice> levels;
  double bytes = 0;  ///< estimated, functions and overhead included
};

class LayerFitter {
 public:
  /// Fits all candidates. `heights`: of level 0, mm. Refuses what
  /// fit() refuses, heights of another size, more than 512 lights, and a header without validation pairs
  /// (samples_malformed).
  static Result<LayerFitter> create(SampleLevel samples, const SamplesHeader& header,
                                    const std::optional<HeightLayer>& heights, const PairSamples& validation,
                                    const FitOptions& options, const Progress& progress = {});

  /// The best fabric whose estimated size is within `bytes`; the smallest one where none is. `overhead`: what
  /// the file has beside the values of its layers, bytes; a first guess, for the caller to improve by what a
  /// file has shown.
  LayerFit choose(double bytes, double overhead = typical_overhead) const;
  static constexpr double typical_overhead = 12000;

  /// As those of FitResult.
  const PairSamples& training() const { return training_; }
  const Issues& warnings() const { return warnings_; }

 private:
  struct Level {
    FabricLevel paper;  ///< lobes, frame, table, opacity
    FitLevelReport report;
    FabricLevel plain;  ///< the same fitted without a table, where `paper` has one
    FitLevelReport plain_report;
    std::vector<std::optional<HeightLayer>> heights;  ///< by shape, where the level has cells enough for it
    std::optional<SlabGloss> gloss;                   ///< where slabs have lobes worth a look
    FabricLevel glossy;                               ///< that gloss as layers, lobes and frame
    std::vector<LevelCandidate> candidates;
  };
  using Chosen = std::vector<const LevelCandidate*>;  ///< by level
  LayerFitter() = default;
  /// `like`: kind, shape, and the bytes of the layers beside the products. `overlaps`: of slabs.
  void add_candidates(std::size_t level, const Products& products, const LevelCandidate& like,
                      const SlabOverlaps* overlaps);
  void add_slabs(std::size_t shape, const std::vector<SampleLevel>& pooled, const HeightLayer& heights,
                 const SamplesHeader& header, const FitOptions& options);
  void look_for_gloss(std::size_t level, const SampleLevel& samples, const SlabRays& rays,
                      std::size_t entries, const FitOptions& options);
  /// Of levels that have candidates of slabs with lobes, these alone.
  void keep_glossy_slabs();
  void judge_candidates(std::size_t level, const LevelTruth& truth, const std::vector<DirectionPair>& pairs);
  /// `shape`: of slabs; beyond the last one: lobes alone. Empty where a level has no candidate with it.
  Chosen best_of_shape(std::size_t shape, double bytes, double overhead) const;
  double size_of(const Chosen& chosen, double overhead) const;
  double cost_of(const Chosen& chosen) const;
  double bytes_of_functions(const Chosen& chosen) const;
  FabricLevel level_of(std::size_t level, const LevelCandidate& candidate) const;

  Fabric shell_;      ///< everything but the levels
  double scale_ = 1;  ///< by which samples and pairs were divided
  bool has_gloss_ = false;
  PairSamples training_;
  Issues warnings_;
  std::vector<Level> levels_;
  std::size_t shapes_ = 1;
};

}  // namespace selvedge
