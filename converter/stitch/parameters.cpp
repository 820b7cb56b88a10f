#include "converter/stitch/parameters.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <type_traits>

#include "converter/stitch/fibres.h"
#include "format/base/option_text.h"
#include "format/fabric/yarn_hairs.h"
#include "format/picture/image.h"

namespace selvedge {
namespace {

constexpr const char* colour_parameter = "colour";
constexpr const char* flattening_parameter = "flattening";

bool woven(const std::string& prefix) { return prefix == "warp_" || prefix == "weft_"; }

template <auto Member>
constexpr YarnMember member(const char* name, double min, double max, bool limits, const char* meaning) {
  using Value = std::remove_reference_t<decltype(Yarn().*Member)>;
  constexpr auto get = [](const Yarn& yarn) { return static_cast<double>(yarn.*Member); };
  constexpr auto set = [](Yarn& yarn, double value) { yarn.*Member = static_cast<Value>(value); };
  return {name, min, max, limits, meaning, get, set, std::is_integral_v<Value>};
}

template <auto Member>
constexpr YarnMember gloss_member(const char* name, double min, const char* meaning, double max = 1) {
  constexpr auto get = [](const Yarn& yarn) { return shortest_decimal(yarn.gloss.*Member); };
  constexpr auto set = [](Yarn& yarn, double value) { yarn.gloss.*Member = static_cast<float>(value); };
  return {name, min, max, false, meaning, get, set};
}

constexpr YarnMember members[] = {
    member<&Yarn::plies>("plies", 1, 8, true, "number of plies"),
    member<&Yarn::twist_per_mm>("twist_per_mm", -100, 100, false,
                                "turns per mm, Z-twist is positive; not set, it follows the radius"),
    gloss_member<&Gloss::weight>("gloss", 0, "fraction of the light that the fibres reflect"),
    gloss_member<&Gloss::roughness>("roughness", 0.01, "width of the highlight"),
    gloss_member<&Gloss::lustre>("lustre", 0, "how much the yarn's colour shines about its highlight", 0.9),
    member<&Yarn::fibre_degrees>("fibre_degrees", 0, 60, true,
                                 "lean of the fibres in a ply, of the other hand"),
    member<&Yarn::hairiness>("hairiness", 0, 100, true, "mm of hair a mm of yarn"),
    member<&Yarn::hair_mm>("hair_mm", 0, 1000, false,
                           "mean length of a hair; not set, it follows the radius"),
    member<&Yarn::hair_loops>("hair_loops", 0, 1, true, "fraction of hairs that return into the yarn"),
    member<&Yarn::irregularity>("irregularity", 0, 0.3, true, "change of thickness and colour along it"),
    member<&Yarn::melange>("melange", 0, 0.4, true, "difference of colour of its fibres"),
    member<&Yarn::marl>("marl", 0, 0.9, true, "half the lightness difference between palest and darkest ply"),
    member<&Yarn::packing>("packing", 0.05, 1, true, "fraction of fibre in its section, for weight and tex"),
    member<&Yarn::transmission>("transmission", 0, 1, true,
                                "fraction of the diffuse light that goes through the wall of a ply")};

}  // namespace

Result<StitchValues> StitchValues::create(const std::string& stitch,
                                          const std::vector<StitchParameter>& parameters,
                                          const StitchSettings& settings) {
  StitchValues values;
  values.settings_ = settings;
  for (const StitchParameter& parameter : parameters)
    values.values_[parameter.name] = parameter.default_value;
  for (const auto& [name, given] : settings) {
    const auto refuse = [&, &n = name](std::string why) {
      return fail(Code::option_out_of_range, stitch, "--set " + n, std::move(why));
    };
    const auto known = std::ranges::find(parameters, name, &StitchParameter::name);
    if (known == parameters.end()) {
      std::vector<std::string> names;
      for (const StitchParameter& parameter : parameters) names.push_back(parameter.name);
      return refuse(fmt::format("no such parameter (there are {})", fmt::join(names, ", ")));
    }
    if (given.size() != known->default_value.size())
      return refuse(fmt::format("takes {} numbers, not {}", known->default_value.size(), given.size()));
    for (const double number : given) {
      if (!(number >= known->min && number <= known->max))
        return refuse(fmt::format("must lie in {} to {}, is {}", known->min, known->max, number));
      if (known->whole && number != std::floor(number))
        return refuse(fmt::format("must be a whole number, is {}", number));
    }
    values.values_[name] = given;
  }
  return values;
}

double shortest_decimal(float value) { return std::strtod(fmt::format("{}", value).c_str(), nullptr); }

int kind_of(const StitchValues& values, const std::string& prefix) {
  const std::string own = prefix + yarn_parameter;
  const bool of_all = values.is_set(yarn_parameter) && !values.is_set(own);
  return static_cast<int>(values.number(of_all ? yarn_parameter : own));
}

std::optional<V3d> linear_colour(const std::string& colour) {
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
  if (const auto colour = linear_colour(value)) {
    settings[name] = {colour->x, colour->y, colour->z};
    return true;
  }
  const auto numbers = parse_numbers(value, ',', 1, 3);
  if (!numbers) return false;
  settings[name] = *numbers;
  return true;
}

void set_kind(int index, const std::string& prefix, double shorter_mm, Yarn& yarn) {
  const YarnKind& kind = yarn_kinds()[index];
  const bool single = woven(prefix);
  set_fibre(index, yarn);
  if (!single) yarn.packing = knit_packing;
  yarn.plies = single ? 1 : kind.plies;
  yarn.twist_per_mm = twist_of_angle(single ? kind.fibre_degrees : kind.twist_degrees, yarn.radius_mm);
  yarn.fibre_degrees = single ? 0 : kind.fibre_degrees;
  yarn.hairiness = kind.hairiness;
  // A hundredth less than fits: the period may be rounded.
  yarn.hair_mm = std::min(kind.hair_length_radii * yarn.radius_mm, 0.99 * shorter_mm / max_hair_length_ratio);
  yarn.hair_loops = kind.hair_loops;
  yarn.irregularity = kind.irregularity;
  yarn.melange = kind.melange;
}

double twist_of_angle(double degrees, double radius_mm) {
  return std::tan(degrees * std::numbers::pi / 180) / (2 * std::numbers::pi * radius_mm);
}

void set_fibre(int kind, Yarn& yarn) {
  yarn.fibre_kind = kind;
  if (kind == 0) return;
  yarn.gloss.weight = static_cast<float>(diffuse_fresnel_reflectance(yarn_kinds()[kind].refractive_index));
  yarn.gloss.roughness = static_cast<float>(yarn_kinds()[kind].roughness);
  // By explicit fibres (docs/yarn.md): the mirrored and the returned light of satin, weaves and knits.
  yarn.gloss.lustre = 1 - 1.4F * yarn.gloss.roughness;
  yarn.transmission = yarn_kinds()[kind].transmission;
  yarn.packing = yarn_kinds()[kind].packing;
}

std::vector<StitchParameter> yarn_kind_parameters(const std::string& prefix, int kind) {
  const auto last = static_cast<double>(yarn_kinds().size() - 1);
  return {{prefix + yarn_parameter, {1.0 * kind}, 0, last, "kind of yarn: " + yarn_kind_names(), true},
          {prefix + flattening_parameter,
           {1},
           shortest_decimal(min_flattening),
           1,
           "thickness over width of its section, 1: round; not set, 0.6 in knits, woven yarn's by its kind"}};
}

void apply_flattening(const StitchValues& values, const std::string& prefix, Yarn& yarn) {
  for (const std::string& name : {prefix + flattening_parameter, std::string(flattening_parameter)}) {
    if (!values.is_set(name)) continue;
    yarn.flattening = values.number(name);
    return;
  }
  if (woven(prefix)) yarn.flattening = yarn_kinds()[kind_of(values, prefix)].flattening;
}

std::vector<StitchParameter> stitch_parameters(int kind) {
  std::vector<StitchParameter> parameters = yarn_kind_parameters("", kind);
  parameters.push_back(
      {colour_parameter, {0.5, 0.5, 0.5}, 0, 1, "of all yarns: #rrggbb, or linear red, green, blue"});
  parameters.push_back({"seed", {1}, 0, max_seed, "of fibres, hairs and irregularity", true});
  parameters.push_back(
      {"repeats", {1}, 1, max_repeats, "in each direction that one cell holds, for yarn that varies", true});
  return parameters;
}

std::span<const YarnMember> yarn_members() { return members; }

std::vector<StitchParameter> yarn_parameters(const std::string& prefix, const Yarn& yarn) {
  const V3d albedo(yarn.albedo);
  std::vector<StitchParameter> parameters{
      {prefix + "albedo", {albedo.x, albedo.y, albedo.z}, 0, 1, "#rrggbb, or linear red, green, blue"}};
  for (const YarnMember& m : members)
    parameters.push_back({prefix + m.name, {m.get(yarn)}, m.min, m.max, m.meaning, m.whole});
  return parameters;
}

std::optional<double> radius_from_tex(const StitchValues& values, const std::string& prefix) {
  if (!values.is_set(prefix + "tex")) return std::nullopt;
  const int kind = kind_of(values, prefix);
  const std::string packing = prefix + "packing";
  const double tex_of_1_mm = tex_of(1, kind,
                                    values.is_set(packing) ? values.number(packing)
                                    : woven(prefix)        ? fibre_or_default(kind).packing
                                                           : knit_packing);
  return std::sqrt(values.number(prefix + "tex") / tex_of_1_mm);
}

void apply_settings(const StitchValues& values, const std::string& prefix, double shorter_mm, Yarn& yarn) {
  const bool of_its_own = values.is_set(prefix + yarn_parameter);
  const int kind = kind_of(values, prefix);
  if (of_its_own || values.is_set(yarn_parameter) || kind != 0) set_kind(kind, prefix, shorter_mm, yarn);
  for (const std::string& name : {prefix + "albedo", std::string(colour_parameter)}) {
    if (!values.is_set(name)) continue;
    const auto& albedo = values.numbers(name);
    yarn.albedo = V3f(V3d(albedo[0], albedo[1], albedo[2]));
    break;
  }
  for (const YarnMember& m : members)
    if (values.is_set(prefix + m.name)) m.set(yarn, values.number(prefix + m.name));
}

}  // namespace selvedge
