#include "converter/stitch/yarn_settings.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "converter/stitch/fibres.h"
#include "format/fabric/yarn_hairs.h"

namespace selvedge {
namespace {

constexpr const char* colour_parameter = "colour";
constexpr const char* flattening_parameter = "flattening";

bool woven(const std::string& prefix) { return prefix == "warp_" || prefix == "weft_"; }

int kind_of(const StitchValues& values, const std::string& prefix) {
  const std::string own = prefix + yarn_parameter;
  const bool of_all = values.is_set(yarn_parameter) && !values.is_set(own);
  return static_cast<int>(values.number(of_all ? yarn_parameter : own));
}

}  // namespace

void set_kind(int index, const std::string& prefix, double shorter_mm, Yarn& yarn) {
  const YarnKind& kind = yarn_kinds()[index];
  const bool single = woven(prefix);
  set_fibre(index, yarn);
  yarn.plies = single ? 1 : kind.plies;
  yarn.twist_per_mm = twist_for(single ? kind.fibre_degrees : kind.twist_degrees, yarn.radius_mm);
  yarn.fibre_degrees = single ? 0 : kind.fibre_degrees;
  yarn.hairiness = kind.hairiness;
  // A hundredth less than what fits: the period may be rounded.
  yarn.hair_mm = std::min(kind.hair_radii * yarn.radius_mm, 0.99 * shorter_mm / max_hair);
  yarn.hair_loops = kind.hair_loops;
  yarn.irregularity = kind.irregularity;
}

double twist_for(double degrees, double radius_mm) {
  return std::tan(degrees * std::numbers::pi / 180) / (2 * std::numbers::pi * radius_mm);
}

void set_fibre(int kind, Yarn& yarn) {
  yarn.fibre = kind;
  if (kind == 0) return;
  yarn.gloss.weight = static_cast<float>(surface_reflectance(yarn_kinds()[kind].refraction));
  yarn.gloss.roughness = static_cast<float>(yarn_kinds()[kind].roughness);
  yarn.transmission = yarn_kinds()[kind].transmission;
}

std::vector<StitchParameter> shared_parameters(const std::string& prefix, int kind) {
  return {{prefix + yarn_parameter,
           {static_cast<double>(kind)},
           0,
           static_cast<double>(yarn_kinds().size() - 1),
           true,
           "what it is made of: " + yarn_kind_names()},
          {prefix + flattening_parameter,
           {1},
           shortest(min_flattening),
           1,
           false,
           "thickness over width of its section, 1: round; that of woven yarn follows what it is made of"}};
}

void apply_flattening(const StitchValues& values, const std::string& prefix, Yarn& yarn) {
  for (const std::string& name : {prefix + flattening_parameter, std::string(flattening_parameter)}) {
    if (!values.is_set(name)) continue;
    yarn.flattening = values.number(name);
    return;
  }
  if (woven(prefix)) yarn.flattening = yarn_kinds()[kind_of(values, prefix)].flattening;
}

std::vector<StitchParameter> common_parameters(int kind) {
  std::vector<StitchParameter> parameters = shared_parameters("", kind);
  const std::vector<StitchParameter> others{
      {colour_parameter, {0.5, 0.5, 0.5}, 0, 1, false, "of all yarns: #rrggbb, or linear red, green, blue"},
      {"seed", {1}, 0, max_seed, true, "of fibres, hairs and irregularity"},
      {"repeats", {1}, 1, max_repeats, true, "in each direction that one cell holds, for yarn that varies"}};
  parameters.insert(parameters.end(), others.begin(), others.end());
  return parameters;
}

std::vector<StitchParameter> yarn_parameters(const std::string& prefix, const Yarn& yarn) {
  const auto parameter = [&](const char* name, double value, double min, double max, const char* meaning) {
    return StitchParameter{prefix + name, {value}, min, max, false, meaning};
  };
  const V3d albedo(yarn.albedo);
  const StitchLimits limits;
  StitchParameter plies =
      parameter("plies", yarn.plies, 1, limits.plies, "thinner yarns that it is twisted of");
  plies.whole = true;
  return {
      {prefix + "albedo", {albedo.x, albedo.y, albedo.z}, 0, 1, false, "#rrggbb, or linear red, green, blue"},
      plies,
      parameter("twist_per_mm", yarn.twist_per_mm, -100, 100,
                "turns per mm, Z-twist is positive; not set, it follows the radius"),
      parameter("gloss", shortest(yarn.gloss.weight), 0, 1, "share of the light that the fibres reflect"),
      parameter("roughness", shortest(yarn.gloss.roughness), 0.01, 1, "width of the highlight"),
      parameter("fibre_degrees", yarn.fibre_degrees, 0, limits.fibre_degrees,
                "lean of the fibres in a ply, of the other hand"),
      parameter("hairiness", yarn.hairiness, 0, limits.hairiness, "mm of hair a mm of yarn"),
      parameter("hair_mm", yarn.hair_mm, 0, 1000, "mean length of a hair; not set, it follows the radius"),
      parameter("hair_loops", yarn.hair_loops, 0, 1, "share of hairs that return into the yarn"),
      parameter("irregularity", yarn.irregularity, 0, limits.irregularity,
                "change of thickness and colour along it"),
      parameter("transmission", yarn.transmission, 0, 1,
                "share of the diffuse light that goes through the wall of a ply")};
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
  const auto set = [&](const char* name, auto& target) {
    using Target = std::remove_reference_t<decltype(target)>;
    if (values.is_set(prefix + name)) target = static_cast<Target>(values.number(prefix + name));
  };
  set("plies", yarn.plies);
  set("twist_per_mm", yarn.twist_per_mm);
  set("gloss", yarn.gloss.weight);
  set("roughness", yarn.gloss.roughness);
  set("fibre_degrees", yarn.fibre_degrees);
  set("hairiness", yarn.hairiness);
  set("hair_mm", yarn.hair_mm);
  set("hair_loops", yarn.hair_loops);
  set("irregularity", yarn.irregularity);
  set("transmission", yarn.transmission);
}

}  // namespace selvedge
