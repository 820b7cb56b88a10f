#include "fitter/solve/radiance_scale.h"

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

/// Calls `on_rho` and `on_lobe` with every diffuse term and every lobe's four parameters.
template <class T, class OnRho, class OnLobe>
void for_all(std::span<T> lobes, int count, OnRho on_rho, OnLobe on_lobe) {
  const int stride = parameter_count(count);
  for (std::size_t i = 0; i < lobes.size(); i += stride) {
    on_rho(lobes[i]);
    for (std::size_t j = i + 1; j < i + stride; j += 4) on_lobe(&lobes[j]);
  }
}

/// The maximum of a lobe over all pairs of directions of the hemisphere, without the cosine:
/// max(|cx|, |cy|, cz, 0)^n. The base is a bilinear form with a diagonal matrix, so its maximum over unit
/// vectors is the largest entry; -cz would need a light or a view below the horizon.
double lobe_peak(const float* lobe) {
  const float base = std::max({std::abs(lobe[0]), std::abs(lobe[1]), lobe[2], 0.0F});
  return base > 0 ? std::pow(static_cast<double>(base), static_cast<double>(lobe[3])) : 0;
}

/// Divides f by `scale`; does not change the fabric's scale.
void divide(Fabric& fabric, double scale) {
  const auto inverse = static_cast<float>(1 / scale);
  for (FabricLevel& level : fabric.levels) {
    if (level.has(LayerKind::lobes))
      for_all(
          level.lobes(), level.lobe_count(), [&](float& rho) { rho *= inverse; },
          [&](float* lobe) {
            const double factor = std::pow(scale, -1 / static_cast<double>(lobe[3]));
            for (int k = 0; k < 3; ++k) lobe[k] = static_cast<float>(static_cast<double>(lobe[k]) * factor);
          });
    // In levels with lobes, products are a factor on them.
    if (level.has(LayerKind::lobes)) continue;
    for (float& c : level.coefficients()) c *= inverse;
  }
}

}  // namespace

double choose_radiance_scale(double largest) {
  constexpr double min = 0x1p-8;
  constexpr double max = 0x1p12;
  if (!(largest > 0) || !std::isfinite(largest) || (largest >= min && largest <= max)) return 1;
  // Clamped, so that the reciprocal is a normal number, too.
  return std::exp2(std::clamp(std::round(std::log2(largest)), -120.0, 120.0));
}

void set_radiance_scale(Fabric& fabric) {
  double largest = 0;
  for (const FabricLevel& level : fabric.levels)
    for_all(
        level.lobes(), level.lobe_count(),
        [&](float rho) { largest = std::max(largest, static_cast<double>(rho)); },
        [&](const float* lobe) { largest = std::max(largest, lobe_peak(lobe)); });
  const double scale = choose_radiance_scale(largest);
  if (scale == 1) return;
  divide(fabric, scale);
  fabric.radiance_scale = static_cast<float>(scale);
}

void remove_radiance_scale(Fabric& fabric) {
  if (fabric.radiance_scale == 1) return;
  divide(fabric, 1 / static_cast<double>(fabric.radiance_scale));
  fabric.radiance_scale = 1;
}

}  // namespace selvedge
