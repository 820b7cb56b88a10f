// LayerFitter::choose(): the choice among the candidates of the levels (candidates.h).
#include <algorithm>
#include <cmath>
#include <limits>

#include "fitter/budget/candidates.h"
#include "fitter/solve/radiance_scale.h"
#include "format/quality/fit_record.h"

namespace selvedge {
namespace {

/// Weight of log(error) at level 0, which near views show; 1 at the other levels.
constexpr double weight_of_level_0 = 5;
/// Bytes per channel in the file in addition to its values.
constexpr double bytes_per_channel = 30;

double weight_of(std::size_t level) { return level == 0 ? weight_of_level_0 : 1; }

/// Adds lobes of size 0 where needed, as all levels of a file must have the same number of lobes.
void pad_lobes(std::vector<FabricLevel>& levels) {
  int max_lobes = 0;
  for (const FabricLevel& level : levels) {
    if (level.has(LayerKind::lobes)) max_lobes = std::max(max_lobes, level.lobe_count());
  }
  for (FabricLevel& level : levels) {
    if (!level.has(LayerKind::lobes) || level.lobe_count() == max_lobes) continue;
    const std::size_t count = parameter_count(level.lobe_count());
    Layer padded{3 * parameter_count(max_lobes), {}};
    for (std::size_t i = 0; i < level.lobes().size(); i += count) {
      const float* parameters = &level.lobes()[i];
      padded.values.insert(padded.values.end(), parameters, parameters + count);
      for (int j = level.lobe_count(); j < max_lobes; ++j) {
        padded.values.insert(padded.values.end(), {0, 0, 0, 1});
      }
    }
    level.set(LayerKind::lobes, std::move(padded));
  }
}

}  // namespace

double LayerFitter::bytes_of_bases(const Chosen& chosen) const {
  BasisList functions;
  double channels = 0;
  double coefficients = 0;
  bool opacity = false;
  int lobes = -1;
  bool table = false;
  int entries = 0;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const LevelCandidate& candidate = *chosen[k];
    opacity = opacity || !has_slabs(candidate);
    table = table || candidate.kind == LevelCandidate::Kind::lobes_and_table;
    if (candidate.kind == LevelCandidate::Kind::glossy_slabs) {
      lobes = std::max(lobes, levels_[k].glossy.lobe_count());
    }
    if (!has_basis(candidate)) lobes = std::max(lobes, levels_[k].paper.lobe_count());
    if (has_slabs(candidate)) {
      entries = levels_[k].heights[candidate.shape]->shape.entries();
    }
    if (!has_basis(candidate)) continue;
    for (const V2i& pair : candidate.basis.pairs) functions.add(candidate.basis, pair);
    coefficients = std::max(
        coefficients, static_cast<double>(candidate.basis.coefficient.size()) / levels_[k].paper.texels());
  }
  const FabricLevel& base = levels_.front().paper;
  channels += coefficients;
  channels += 2 * entries;
  if (opacity) channels += fabric_.views.count();
  if (table) channels += 3 * fabric_.views.count();
  if (lobes >= 0) channels += 6 + 3 * parameter_count(lobes);
  if (lobes >= 0 && base.has(LayerKind::light)) channels += 3 * fabric_.lights.count();
  return functions.bytes() + bytes_per_channel * channels;
}

FabricLevel LayerFitter::level_of(std::size_t k, const LevelCandidate& candidate,
                                  BasisList& functions) const {
  const Level& level = levels_[k];
  if (candidate.kind == LevelCandidate::Kind::lobes_and_table) return level.paper;
  if (candidate.kind == LevelCandidate::Kind::lobes) return level.plain;
  FabricLevel result;
  result.width = level.paper.width;
  result.height = level.paper.height;
  if (candidate.kind == LevelCandidate::Kind::glossy_slabs) result = level.glossy;
  if (has_slabs(candidate)) result.set_heights(*level.heights[candidate.shape]);
  if (candidate.kind == LevelCandidate::Kind::basis)
    result.set(LayerKind::opacity, level.paper[LayerKind::opacity]);
  const int entries = has_slabs(candidate) ? result.cells.entries() : 1;
  result.pairs = candidate.basis.pairs;
  result.set(LayerKind::products,
             {entries * static_cast<int>(result.pairs.size()), candidate.basis.coefficient});
  for (V2i& pair : result.pairs) pair = functions.add(candidate.basis, pair);
  return result;
}

double LayerFitter::size_of(const Chosen& chosen, double overhead) const {
  double sum = overhead + bytes_of_bases(chosen);
  for (const LevelCandidate* candidate : chosen) sum += candidate->bytes;
  return sum;
}

double LayerFitter::cost_of(const Chosen& chosen) const {
  double sum = 0;
  for (std::size_t k = 0; k < chosen.size(); ++k)
    sum += weight_of(k) * std::log(std::max(chosen[k]->error, 1e-30));
  return sum;
}

LayerFitter::Chosen LayerFitter::best_of_shape(std::size_t shape, double bytes, double overhead) const {
  const auto allowed = [&](const LevelCandidate& candidate) {
    if (shape == shapes_) return !has_basis(candidate);
    return !has_slabs(candidate) || candidate.shape == shape;
  };
  for (const Level& level : levels_) {
    if (std::none_of(level.candidates.begin(), level.candidates.end(), allowed)) return {};
  }
  // For each level the candidate with the smallest log(error) + lambda * bytes.
  const auto best_at = [&](double lambda) {
    Chosen chosen;
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      const LevelCandidate* best = nullptr;
      double min_cost = std::numeric_limits<double>::infinity();
      for (const LevelCandidate& candidate : levels_[k].candidates) {
        const double cost =
            weight_of(k) * std::log(std::max(candidate.error, 1e-30)) + lambda * candidate.bytes;
        if (cost >= min_cost || !allowed(candidate)) continue;
        min_cost = cost;
        best = &candidate;
      }
      chosen.push_back(best);
    }
    return chosen;
  };
  double low = 1e-9;  // gives too large a file, unless the best candidates fit
  double high = 1e3;
  Chosen chosen = best_at(low);
  if (size_of(chosen, overhead) > bytes) {
    chosen = best_at(high);
    for (int i = 0; i < 60; ++i) {
      const double middle = std::sqrt(low * high);
      const Chosen tried = best_at(middle);
      if (size_of(tried, overhead) > bytes) {
        low = middle;
      } else {
        high = middle;
        chosen = tried;
      }
    }
  }

  // Spends the remaining bytes, step by step, on the candidate with the largest gain per byte.
  for (bool better = true; better;) {
    better = false;
    const double left = bytes - size_of(chosen, overhead);
    double best_rate = 0;
    std::size_t best_level = 0;
    const LevelCandidate* best = nullptr;
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      for (const LevelCandidate& candidate : levels_[k].candidates) {
        const double more = candidate.bytes - chosen[k]->bytes;
        const double gain = weight_of(k) * std::log(chosen[k]->error / std::max(candidate.error, 1e-30));
        if (!(gain > 0) || more > left || gain / std::max(more, 1.0) <= best_rate || !allowed(candidate)) {
          continue;
        }
        Chosen tried = chosen;
        tried[k] = &candidate;
        if (size_of(tried, overhead) > bytes) continue;
        best_rate = gain / std::max(more, 1.0);
        best_level = k;
        best = &candidate;
      }
    }
    if (best != nullptr) {
      chosen[best_level] = best;
      better = true;
    }
  }
  return chosen;
}

LayerFit LayerFitter::choose(double bytes, double overhead) const {
  Chosen chosen = best_of_shape(0, bytes, overhead);
  for (std::size_t shape = 1; shape <= shapes_; ++shape) {
    const Chosen other = best_of_shape(shape, bytes, overhead);
    if (other.empty()) continue;
    const bool fits = size_of(chosen, overhead) <= bytes;
    const bool other_fits = size_of(other, overhead) <= bytes;
    const bool better = fits ? other_fits && cost_of(other) < cost_of(chosen)
                             : size_of(other, overhead) < size_of(chosen, overhead);
    if (better) chosen = other;
  }

  LayerFit result;
  result.fabric = fabric_;
  result.bytes = size_of(chosen, overhead);
  BasisList functions;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    FabricLevel level = level_of(k, *chosen[k], functions);
    LevelReport report;
    if (!has_basis(*chosen[k]))
      report = level.has(LayerKind::table) ? levels_[k].report : levels_[k].plain_report;
    report.layers = layers_text(level);
    report.validation = std::sqrt(chosen[k]->error * scale_ * scale_);
    result.levels.push_back(std::move(report));
    result.fabric.levels.push_back(std::move(level));
  }
  const auto bases = std::make_shared<const ProductBases>(functions.bases());
  for (FabricLevel& level : result.fabric.levels) {
    if (level.has(LayerKind::products)) level.bases = bases;
  }
  pad_lobes(result.fabric.levels);
  set_radiance_scale(result.fabric);
  result.fabric.radiance_scale *= static_cast<float>(scale_);
  return result;
}

}  // namespace selvedge
