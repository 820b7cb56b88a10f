// The fit of a fabric to radiance samples (Daubert et al. 2001, section 5).
//
// Lobes and view table are fitted together, per texel and colour channel (lobe_fit.h); every mip level is
// fitted to its pooled samples (pool.h), not averaged from the finer level's parameters.
#pragma once

#include <array>
#include <functional>

#include "fitter/lobes/lobe_fit.h"
#include "format/base/progress.h"
#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// Fits one texel; called from several threads.
using TexelFit = std::function<std::array<ChannelFit, 3>(const TexelSamples&, const FitOptions&)>;

/// Fits all levels down to 1 x 1. The result does not depend on the number of threads, and is finite. A texel
/// that is a hole from every view becomes black with T = 1 and alpha 0. Lobes and tables are fitted to the
/// grids, and if there are `measured` pairs, then to these. SAMPLES_MALFORMED unless the samples have the
/// sizes of the header.
Result<Fabric> fit(const SampleLevel& samples, const SamplesHeader& header, const FitOptions& options = {},
                   const Progress& progress = {}, const PairSamples& measured = {},
                   const TexelFit& texel_fit = fit_texel);

/// Refits lobes and view tables of all levels to `measured`, whose pairs may lie anywhere. The fabric holds
/// the fit to grids that were interpolated between these pairs, with this number of lights; the search begins
/// there, and entries of tables that the pairs leave open stay near it. Texels with fewer pairs than unknowns
/// (parameters and entries of the table of a channel), or with more than 300 unknowns, stay as they are. The
/// radiance scale of the fabric is 1. The result does not depend on the number of threads, and is finite.
/// Memory: 16 bytes a pair and texel.
void refit_to_pairs(Fabric& fabric, const PairSamples& measured, int lights, const FitOptions& options);

}  // namespace selvedge
