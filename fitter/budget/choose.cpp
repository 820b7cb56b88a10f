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

bool has_basis(const LevelCandidate& candidate) { return candidate.kind == LevelCandidate::Kind::basis; }

}  // namespace

double LayerFitter::bytes_of_bases(const Chosen& chosen) const {
  BasisList functions;
  std::size_t products = 0;
  bool lobes = false;
  bool table = false;
  for (const LevelCandidate* candidate : chosen) {
    table = table || candidate->kind == LevelCandidate::Kind::lobes_and_table;
    lobes = lobes || !has_basis(*candidate);
    if (!has_basis(*candidate)) continue;
    for (const V2i& pair : candidate->basis.pairs) functions.add(candidate->basis, pair);
    products = std::max(products, candidate->basis.pairs.size());
  }
  const FabricLevel& base = levels_.front().paper;
  double channels = static_cast<double>(products) + fabric_.views.count();  // and opacity
  if (table) channels += 3 * fabric_.views.count();
  if (lobes) channels += 6 + 3 * parameter_count(base.lobe_count());
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
  result.set(LayerKind::opacity, level.paper[LayerKind::opacity]);
  result.pairs = candidate.basis.pairs;
  result.set(LayerKind::products, {static_cast<int>(result.pairs.size()), candidate.basis.coefficient});
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

LayerFitter::Chosen LayerFitter::best(bool lobes_alone, double bytes, double overhead) const {
  const auto allowed = [&](const LevelCandidate& candidate) { return !lobes_alone || !has_basis(candidate); };
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
  Chosen chosen = best(false, bytes, overhead);
  const Chosen lobes = best(true, bytes, overhead);
  const bool fits = size_of(chosen, overhead) <= bytes;
  const bool lobes_fit = size_of(lobes, overhead) <= bytes;
  const bool better = fits ? lobes_fit && cost_of(lobes) < cost_of(chosen)
                           : size_of(lobes, overhead) < size_of(chosen, overhead);
  if (better) chosen = lobes;

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
  set_radiance_scale(result.fabric);
  result.fabric.radiance_scale *= static_cast<float>(scale_);
  return result;
}

}  // namespace selvedge
