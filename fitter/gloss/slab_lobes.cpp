#include "fitter/gloss/slab_lobes.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "fitter/gloss/search.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

using Values = std::vector<double>;

/// Unit mean normals of the texels; the cloth's for texels that mostly face away from lights or are never
/// seen.
std::vector<V3d> mean_normals(const SampleLevel& samples) {
  std::vector<V3d> normals;
  for (const V3f& sum : samples.normal) {
    const V3d n(sum);
    normals.push_back(n.z > 0.5 * n.length() ? n.normalized() : V3d(0, 0, 1));
  }
  return normals;
}

/// The nearest centre of each point, and the point that is farthest from its centre.
struct Assignment {
  std::vector<std::uint16_t> kind_of;
  std::size_t farthest = 0;
  double distance = 0;  // squared distance of the farthest point
};

Assignment assign(const std::vector<V3d>& points, const std::vector<V3d>& centres) {
  Assignment result;
  for (std::size_t t = 0; t < points.size(); ++t) {
    std::size_t nearest = 0;
    for (std::size_t k = 1; k < centres.size(); ++k) {
      if ((points[t] - centres[k]).length2() < (points[t] - centres[nearest]).length2()) nearest = k;
    }
    result.kind_of.push_back(static_cast<std::uint16_t>(nearest));
    const double distance = (points[t] - centres[nearest]).length2();
    if (distance <= result.distance) continue;
    result.distance = distance;
    result.farthest = t;
  }
  return result;
}

V3d tangent_along(const V3d& normal, double angle) {
  const V3d along(std::cos(angle), std::sin(angle), 0);
  return (along - normal * along.dot(normal)).normalized();
}

/// Clusters texels by their mean normals: Lloyd's algorithm, from the points farthest apart.
SlabGloss kinds_of_normals(const SampleLevel& samples, int max_kinds) {
  constexpr double min_distance = 1e-3;
  constexpr int passes = 20;
  const std::vector<V3d> normals = mean_normals(samples);
  std::vector<V3d> centres{V3d(0, 0, 1)};
  Assignment found = assign(normals, centres);
  while (std::ssize(centres) < max_kinds && found.distance > min_distance) {
    centres.push_back(normals[found.farthest]);
    found = assign(normals, centres);
  }
  for (int pass = 0; pass < passes; ++pass) {
    std::vector<V3d> sums(centres.size(), V3d(0, 0, 0));
    for (std::size_t t = 0; t < normals.size(); ++t) sums[found.kind_of[t]] += normals[t];
    for (std::size_t k = 0; k < centres.size(); ++k) {
      if (sums[k].length() > 0) centres[k] = sums[k].normalized();
    }
    found = assign(normals, centres);
  }
  SlabGloss gloss;
  gloss.kind_of = found.kind_of;
  for (const V3d& normal : centres) {
    GlossKind kind;
    kind.normal = normal;
    kind.tangent = tangent_along(normal, 0);
    gloss.kinds.push_back(kind);
  }
  return gloss;
}

/// Decrease of a texel's error from a diffuse term alone to a diffuse term and a lobe.
double gain_of(const TexelForm& form, const Values& diffuse, const Values& lobe) {
  double dd = 0;
  double dl = 0;
  double ll = 0;
  double dr = 0;
  double lr = 0;
  for (std::size_t i = 0; i < diffuse.size(); ++i) {
    dd += form.square[i] * diffuse[i] * diffuse[i];
    dl += form.square[i] * diffuse[i] * lobe[i];
    ll += form.square[i] * lobe[i] * lobe[i];
    dr += form.linear[i] * diffuse[i];
    lr += form.linear[i] * lobe[i];
  }
  const double determinant = dd * ll - dl * dl;
  if (!(determinant > 1e-9 * dd * ll)) return 0;
  const double rho = (ll * dr - dl * lr) / determinant;
  const double size = (dd * lr - dl * dr) / determinant;
  return rho > 0 && size > 0 ? std::max(0.0, rho * dr + size * lr - dr * dr / dd) : 0;
}

/// Divides each kind by the direction of fibres that fits the gloss of its texels best, and keeps the parts
/// with the largest gains.
void divide_by_fibres(const TexelForms& forms, const GlossDirections& directions, int max_kinds,
                      SlabGloss& gloss) {
  constexpr std::size_t angles = 4;
  const auto angle_of = [](std::size_t i) { return std::numbers::pi * static_cast<double>(i) / angles; };
  std::vector<Values> diffuse;
  std::vector<Values> lobes;
  for (const GlossKind& kind : gloss.kinds) {
    diffuse.push_back(gloss_values(kind, directions, gloss.unit));
    for (std::size_t angle = 0; angle < angles; ++angle) {
      GlossKind fibre = kind;
      fibre.tangent = tangent_along(kind.normal, angle_of(angle));
      fibre.rho = {0, 0, 0};
      fibre.shapes = {{{-1, 0.5, 0.5}, 4}};
      fibre.sizes = {1};
      lobes.push_back(gloss_values(fibre, directions, gloss.unit));
    }
  }
  const std::size_t texels = gloss.kind_of.size();
  std::vector<std::array<double, angles>> gains(texels);
  parallel_for(0, static_cast<int>(texels), [&](std::size_t t) {
    const TexelForm form = forms(t);
    for (std::size_t angle = 0; angle < angles; ++angle) {
      gains[t][angle] = gain_of(form, diffuse[gloss.kind_of[t]], lobes[gloss.kind_of[t] * angles + angle]);
    }
  });
  struct Group {
    std::size_t kind = 0;
    std::size_t angle = 0;
    double gain = 0;
  };
  std::vector<Group> groups;
  for (std::size_t k = 0; k < gloss.kinds.size(); ++k) {
    for (std::size_t angle = 0; angle < angles; ++angle) groups.push_back({k, angle, 0});
  }
  for (std::size_t t = 0; t < texels; ++t) {
    const std::size_t best = std::max_element(gains[t].begin(), gains[t].end()) - gains[t].begin();
    groups[gloss.kind_of[t] * angles + best].gain += gains[t][best];
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const Group& a, const Group& b) { return a.gain > b.gain; });
  // Every kind keeps at least one direction.
  std::vector<Group> kept;
  for (const bool first : {true, false}) {
    for (const Group& group : groups) {
      const bool there = std::any_of(kept.begin(), kept.end(), [&](const Group& other) {
        return other.kind == group.kind && (first || other.angle == group.angle);
      });
      if (there || std::ssize(kept) >= max_kinds || (!first && !(group.gain > 0))) continue;
      kept.push_back(group);
    }
  }
  std::vector<GlossKind> kinds;
  for (const Group& group : kept) {
    kinds.push_back(gloss.kinds[group.kind]);
    kinds.back().tangent = tangent_along(kinds.back().normal, angle_of(group.angle));
  }
  for (std::size_t t = 0; t < texels; ++t) {
    std::size_t best = kept.size();
    for (std::size_t k = 0; k < kept.size(); ++k) {
      if (kept[k].kind != gloss.kind_of[t]) continue;
      if (best == kept.size() || gains[t][kept[k].angle] > gains[t][kept[best].angle]) best = k;
    }
    gloss.kind_of[t] = static_cast<std::uint16_t>(best);
  }
  gloss.kinds = std::move(kinds);
}

/// Moves every texel to the kind with the g that explains most of its samples, up to a factor, which the
/// tables have. Prefers the kind of its left neighbour or its own if they are nearly as good: few changes
/// take few bytes.
void reassign(const TexelForms& forms, const GlossDirections& directions, std::size_t width,
              SlabGloss& gloss) {
  constexpr double tolerance = 0.002;
  const std::size_t kinds = gloss.kinds.size();
  std::vector<Values> g;
  for (const GlossKind& kind : gloss.kinds) g.push_back(gloss_values(kind, directions, gloss.unit));
  std::vector<double> explained(gloss.kind_of.size() * kinds, 0);
  parallel_for(0, static_cast<int>(gloss.kind_of.size()), [&](std::size_t t) {
    const TexelForm form = forms(t);
    for (std::size_t k = 0; k < kinds; ++k) {
      double square = 0;
      double linear = 0;
      for (std::size_t i = 0; i < g[k].size(); ++i) {
        square += form.square[i] * g[k][i] * g[k][i];
        linear += form.linear[i] * g[k][i];
      }
      if (square > 0 && linear > 0) explained[t * kinds + k] = linear * linear / square;
    }
  });
  for (std::size_t t = 0; t < gloss.kind_of.size(); ++t) {
    const double* by_kind = &explained[t * kinds];
    const double* best = std::max_element(by_kind, by_kind + kinds);
    std::uint16_t chosen = gloss.kind_of[t];
    if (by_kind[chosen] < (1 - tolerance) * *best) chosen = static_cast<std::uint16_t>(best - by_kind);
    if (t % width > 0 && by_kind[gloss.kind_of[t - 1]] >= (1 - tolerance) * *best)
      chosen = gloss.kind_of[t - 1];
    gloss.kind_of[t] = chosen;
  }
}

}  // namespace

SlabLobeFit fit_slab_lobes(const SampleLevel& samples, const SlabRays& rays, std::size_t entries,
                           const DirectionGrid& views, const DirectionGrid& lights,
                           const SlabLobeOptions& options) {
  const GlossDirections directions = gloss_directions(views, lights);
  const std::vector<std::vector<float>> constant{std::vector<float>(directions.views.size(), 1)};
  SlabLobeFit fit;
  SlabGloss tried = kinds_of_normals(samples, std::max(1, options.max_kinds / 2));
  normalise(tried, directions);
  for (int turn = 0; turn <= options.max_turns; ++turn) {
    const SlabFactors factors = factors_of(tried, directions);
    const SlabTables tables = fit_slabs(samples, rays, entries, constant, &factors);
    GlossForm form(samples, rays, tables, tried);
    std::vector<Values> g;
    for (const GlossKind& kind : tried.kinds) g.push_back(gloss_values(kind, directions, tried.unit));
    const double error = form.energy() > 0 ? std::sqrt(std::max(0.0, form.error(g)) / form.energy()) : 0;
    if (!fit.errors.empty() && !(error < fit.errors.back())) break;
    fit.errors.push_back(error);
    fit.gloss = tried;
    if (!(error > 0) || turn == options.max_turns) break;
    const TexelForms forms(samples, rays, tables, factors);
    if (turn == 0) {
      divide_by_fibres(forms, directions, options.max_kinds, tried);
    } else {
      reassign(forms, directions, samples.width, tried);
    }
    form = GlossForm(samples, rays, tables, tried);
    if (turn < options.lobes) add_lobe(form, directions, tried);
    search_gloss(form, directions, options.max_steps, tried);
    normalise(tried, directions);
  }
  // The search ended early, or the samples are black.
  for (GlossKind& kind : fit.gloss.kinds) {
    kind.shapes.resize(options.lobes);
    kind.sizes.resize(kind.shapes.size(), 0);
  }
  return fit;
}

}  // namespace selvedge
