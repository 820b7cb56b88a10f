// The best fabric for a budget of bytes: per level the set of layers with the least error on the validation
// pairs.
//
// Candidates of a level are the paper's model (lobes, with and without the view table), coefficients in a
// basis that all texels share, and, where the samples have heights, slabs with such coefficients, with and
// without lobes: of several shapes, one of which all levels share, and with coefficients coarser or finer.
// The chosen combination minimises the sum over levels of log(error) for its bytes (a Lagrange multiplier by
// bisection). The held-out pairs take no part.
#pragma once

#include <optional>
#include <vector>

#include "fitter/budget/level_error.h"
#include "fitter/fit.h"
#include "fitter/gloss/gloss.h"
#include "fitter/slabs/basis_list.h"
#include "fitter/slabs/quantise.h"
#include "fitter/slabs/shared_basis.h"
#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// One way to store a level.
struct LevelCandidate {
  enum class Kind { lobes, lobes_and_table, basis, slabs, glossy_slabs };
  Kind kind = Kind::basis;
  std::size_t shape = 0;  ///< of slabs: which of the fit's shapes
  BasisFit basis;         ///< of `basis` and slabs
  double error = 0;       ///< mean squared error of alpha f on the validation pairs
  double bytes = 0;       ///< in the file, estimated; without the shared functions
};

inline bool has_slabs(const LevelCandidate& candidate) {
  return candidate.kind == LevelCandidate::Kind::slabs ||
         candidate.kind == LevelCandidate::Kind::glossy_slabs;
}

inline bool has_basis(const LevelCandidate& candidate) {
  return has_slabs(candidate) || candidate.kind == LevelCandidate::Kind::basis;
}

struct LayerFit {
  Fabric fabric;
  std::vector<LevelReport> levels;  ///< those with lobes of the paper's model have the figures of their fit
  double bytes = 0;                 ///< of the file, estimated
};

class LayerFitter {
 public:
  /// Fits all candidates. `heights`: of level 0, mm. Refuses what
  /// fit() refuses, heights of another size, more than 512 lights, and a header without validation pairs
  /// (samples_malformed).
  static Result<LayerFitter> create(SampleLevel samples, const SamplesHeader& header,
                                    const std::optional<HeightLayer>& heights, const PairSamples& validation,
                                    const FitOptions& options, const Progress& progress = {});

  /// The best fabric whose estimated size is within `bytes`; otherwise the smallest. `overhead`:
  /// bytes of the file beside the values of its layers; a first guess, for the caller to improve by the size
  /// of a written file.
  LayerFit choose(double bytes, double overhead = typical_overhead) const;
  static constexpr double typical_overhead = 12000;

  /// As those of FitResult.
  const PairSamples& training() const { return training_; }
  const Issues& warnings() const { return warnings_; }

 private:
  struct Level {
    FabricLevel paper;  ///< lobes, frame, table, opacity
    LevelReport report;
    FabricLevel plain;  ///< the same fitted without a table, where `paper` has one
    LevelReport plain_report;
    std::vector<std::optional<HeightLayer>> heights;  ///< by shape, where the level has cells enough for it
    std::optional<SlabGloss> gloss;                   ///< where slabs have lobes worth a look
    FabricLevel glossy;                               ///< that gloss as layers, lobes and frame
    std::vector<LevelCandidate> candidates;
  };
  using Chosen = std::vector<const LevelCandidate*>;  ///< by level
  LayerFitter() = default;
  void scale_radiance(SampleLevel& samples, PairSamples& pairs);
  Result<void> fit_lobes(const SampleLevel& samples, const SamplesHeader& header, const FitOptions& options,
                         const Progress& progress);
  /// `like`: kind, shape, and the bytes of the layers beside the coefficients. `overlaps`: of slabs.
  void add_candidates(std::size_t level, const BasisFit& basis, const LevelCandidate& like,
                      const SlabOverlaps* overlaps);
  void add_texel_candidates(const std::vector<SampleLevel>& pooled);
  void add_slabs(std::size_t shape, const std::vector<SampleLevel>& pooled, HeightLayer heights,
                 const FitOptions& options);
  void look_for_gloss(std::size_t level, const SampleLevel& samples, const SlabRays& rays,
                      std::size_t entries, const FitOptions& options);
  /// Of levels that have candidates of slabs with lobes, these alone.
  void keep_glossy_slabs();
  static FabricLevel heights_alone(const Level& level, std::size_t shape);
  void measure_errors(std::size_t level, const LevelTruth& truth, const std::vector<DirectionPair>& pairs);
  /// `shape`: of slabs; beyond the last one: lobes alone. Empty where a level has no candidate with it.
  Chosen best_of_shape(std::size_t shape, double bytes, double overhead) const;
  double size_of(const Chosen& chosen, double overhead) const;
  double cost_of(const Chosen& chosen) const;
  double bytes_of_bases(const Chosen& chosen) const;
  /// `functions`: gets those of the candidate; bases are left to the caller.
  FabricLevel level_of(std::size_t level, const LevelCandidate& candidate, BasisList& functions) const;

  Fabric shell_;      ///< everything but the levels
  double scale_ = 1;  ///< by which samples and pairs were divided
  bool has_gloss_ = false;
  PairSamples training_;
  Issues warnings_;
  std::vector<Level> levels_;
  std::size_t shapes_ = 1;
};

}  // namespace selvedge
