// Chooses the layers of every level, for the smallest error on the validation pairs within a budget of bytes.
//
// Candidates of a level are the paper's model (lobes, with and without the view table), coefficients in a
// basis that all texels share, and, if the samples have heights, slabs with these coefficients, with and
// without lobes: in several shapes, one of which all levels share, and with several steps of quantisation.
// The chosen combination minimises the sum over levels of log(error) for its bytes (a Lagrange multiplier by
// bisection). The held-out pairs are not used.
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
  std::size_t shape = 0;  ///< of slabs: index among the fit's shapes
  BasisFit basis;         ///< of `basis` and slabs
  double error = 0;       ///< mean squared error of alpha f on the validation pairs
  double bytes = 0;       ///< estimated size in the file, without the shared functions
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
  std::vector<LevelReport> levels;  ///< levels with the paper's model have the figures of their fit
  double bytes = 0;                 ///< estimated size of the file
};

class LayerFitter {
 public:
  /// Fits all candidates. `heights`: of level 0, mm. Errors are those of fit(), OPTION_OUT_OF_RANGE for more
  /// than 512 lights, and SAMPLES_MALFORMED for heights of another size or without validation pairs.
  static Result<LayerFitter> create(SampleLevel samples, const SamplesHeader& header,
                                    const std::optional<HeightLayer>& heights, const PairSamples& validation,
                                    const FitOptions& options, const Progress& progress = {});

  /// The best fabric with an estimated size of at most `bytes`, or else the smallest. `overhead`: bytes of
  /// the file beside the values of its layers, which the caller can correct by the size of a written file.
  LayerFit choose(double bytes, double overhead = typical_overhead) const;
  static constexpr double typical_overhead = 12000;

  /// As in FitResult.
  const PairSamples& training() const { return training_; }
  const Issues& warnings() const { return warnings_; }

 private:
  struct Level {
    FabricLevel paper;  ///< lobes, frame, table, opacity
    LevelReport report;
    FabricLevel plain;  ///< fitted without a table; the same as `paper` if that has no table
    LevelReport plain_report;
    std::vector<std::optional<HeightLayer>> heights;  ///< by shape; empty if the level has too few cells
    std::optional<SlabGloss> gloss;                   ///< if lobes lower the error of slabs enough
    FabricLevel glossy;                               ///< the gloss as layers: lobes and frame
    std::vector<LevelCandidate> candidates;
  };
  using Chosen = std::vector<const LevelCandidate*>;  ///< by level
  LayerFitter() = default;
  void scale_radiance(SampleLevel& samples, PairSamples& pairs);
  Result<void> fit_lobes(const SampleLevel& samples, const SamplesHeader& header, const FitOptions& options,
                         const Progress& progress);
  /// `prototype`: kind, shape, and bytes of the other layers than coefficients. `overlaps`: null without
  /// slabs.
  void add_candidates(std::size_t level, const BasisFit& basis, const LevelCandidate& prototype,
                      const SlabOverlaps* overlaps);
  void add_texel_candidates(const std::vector<SampleLevel>& pooled);
  void add_slabs(std::size_t shape, const std::vector<SampleLevel>& pooled, HeightLayer heights,
                 const FitOptions& options);
  void fit_gloss(std::size_t level, const SampleLevel& samples, const SlabRays& rays, std::size_t entries,
                 const FitOptions& options);
  /// Removes the other candidates of levels that have slabs with lobes.
  void keep_glossy_slabs();
  static FabricLevel heights_alone(const Level& level, std::size_t shape);
  void measure_errors(std::size_t level, const LevelTruth& truth, const std::vector<DirectionPair>& pairs);
  /// `shape`: of slabs; shapes_ stands for lobes alone. Empty if a level has no candidate with this shape.
  Chosen best_of_shape(std::size_t shape, double bytes, double overhead) const;
  double size_of(const Chosen& chosen, double overhead) const;
  double cost_of(const Chosen& chosen) const;
  double bytes_of_bases(const Chosen& chosen) const;
  /// Adds the functions of the candidate to `functions`; the caller sets the bases.
  FabricLevel level_of(std::size_t level, const LevelCandidate& candidate, BasisList& functions) const;

  Fabric fabric_;     ///< without levels
  double scale_ = 1;  ///< samples and pairs were divided by it
  bool has_gloss_ = false;
  PairSamples training_;
  Issues warnings_;
  std::vector<Level> levels_;
  std::size_t shapes_ = 1;
};

}  // namespace selvedge
