// The units of a bake, which are computed independently: a view, a pair of directions, or the yarns.
#pragma once

#include <variant>

#include "converter/bake/bake.h"
#include "converter/bake/setup.h"
#include "converter/bake/texels.h"

namespace selvedge {

struct BakeUnit {
  enum class Kind { view, pair, yarns };
  Kind kind = Kind::view;
  PairKind pairs = PairKind::validation;  ///< of a pair
  std::size_t index = 0;                  ///< of the view, or of the pair within its kind
};

/// Views first, then the pairs of each kind, then the yarns.
std::vector<BakeUnit> units_of(const SamplesHeader& header);

/// curve_values() and indirect_values().
struct YarnSamples {
  std::vector<float> curves;
  std::vector<float> indirect;
  std::vector<float> through;  ///< empty unless both sides are baked
};
using UnitSamples = std::variant<ViewSamples, PairSamples, YarnSamples>;

/// The number of values of a unit.
std::size_t value_count(const SamplesHeader& header, const BakeUnit& unit);
/// Samples of the unit's size, filled with zeros.
UnitSamples blank_samples(const SamplesHeader& header, const BakeUnit& unit);

/// The arrays of a unit's samples in the order of the journal.
using Planes = std::vector<std::span<float>>;
Planes planes_of(UnitSamples& samples);

/// Refuses what a reader of the file would; the error of a unit that is at fault names no file.
Result<void> write_unit(SamplesWriter& writer, const SamplesHeader& header, const BakeUnit& unit,
                        const UnitSamples& samples);

/// Computes units. The first view also computes the indirect light that all views share.
class UnitBaker {
 public:
  /// Without `cache`, indirect light is traced along paths. `yarns` are those of the cell, with heights above
  /// its lowest point; `plane_mm` is the height of the reference plane. Cell and yarns must outlive the
  /// baker.
  UnitBaker(const TracedCell& cell, const YarnData& yarns, std::optional<IrradianceCache> cache,
            const BakeOptions& options, const SamplesHeader& header, double plane_mm);

  /// `samples`: rays per texel.
  UnitSamples bake(const BakeUnit& unit, int samples, NoiseSum& noise);

  std::uint64_t rays() const { return baker_.rays() + (cache_ ? cache_->rays() : 0); }

 private:
  ViewSamples bake_view(std::size_t index, int samples, NoiseSum& noise);
  /// Pairs may come in any order; the indirect light of neighbouring indices is computed together.
  PairSamples bake_pair(PairKind kind, std::size_t index, int samples, NoiseSum& noise);
  void solve_for_pairs(PairKind kind, std::size_t index);

  const TracedCell& cell_;
  const YarnData& yarns_;
  BakeOptions options_;
  SamplesHeader header_;
  std::vector<V3f> views_;
  std::vector<V3f> lights_;
  std::optional<IrradianceCache> cache_;
  TexelBaker baker_;
  std::vector<float> irradiance_;       ///< of the grid's lights
  std::vector<float> pair_irradiance_;  ///< of the current block of pairs of one kind
  PairKind solved_kind_ = PairKind::validation;
  std::size_t solved_first_ = 0;
};

}  // namespace selvedge
