// The squared error of slabs as a function of the gloss, for given tables of one function of the view: a
// quadratic form for every view, light and channel, so that a search reads the samples once for all its
// steps.
#pragma once

#include <vector>

#include "fitter/gloss/gloss.h"
#include "format/samples/samples.h"

namespace selvedge {

/// A quadratic form in the g of all kinds, [kind][value] as returned by gloss_values().
class GlossForm {
 public:
  GlossForm(const SampleLevel& samples, const SlabRays& rays, const SlabTables& tables,
            const SlabGloss& gloss);

  double energy() const { return energy_; }  ///< sum of the squared samples
  double error(const std::vector<std::vector<double>>& g) const;
  /// For kind `a`, given the g of the others, the form is square g^2 - 2 linear g + constant.
  const std::vector<double>& square(std::size_t a) const { return square_[pair(a, a)]; }
  std::vector<double> linear(std::size_t a, const std::vector<std::vector<double>>& g) const;

 private:
  static std::size_t pair(std::size_t a, std::size_t b) {
    return a >= b ? a * (a + 1) / 2 + b : b * (b + 1) / 2 + a;
  }
  double energy_ = 0;
  std::vector<std::vector<double>> square_;  // of pairs of kinds; empty if no sample shows both
  std::vector<std::vector<double>> cross_;   // with the samples
};

/// The form in the g of one texel, given the g of all others: square g^2 - 2 linear g + constant.
struct TexelForm {
  std::vector<double> square;
  std::vector<double> linear;
};

class TexelForms {
 public:
  /// All arguments must outlive the object. `factors`: those that the tables were fitted with.
  TexelForms(const SampleLevel& samples, const SlabRays& rays, const SlabTables& tables,
             const SlabFactors& factors);
  TexelForm operator()(std::size_t texel) const;

 private:
  const SampleLevel& samples_;
  const SlabRays& rays_;
  const SlabTables& tables_;
  const SlabFactors& factors_;
  std::size_t entries_;                         // of a texel
  std::vector<std::vector<std::size_t>> rows_;  // of samples that show a texel
};

}  // namespace selvedge
