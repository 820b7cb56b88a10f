// Reports of bakes and fits: as text for people, as JSON for programs.
#pragma once

#include <string>

#include "apps/common/report.h"
#include "converter/make/make.h"

namespace selvedge {

/// `output`: the samples file; empty: none.
Json bake_json(const BakeReport& report, const std::string& output);
/// The text of bake_json().
std::string bake_text(const Json& bake);

/// `output`: the fabric file, which tells the bytes of levels and layers. Throws Failure.
Json fit_json(const FitOutcome& outcome, const std::string& output);
/// The text of fit_json().
std::string fit_text(const Json& fit);

}  // namespace selvedge
