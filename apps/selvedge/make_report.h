// Reports of bakes and fits: as text for people, as JSON for programs.
#pragma once

#include <string>

#include "apps/common/report.h"
#include "converter/make/make.h"

namespace selvedge {

/// `output`: the samples file; empty: none.
Json bake_json(const BakeReport& report, const std::string& output);
std::string bake_text(const BakeReport& report, const std::string& output);

/// `output`: the fabric file, which tells the bytes of levels and layers. Throws Failure.
Json fit_json(const FitOutcome& outcome, const std::string& output);
/// The text of fit_json().
std::string fit_text(const Json& fit);

/// The yarn of a fabric file: `curves`, `nodes`, and `bytes` of both its layers in the file; null without
/// yarn.
Json yarn_json(const FabricReader& reader);
std::string yarn_text(const Json& yarn);

}  // namespace selvedge
