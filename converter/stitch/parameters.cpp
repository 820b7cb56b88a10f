#include "converter/stitch/parameters.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>

#include "converter/stitch/fibres.h"
#include "format/base/option_text.h"
#include "format/picture/image.h"

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

std::optional<V3d> linear_of(const std::string& colour) {
  if (colour.size() != 7 || colour[0] != '#') return std::nullopt;
  V3d linear;
  for (int i = 0; i < 3; ++i) {
    const char* const end = &colour[3 + 2 * i];
    int byte = 0;
    const auto read = std::from_chars(end - 2, end, byte, 16);
    if (read.ec != std::errc() || read.ptr != end || colour[1 + 2 * i] == '-') return std::nullopt;
    linear[i] = static_cast<double>(srgb_to_linear(static_cast<float>(byte) / 255));
  }
  return linear;
}

bool parse_setting(const std::string& text, StitchSettings& settings) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) return false;
  const std::string name = text.substr(0, equals);
  const std::string value = text.substr(equals + 1);
  if (name.ends_with(yarn_parameter)) {
    const auto kind = find_yarn_kind(value);
    if (!kind) return false;
    settings[name] = {static_cast<double>(*kind)};
    return true;
  }
  if (const auto colour = linear_of(value)) {
    settings[name] = {colour->x, colour->y, colour->z};
    return true;
  }
  const auto numbers = parse_numbers(value, ',', 1, 3);
  if (!numbers) return false;
  settings[name] = *numbers;
  return true;
}

}  // namespace selvedge
