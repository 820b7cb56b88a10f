// The squared error of slabs as a function of the gloss, for given tables of one function of the view: a
// quadratic form for every view, light and channel. So a search looks at the samples once for all its steps.
#pragma once

#include <vector>

#include "fitter/gloss/gloss.h"
#include "format/samples/samples.h"

namespace selvedge {

/// Over the g of all kinds, [kind][value] as gloss_values() has them.
class GlossForm {
 public:
  GlossForm(const SampleLevel& samples, const SlabRays& rays, const SlabTables& tables,
            const SlabGloss& gloss);

  double energy() const { return energy_; }  ///< sum of the squared samples
  double error(const std::vector<std::vector<double>>& g) const;
  /// Sum over samples of the squared factor on the g of kind `a`.
  const std::vector<double>& square(std::size_t a) const { return square_[pair(a, a)]; }
  /// The linear part for kind `a`, given the others: the form in its g alone is square g^2 - 2 rest g.
  std::vector<double> rest(std::size_t a, const std::vector<std::vector<double>>& g) const;

 private:
  static std::size_t pair(std::size_t a, std::size_t b) {
    return a >= b ? a * (a + 1) / 2 + b : b * (b + 1) / 2 + a;
  }
  double energy_ = 0;
  std::vector<std::vector<double>> square_;  // of pairs of kinds; empty where no sample shows both
  std::vector<std::vector<double>> cross_;   // with the samples
};

/// The same of one texel, for given g of all others.
struct TexelForm {
  std::vector<double> square;
  std::vector<double> rest;
};

class TexelForms {
 public:
  /// All must outlive it. `factors`: those the tables were fitted with.
  TexelForms(const SampleLevel& samples, const SlabRays& rays, const SlabTables& tables,
             const SlabFactors& factors);
  TexelForm operator()(std::size_t texel) const;

 private:
  const SampleLevel& samples_;
  const SlabRays& rays_;
  const SlabTables& tables_;
  const SlabFactors& factors_;
  std::size_t entries_;                         // of a texel
  std::vector<std::vector<std::size_t>> rows_;  // of samples in which a texel is seen
};

}  // namespace selvedge
