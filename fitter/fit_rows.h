// A fit of all levels that gets its samples row by row: a row of a coarser level is pooled and fitted as soon
// as the finer rows that it overlaps are known, and no row is kept longer.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "fitter/fit.h"

namespace selvedge {

/// Fits one texel; called from several threads.
using TexelFit = std::function<std::array<ChannelFit, 3>(const TexelSamples&, const LobeFitOptions&)>;

class RowFit {
 public:
  RowFit(const SamplesHeader& header, const FitOptions& options, const Progress& progress,
         TexelFit texel_fit = fit_texel);

  /// The next rows of level 0. `rows` is of the header's width, views and lights.
  void add(SampleLevel rows) { add(0, std::move(rows)); }

  /// To be called after all rows.
  FitResult finish() { return std::move(result_); }

 private:
  struct TexelTotals;
  struct Level {
    SampleLevel waiting;  ///< rows that a coarser row still needs
    int first = 0;        ///< index of the first waiting row
    int next_coarse = 0;  ///< number of rows of the next level so far
    double error = 0;     ///< this and the next two: sums for the report
    double cost = 0;
    double energy = 0;
  };

  void add(std::size_t k, SampleLevel rows);
  void fit_texels(std::size_t k, const SampleLevel& rows, int first);
  /// Fits texel `from` of the rows into `texel` of the level.
  TexelTotals fit_row_texel(const SampleLevel& rows, std::size_t from, const LobeFitOptions& options,
                            std::size_t texel, FabricLevel& level) const;
  void report_texels(std::size_t k, const std::vector<TexelTotals>& totals);

  FitOptions options_;
  Progress progress_;
  TexelFit texel_fit_;
  TexelDirections directions_;
  std::vector<Level> levels_;
  FitResult result_;
  double texels_ = 0;  ///< of all levels
  double fitted_texels_ = 0;
};

}  // namespace selvedge
