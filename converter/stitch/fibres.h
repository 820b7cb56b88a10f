// The fibres that yarns are spun of, and the yarns that are usually made of each: `--set yarn=wool`, and the
// member `fibre` of a stitch description (spec/stitch.md, Fibres).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace selvedge {

struct YarnKind {
  const char* name;
  // The fibre; of a tube, which has none, all are 0.
  double diameter_um;        ///< of a fibre
  double refractive_index;   ///< refractive index, mean over polarisations
  double roughness;          ///< Gloss::roughness
  double transmission;       ///< Yarn::transmission
  double density_g_per_cm3;  ///< of the fibre, g/cm3
  double packing;            ///< fraction of fibre in the section of woven yarn
  // The yarn, where nothing else is said.
  int plies;
  double twist_degrees;      ///< of the plies at the yarn's surface; negative: S-twist
  double fibre_degrees;      ///< of the fibres at a ply's surface, of the other hand
  double hairiness;          ///< mm of hair a mm of yarn (the H of Uster's testers)
  double hair_length_radii;  ///< mean length of a hair, in radii of the yarn
  double hair_loops;         ///< fraction of hairs that return into the yarn
  double irregularity;       ///< Yarn::irregularity
  double melange;            ///< Yarn::melange
  double flattening;         ///< Yarn::flattening of woven yarn where it is free
  double near_view_psnr;     ///< PSNR of the fabric drawn at the place `near` against the traced stitch
};

/// Row 0 is "tube": a smooth yarn without fibres.
std::span<const YarnKind> yarn_kinds();

/// The fibre of yarn_kinds()[kind]; hairs on a tube have a usual one.
YarnKind fibre_or_default(int kind);

/// Fraction of fibre in the section of knitting yarn, whatever its fibre (spec/stitch.md, Textile numbers).
inline constexpr double knit_packing = 0.235;

/// Yarn count in tex (g/km) of a round yarn; `packing`: fraction of fibre in its section.
double tex_of(double radius_mm, int kind, double packing);

/// Index into yarn_kinds(); nothing for other names.
std::optional<int> find_yarn_kind(std::string_view name);

/// "tube, cotton, ...", for messages.
std::string yarn_kind_names();

/// Fraction of diffuse light that the surface of a fibre reflects (Fresnel): the weight of a yarn's gloss.
double diffuse_fresnel_reflectance(double refraction);

/// Fraction of the light on a clear round fibre that continues within 15 degrees of a straight line: it
/// counts as not having met the fibre.
double forward_transmitted_fraction(double refraction);

}  // namespace selvedge
