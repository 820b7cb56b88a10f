// The paper's model with sums of products beside its table, all fitted by turns.
//
//   f(l, v) = g(l', v') max(0, T(v) S(l) + sum_m c_m phi_m(v) psi_m(l))
//
// Lobes g, T, S and the coefficients c are a texel's own; the functions phi and psi all texels of a level
// share. A turn improves each of them for given others: the lobes by a few steps of their search, all else as
// linear least squares. The cost is that of the fit without products (lobe_fit.h) plus a pull of the sum of
// the products to 0, and never rises; without max(0, .), which makes no error larger, as no radiance is
// negative.
#pragma once

#include <vector>

#include "fitter/fit.h"
#include "fitter/slabs/shared_basis.h"

namespace selvedge {

/// How the cost of a level fell: squared error and penalties, 1/sr^2, of all texels.
struct ProductTrace {
  double without = 0;         ///< of the level as it was given
  std::vector<double> costs;  ///< after every half of a turn
  double stored = 0;          ///< with functions as the file holds them
};

/// A level with products, as yet without shared bases.
struct ProductLevel {
  Products products;  ///< none where nothing is left for them
  ProductTrace trace;
};

/// Gives one level options.products products, and improves its lobes and tables; `level` and `report` are
/// those of a fit without, of these samples and options, with a radiance scale of 1. The report is made anew.
/// Same samples, same level for any number of threads.
ProductLevel fit_products(const SampleLevel& samples, const SamplesHeader& header, const FitOptions& options,
                          FabricLevel& level, FitLevelReport& report, const Progress& progress = {});

/// The same for all levels of a fit, bases included. Memory: the samples of two levels that follow each
/// other, three copies of all texels' tables, and per thread some copies of one texel's samples.
std::vector<ProductTrace> add_products(SampleLevel samples, const SamplesHeader& header,
                                       const FitOptions& options, FitResult& fit, const Progress& progress);

}  // namespace selvedge
