// Parameters of a stitch and their values (--set name=value).
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"

namespace selvedge {

struct StitchParameter {
  std::string name;
  std::vector<double> value;  ///< the default: one number, or three for a colour
  double min = 0;             ///< range of every number
  double max = 1;
  bool whole = false;   ///< whole numbers only
  std::string meaning;  ///< one line
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
double shortest(float value);

/// "#rrggbb", sRGB-coded, as linear red, green, blue; nothing for other texts.
std::optional<V3d> linear_of(const std::string& colour);

/// Reads "name=1.5", "name=0.5,0.4,0.3", "name=#aa3322" and "yarn=wool" (also "warp_yarn=wool": whatever ends
/// in "yarn" has the name of a kind); false for anything else.
bool parse_setting(const std::string& text, StitchSettings& settings);

}  // namespace selvedge
