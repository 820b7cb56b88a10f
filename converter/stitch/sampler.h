// Charts and drafts that are made of a sampler (arrange.h).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "converter/stitch/arrange.h"
#include "converter/stitch/parameters.h"
#include "converter/stitch/pattern.h"

namespace selvedge {

/// Fractions of the length of each yarn of a knit at which its parts begin.
std::vector<std::vector<double>> part_begins_of(const StitchPattern& pattern,
                                                const std::vector<std::vector<KnitPart>>& parts);

/// The arrangement of a chart or draft of so many stitches, if it is made of a sampler. Throws Failure where
/// that is asked for and cannot be, or where it is too large without.
std::optional<Arrangement> arranged(const std::optional<StitchGrid>& grid, std::size_t stitches,
                                    const KindLimit& kinds, const StitchSettings& settings,
                                    const std::string& path);

/// The settings of a chart for its sampler, whose floats are not caught: a size is a part of the cloth's.
void fit_settings(const YarnMap& map, StitchSettings& settings);

/// One line.
std::string remark_on(const Arrangement& arranged);

/// Makes plies turn on by whole ones over each stitch of a sampler, so that they run on where it is shown.
void turn_by_stitch(const StitchGrid& sampler, StitchPattern& pattern);

}  // namespace selvedge
