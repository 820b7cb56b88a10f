#include "converter/stitch/parameters.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "format/base/option_text.h"

namespace selvedge {

Result<StitchValues> StitchValues::create(const std::string& stitch,
                                          const std::vector<StitchParameter>& parameters,
                                          const StitchSettings& settings) {
  StitchValues values;
  values.settings_ = settings;
  for (const StitchParameter& parameter : parameters) values.values_[parameter.name] = parameter.value;
  for (const auto& [name, given] : settings) {
    const auto refuse = [&, &n = name](std::string why) {
      return fail(Code::option_out_of_range, stitch, "--set " + n, std::move(why));
    };
    const StitchParameter* known = nullptr;
    std::string names;
    for (const StitchParameter& parameter : parameters) {
      if (parameter.name == name) known = &parameter;
      names += (names.empty() ? "" : ", ") + parameter.name;
    }
    if (known == nullptr) {
      return refuse(names.empty() ? "it has no parameters" : "no such parameter (there are " + names + ")");
    }
    if (given.size() != known->value.size()) {
      return refuse(fmt::format("takes {} numbers, not {}", known->value.size(), given.size()));
    }
    for (const double number : given) {
      if (!(number >= known->min && number <= known->max)) {
        return refuse(fmt::format("must lie in {} to {}, is {}", known->min, known->max, number));
      }
      if (known->whole && number != std::floor(number)) {
        return refuse(fmt::format("must be a whole number, is {}", number));
      }
    }
    values.values_[name] = given;
  }
  return values;
}

double shortest(float value) { return std::strtod(fmt::format("{}", value).c_str(), nullptr); }

bool parse_setting(const std::string& text, StitchSettings& settings) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) return false;
  const auto numbers = parse_numbers(text.substr(equals + 1), ',', 1, 3);
  if (!numbers) return false;
  settings[text.substr(0, equals)] = *numbers;
  return true;
}

}  // namespace selvedge
