// Parameters of a stitch and their values (--set name=value), and the parameters that every yarn has, whose
// defaults follow its kind (fibres.h).
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "converter/stitch/pattern.h"

namespace selvedge {

struct StitchParameter {
  std::string name;
  std::vector<double> default_value;  ///< the default: one number, or three for a colour
  double min = 0;                     ///< range of every number
  double max = 1;
  std::string meaning;  ///< one line
  bool whole = false;   ///< whole numbers only
};

/// Least and greatest length that a stitch is given in.
constexpr double min_stitch_mm = 0.001;
constexpr double max_stitch_mm = 1000;

/// The kind of yarn: a parameter whose number is an index into yarn_kinds() and is given as a name.
constexpr const char* yarn_parameter = "yarn";

/// Name -> numbers from the user.
using StitchSettings = std::map<std::string, std::vector<double>>;

/// The value of every parameter: the setting, else the default.
class StitchValues {
 public:
  /// Refuses (option_out_of_range, place "--set name") unknown names, values of the wrong length and values
  /// out of range. `stitch` is for the message.
  static Result<StitchValues> create(const std::string& stitch,
                                     const std::vector<StitchParameter>& parameters,
                                     const StitchSettings& settings);

  /// Precondition: `name` is a parameter.
  double number(const std::string& name) const { return values_.at(name).front(); }
  const std::vector<double>& numbers(const std::string& name) const { return values_.at(name); }
  bool is_set(const std::string& name) const { return settings_.contains(name); }

 private:
  StitchSettings values_;
  StitchSettings settings_;
};

/// The double with the shortest decimal form that is the same float: 0.1F becomes 0.1, not 0.10000000149.
double shortest_decimal(float value);

/// "#rrggbb", sRGB-coded, as linear red, green, blue; nothing for other texts.
std::optional<V3d> linear_colour(const std::string& colour);

/// Reads "name=1.5", "name=0.5,0.4,0.3", "name=#aa3322" and "yarn=wool" (also "warp_yarn=wool": a name that
/// ends in "yarn" takes a kind); false for anything else.
bool parse_setting(const std::string& text, StitchSettings& settings);

/// A number of a yarn that is a parameter and a member of a stitch description by the same name.
struct YarnMember {
  const char* name;
  double min;  ///< of the parameter
  double max;
  bool is_enforced_in_patterns;  ///< the range holds for every pattern
  const char* meaning;
  double (*get)(const Yarn&);
  void (*set)(Yarn&, double);
  bool whole = false;
};
std::span<const YarnMember> yarn_members();

/// Turns per mm whose outermost fibres or plies lean by this angle to the yarn, in -90 to 90.
double twist_of_angle(double degrees, double radius_mm);

/// Spins a yarn of this kind's fibre, with its gloss and transmission; 0 (tube): only takes the fibre away.
void set_fibre(int kind, Yarn& yarn);

/// Gives the usual settings of this kind: plied for knits, single for woven yarn (prefixes warp_ and weft_).
/// `yarn` has its radius; `shorter_mm` is the shorter period: hairs of a kind fit into it.
void set_kind(int kind, const std::string& prefix, double shorter_mm, Yarn& yarn);

/// Settings of a whole stitch: `yarn`, by default of this kind, `flattening`, `colour`, `seed`, `repeats`.
std::vector<StitchParameter> stitch_parameters(int kind = 0);

/// Parameters of one yarn, without its radius and its kind: `albedo` with this prefix, and so on.
std::vector<StitchParameter> yarn_parameters(const std::string& prefix, const Yarn& yarn);
/// Kind and flattening of the yarn with this prefix: of stitches of several yarns, beside those for all.
std::vector<StitchParameter> yarn_kind_parameters(const std::string& prefix, int kind);

/// Flattening: the setting, else the default of the woven yarn's kind.
void apply_flattening(const StitchValues& values, const std::string& prefix, Yarn& yarn);

/// Kind of the yarn with this prefix: an index into yarn_kinds().
int kind_of(const StitchValues& values, const std::string& prefix);

/// Radius of the yarn with this prefix by its count (`tex`, `packing` and kind), where that is set.
std::optional<double> radius_from_tex(const StitchValues& values, const std::string& prefix);

/// Applies the kind of yarn first (set_kind()), then the settings with the prefix, or else the settings of
/// all yarns.
void apply_settings(const StitchValues& values, const std::string& prefix, double shorter_mm, Yarn& yarn);

}  // namespace selvedge
