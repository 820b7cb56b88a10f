// The settings that every yarn has (--set), with defaults that follow its kind (fibres.h).
#pragma once

#include <string>
#include <vector>

#include "converter/stitch/parameters.h"
#include "converter/stitch/pattern.h"

namespace selvedge {

/// Turns per mm whose outermost fibres or plies lean by this angle to the yarn, in -90 to 90.
double twist_for(double degrees, double radius_mm);

/// Spins a yarn of this kind's fibre, with its gloss and transmission; 0 (tube): only takes the fibre away.
void set_fibre(int kind, Yarn& yarn);

/// What a yarn of this kind usually is: plied for knits, single for what is woven (prefixes warp_ and weft_).
/// `yarn` has its radius; `shorter_mm` is the shorter period: hairs of a kind fit into it.
void set_kind(int kind, const std::string& prefix, double shorter_mm, Yarn& yarn);

/// Settings of a whole stitch: `yarn`, by default of this kind, `flattening`, `colour`, `seed`, `repeats`.
std::vector<StitchParameter> common_parameters(int kind = 0);

/// Parameters of one yarn, without its radius and its kind: `albedo` with this prefix, and so on.
std::vector<StitchParameter> yarn_parameters(const std::string& prefix, const Yarn& yarn);
/// Kind and flattening of the yarn with this prefix: of stitches of several yarns, beside those for all.
std::vector<StitchParameter> shared_parameters(const std::string& prefix, int kind);

/// Flattening, of what is set, else of the kind of what is woven.
void apply_flattening(const StitchValues& values, const std::string& prefix, Yarn& yarn);

/// Applies the settings with the prefix, and those of all yarns where these are not set. What the kind of
/// yarn says comes first (set_kind()).
void apply_settings(const StitchValues& values, const std::string& prefix, double shorter_mm, Yarn& yarn);

}  // namespace selvedge
