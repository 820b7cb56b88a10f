#include "converter/stitch/fibres.h"

#include <array>
#include <cmath>
#include <numbers>

namespace selvedge {
namespace {

// Diameters: wool (merino 22 to 24 um) and silk (10 to 13) from tables of fine fibres (uaf.edu/lars,
// joybilee-farm.com), flax (15 to 17) from spinnyspinny.com, cotton (12 to 20) as commonly quoted, man-made
// fibres of 1.5 denier by their density. Refractive indices: (parallel + 2 perpendicular) / 3 of the
// table in Morton and Hearle, "Physical Properties of Textile Fibres", chapter 24, as commonly quoted.
// Roughness: root 2 times the tangent of the width of the surface's lobe that Sadeghi et al. 2013 ("A
// practical microcylinder appearance model for cloth rendering") fitted to linen (12 degrees), silk (5) and
// polyester (5); of cotton, wool and viscose no fit was found: dull, scaly and bright beside those.
// Density: Morton and Hearle, chapter 5, as commonly quoted. Packing: woollen yarn 0.3 to 0.4, spun cotton
// 0.5 to 0.6 (Hearle, Grosberg and Backer 1969); values within these ranges are ours. Ashenhurst's diameter
// of a yarn, 1 / (0.9 sqrt(yards per pound)) inch, gives 0.52 to spun cotton, 0.59 to spun silk.
// Transmission: calibrated against explicit fibres (docs/yarn.md).
// Twist and lean: the range of the nine yarns that Zhao et al. 2016 fitted (32 to 45 and 17 to 25 degrees).
// Flattening: Peirce (1937, "The geometry of cloth structure", J. Text. Inst. 28) took sections of woven yarn
// as ellipses, Kemp (1958, J. Text. Inst. 49) as racetracks, commonly quoted as 0.6 to 0.8 times as thick as
// wide. Those are of finished cloth, contacts included; free yarn of the press is flatter (ours).
// PSNR from near: of the plain knit, as tests/bench/places --stitches plain-knit --set yarn=KIND has it;
// other stitches of cotton and silk have 2 to 4 dB more (docs/yarn.md). Melange: natural wool and flax have
// fibres of many shades, dyed and man-made ones of few; values are ours. Hairiness: sewing and weaving yarns
// have an H of 3 to 8; how it is spread over the fibres is ours.
constexpr std::array<YarnKind, 7> kinds{{
    {"tube", 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0.12, 1, 32.6},
    {"cotton", 16, 1.547, 0.45, 0.7, 1.52, 0.5, 2, -38, 20, 5, 1.2, 0.4, 0.06, 0.12, 0.5, 31.5},
    {"wool", 23, 1.546, 0.35, 0.75, 1.31, 0.4, 3, -35, 20, 8, 1.8, 0.3, 0.05, 0.25, 0.6, 31},
    {"silk", 12, 1.556, 0.12, 0.55, 1.34, 0.5, 2, -32, 17, 1, 0.8, 0.2, 0.02, 0.08, 0.5, 27.8},
    {"linen", 16, 1.551, 0.30, 0.65, 1.5, 0.5, 2, -32, 17, 5, 1.6, 0.1, 0.12, 0.18, 0.5, 29.9},
    {"viscose", 12, 1.526, 0.18, 0.55, 1.52, 0.5, 2, -40, 22, 4, 1.0, 0.4, 0.03, 0.1, 0.5, 29.6},
    {"polyester", 12, 1.600, 0.12, 0.6, 1.39, 0.5, 3, -32, 17, 0, 1.0, 0, 0.01, 0.08, 0.5, 28},
}};

using std::numbers::pi;

/// Fraction that a dielectric reflects of unpolarised light that falls on it at this cosine.
double fresnel(double cosine, double refraction) {
  const double sine = std::sqrt(1 - cosine * cosine) / refraction;
  const double inside = std::sqrt(1 - sine * sine);
  const double s = (cosine - refraction * inside) / (cosine + refraction * inside);
  const double p = (refraction * cosine - inside) / (refraction * cosine + inside);
  return 0.5 * (s * s + p * p);
}

/// The mean of f(x) over 0 to 1.
template <class F>
double mean(const F& f) {
  constexpr int steps = 256;
  double sum = 0;
  for (int i = 0; i < steps; ++i) sum += f((i + 0.5) / steps);
  return sum / steps;
}

}  // namespace

std::span<const YarnKind> yarn_kinds() { return kinds; }

YarnKind fibre_or_default(int kind) {
  YarnKind fibre = kinds[kind];
  if (kind == 0) {
    fibre.diameter_um = 20;
    fibre.refractive_index = 1.55;
    fibre.roughness = 0.3;
    fibre.density_g_per_cm3 = 1.4;
    fibre.packing = 0.5;
  }
  return fibre;
}

double tex_of(double radius_mm, int kind, double packing) {
  return 1000 * pi * radius_mm * radius_mm * fibre_or_default(kind).density_g_per_cm3 * packing;
}

std::optional<int> find_yarn_kind(std::string_view name) {
  for (std::size_t k = 0; k < kinds.size(); ++k)
    if (name == kinds[k].name) return static_cast<int>(k);
  return std::nullopt;
}

std::string yarn_kind_names() {
  std::string names;
  for (const YarnKind& kind : kinds) names += (names.empty() ? "" : ", ") + std::string(kind.name);
  return names;
}

double diffuse_fresnel_reflectance(double refraction) {
  return mean([&](double x) { return 2 * x * fresnel(x, refraction); });
}

double forward_transmitted_fraction(double refraction) {
  // Two refractions at the offset h from the axis turn light by 2 (asin h - asin(h / n)).
  const double limit = 15 * pi / 180;
  double low = 0;
  double high = 1;
  while (high - low > 1e-9) {
    const double h = 0.5 * (low + high);
    (2 * (std::asin(h) - std::asin(h / refraction)) < limit ? low : high) = h;
  }
  return low * mean([&](double x) {
           const double through = 1 - fresnel(std::sqrt(1 - low * low * x * x), refraction);
           return through * through;
         });
}

}  // namespace selvedge
