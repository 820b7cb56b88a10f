#include "fitter/gloss/search.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fitter/lobes/channel_problem.h"
#include "fitter/solve/small_solve.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

/// Bound of a lobe's size, in units of the root mean square of g.
constexpr LobeBounds bounds{64};
/// Smallest z of a frame's normal.
constexpr double min_normal_z = 0.5;

/// Directions of lobes in the frame: mirrors, and the cones of fibres along and across the tangent.
constexpr std::array<std::array<double, 3>, 6> shapes{
    {{-1, -1, 1}, {-1, 0.5, 0.5}, {0.5, -1, 0.5}, {-1, 1, 1}, {1, -1, 1}, {-0.5, -0.5, 1}}};
constexpr std::array<double, 5> exponents{1.5, 3, 6, 12, 24};

using Values = std::vector<double>;

/// A lobe to add, and its effect.
struct AddedLobe {
  double gain = 0;   ///< decrease of the error, up to a constant
  double scale = 1;  ///< factor on rho and the other lobes
  LobeShape shape{shapes[0], exponents[1]};
  double size = 0;
};

/// Unknowns of a kind: rho of the channels; a LobeStep for every lobe; rotations about tangent, binormal and
/// normal.
constexpr std::size_t first_lobe = 3;
constexpr std::size_t of_lobe = LobeStep::unknowns;
std::size_t unknowns_of(const GlossKind& kind) { return first_lobe + of_lobe * kind.shapes.size() + 3; }

/// Derivatives of g by all unknowns, [unknown][value].
std::vector<Values> derivatives(const GlossKind& kind, const GlossDirections& directions,
                                const std::vector<float>& unit) {
  const std::size_t turns = first_lobe + of_lobe * kind.shapes.size();
  std::vector<Values> result(unknowns_of(kind), Values(directions.count(), 0));
  const V3d binormal = kind.normal.cross(kind.tangent);
  const auto local = [&](const V3d& d) {
    return V3d(d.dot(kind.tangent), d.dot(binormal), d.dot(kind.normal));
  };
  // Derivatives of a direction's coordinates by rotations of the frame about each of its axes.
  const auto turned = [](const V3d& d) {
    return std::array<V3d, 3>{V3d(0, d.z, -d.y), V3d(-d.z, 0, d.x), V3d(d.y, -d.x, 0)};
  };
  std::size_t at = 0;
  for (const V3d& view : directions.views) {
    const V3d v = local(view);
    const std::array<V3d, 3> dv = turned(v);
    for (std::size_t i = 0; i < directions.lights.size(); ++i, at += 3) {
      const V3d l = local(directions.lights[i]);
      if (!(l.z > 0)) continue;
      const std::array<V3d, 3> dl = turned(l);
      double lobes = 0;
      std::array<double, 3> by_turn{};
      for (std::size_t j = 0; j < kind.shapes.size(); ++j) {
        const auto& d = kind.shapes[j].direction;
        const double n = kind.shapes[j].exponent;
        const V3d lv(l.x * v.x, l.y * v.y, l.z * v.z);
        const double base = d[0] * lv.x + d[1] * lv.y + d[2] * lv.z;
        if (!(base > 0)) continue;
        const double power = std::pow(base, n);
        const double lobe = kind.sizes[j] * power;
        const double by_base = n * lobe / base;
        lobes += lobe;
        const std::size_t kept = longest(kind.shapes[j]);
        const std::array<double, of_lobe> by{power, by_base * lv[static_cast<int>((kept + 1) % 3)],
                                             by_base * lv[static_cast<int>((kept + 2) % 3)],
                                             n * lobe * std::log(base)};
        for (std::size_t p = 0; p < of_lobe; ++p) {
          for (std::size_t c = 0; c < 3; ++c) {
            result[first_lobe + of_lobe * j + p][at + c] = l.z * by[p] / static_cast<double>(unit[3 * i + c]);
          }
        }
        for (std::size_t a = 0; a < 3; ++a) {
          double change = 0;
          for (int k = 0; k < 3; ++k) {
            change += d[k] * (dl[a][k] * v[k] + l[k] * dv[a][k]);
          }
          by_turn[a] += by_base * change;
        }
      }
      for (std::size_t c = 0; c < 3; ++c) {
        const auto inverse = 1 / static_cast<double>(unit[3 * i + c]);
        result[c][at + c] = l.z * inverse;
        for (std::size_t a = 0; a < 3; ++a) {
          result[turns + a][at + c] = inverse * (dl[a].z * (kind.rho[c] + lobes) + l.z * by_turn[a]);
        }
      }
    }
  }
  return result;
}

/// The kind after a step within the bounds.
GlossKind moved(const GlossKind& from, const std::vector<double>& step) {
  GlossKind kind = from;
  for (std::size_t c = 0; c < 3; ++c) kind.rho[c] = std::max(0.0, kind.rho[c] + step[c]);
  for (std::size_t j = 0; j < kind.shapes.size(); ++j) {
    move_lobe(LobeStep::from(&step[first_lobe + of_lobe * j]), bounds, kind.shapes[j], kind.sizes[j]);
  }
  constexpr double furthest_turn = 0.3;
  const double* t = &step[step.size() - 3];
  V3d turn = t[0] * kind.tangent + t[1] * kind.normal.cross(kind.tangent) + t[2] * kind.normal;
  turn *= std::min(1.0, furthest_turn / std::max(turn.length(), 1e-30));
  const V3d normal = (kind.normal + turn.cross(kind.normal)).normalized();
  if (normal.z < min_normal_z) return kind;
  kind.normal = normal;
  kind.tangent += turn.cross(kind.tangent);
  kind.tangent = (kind.tangent - normal * kind.tangent.dot(normal)).normalized();
  return kind;
}

/// Whether an unknown cannot move: it is at a bound and descent would move it outwards, or it has no effect.
bool is_fixed(const GlossKind& kind, std::size_t u, double gradient, double curvature) {
  if (!(curvature > 0)) return true;
  if (u < first_lobe) return kind.rho[u] <= 0 && gradient >= 0;
  const std::size_t j = (u - first_lobe) / of_lobe;
  if (j >= kind.shapes.size()) return false;
  return is_at_bound((u - first_lobe) % of_lobe, gradient, bounds, kind.shapes[j], kind.sizes[j]);
}

/// The normal equations of one kind with the others fixed.
NormalEquations block_of(const GlossForm& form, std::size_t k, const std::vector<Values>& g,
                         const std::vector<Values>& by) {
  const std::size_t n = by.size();
  const Values& square = form.square(k);
  Values residual = form.linear(k, g);
  for (std::size_t i = 0; i < residual.size(); ++i) residual[i] -= square[i] * g[k][i];
  NormalEquations block{std::vector<double>(n * n), std::vector<double>(n)};
  Values weighted(square.size());
  for (std::size_t u = 0; u < n; ++u) {
    block.gradient[u] = -std::inner_product(residual.begin(), residual.end(), by[u].begin(), 0.0);
    for (std::size_t i = 0; i < square.size(); ++i) weighted[i] = square[i] * by[u][i];
    for (std::size_t w = 0; w <= u; ++w) {
      block.matrix[u * n + w] = std::inner_product(weighted.begin(), weighted.end(), by[w].begin(), 0.0);
      block.matrix[w * n + u] = block.matrix[u * n + w];
    }
  }
  return block;
}

/// Damped steps of all kinds, with the same step for the lobes of all; 0 if the equations have no solution.
std::vector<std::vector<double>> steps_of(const std::vector<NormalEquations>& blocks,
                                          const std::vector<GlossKind>& kinds, double lambda, double energy) {
  const std::size_t n = blocks.front().gradient.size();
  const std::size_t lobes = n - 6;
  const std::size_t all = lobes + 6 * kinds.size();
  // Lobes come first, then rho and rotations of each kind.
  const auto index = [&](std::size_t k, std::size_t u) {
    if (u < first_lobe) return lobes + 6 * k + u;
    return u < first_lobe + lobes ? u - first_lobe : 6 * k + u;
  };
  std::vector<double> matrix(all * all, 0);
  std::vector<double> gradient(all, 0);
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    for (std::size_t u = 0; u < n; ++u) {
      gradient[index(k, u)] += blocks[k].gradient[u];
      for (std::size_t w = 0; w < n; ++w) {
        matrix[index(k, u) * all + index(k, w)] += blocks[k].matrix[u * n + w];
      }
    }
  }
  std::vector<double> step(all);
  std::vector<char> fixed(all);
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    for (std::size_t u = 0; u < n; ++u) {
      const std::size_t i = index(k, u);
      fixed[i] = is_fixed(kinds[k], u, gradient[i], matrix[i * all + i]) ? 1 : 0;
    }
  }
  for (std::size_t i = 0; i < all; ++i) {
    step[i] = -gradient[i];
    matrix[i * all + i] += lambda * matrix[i * all + i] + 1e-14 * energy;
  }
  std::vector<std::vector<double>> steps(kinds.size(), std::vector<double>(n, 0));
  if (!solve_symmetric(matrix, step, fixed)) return steps;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    for (std::size_t u = 0; u < n; ++u) {
      const double s = step[index(k, u)];
      steps[k][u] = std::isfinite(s) ? s : 0;
    }
  }
  return steps;
}

}  // namespace

void add_lobe(const GlossForm& form, const GlossDirections& directions, SlabGloss& gloss) {
  std::vector<Values> g;
  for (const GlossKind& kind : gloss.kinds) g.push_back(gloss_values(kind, directions, gloss.unit));
  const auto inner = [](const Values& square, const Values& x, const Values& y) {
    double sum = 0;
    for (std::size_t i = 0; i < square.size(); ++i) sum += square[i] * x[i] * y[i];
    return sum;
  };
  std::vector<Values> linear(gloss.kinds.size());
  double old_own = 0;
  double old_right = 0;
  for (std::size_t k = 0; k < linear.size(); ++k) {
    linear[k] = form.linear(k, g);
    old_own += inner(form.square(k), g[k], g[k]);
    old_right += std::inner_product(g[k].begin(), g[k].end(), linear[k].begin(), 0.0);
  }
  std::vector<AddedLobe> added(shapes.size() * exponents.size());
  parallel_for(0, static_cast<int>(added.size()), [&](std::size_t i) {
    const LobeShape shape{shapes[i / exponents.size()], exponents[i % exponents.size()]};
    double own = 0;
    double both = 0;
    double right = 0;
    for (std::size_t k = 0; k < linear.size(); ++k) {
      GlossKind alone = gloss.kinds[k];
      alone.rho = {0, 0, 0};
      alone.shapes = {shape};
      alone.sizes = {1};
      const Values lobe = gloss_values(alone, directions, gloss.unit);
      own += inner(form.square(k), lobe, lobe);
      both += inner(form.square(k), lobe, g[k]);
      right += std::inner_product(lobe.begin(), lobe.end(), linear[k].begin(), 0.0);
    }
    const double determinant = old_own * own - both * both;
    if (!(determinant > 1e-9 * old_own * own)) return;
    const double scale = (own * old_right - both * right) / determinant;
    const double size = (old_own * right - both * old_right) / determinant;
    if (!(scale > 0) || !(size > 0) || size > bounds.max_size) return;
    added[i] = {scale * old_right + size * right, scale, shape, size};
  });
  const AddedLobe best = *std::max_element(
      added.begin(), added.end(), [](const AddedLobe& a, const AddedLobe& b) { return a.gain < b.gain; });
  for (GlossKind& kind : gloss.kinds) {
    if (best.size > 0) {
      for (double& rho : kind.rho) rho *= best.scale;
      for (double& size : kind.sizes) size *= best.scale;
    }
    kind.shapes.push_back(best.shape);
    kind.sizes.push_back(best.size);
  }
}

double search_gloss(const GlossForm& form, const GlossDirections& directions, int steps, SlabGloss& gloss) {
  const std::size_t kinds = gloss.kinds.size();
  const auto all_values = [&](const std::vector<GlossKind>& of_kinds) {
    std::vector<Values> g(kinds);
    parallel_for(0, static_cast<int>(kinds),
                 [&](std::size_t i) { g[i] = gloss_values(of_kinds[i], directions, gloss.unit); });
    return g;
  };
  std::vector<Values> g = all_values(gloss.kinds);
  double error = form.error(g);
  double lambda = 1e-2;
  std::vector<NormalEquations> blocks(kinds);
  bool accepted = true;
  for (int step = 0; step < steps; ++step) {
    if (accepted) {
      parallel_for(0, static_cast<int>(kinds), [&](std::size_t i) {
        blocks[i] = block_of(form, i, g, derivatives(gloss.kinds[i], directions, gloss.unit));
      });
    }
    const auto by = steps_of(blocks, gloss.kinds, lambda, form.energy());
    std::vector<GlossKind> tried;
    for (std::size_t k = 0; k < kinds; ++k) tried.push_back(moved(gloss.kinds[k], by[k]));
    std::vector<Values> tried_g = all_values(tried);
    const double tried_error = form.error(tried_g);
    accepted = tried_error < error;
    if (accepted) {
      constexpr double tolerance = 1e-4;
      const bool done = error - tried_error < tolerance * error;
      gloss.kinds = std::move(tried);
      g = std::move(tried_g);
      error = tried_error;
      lambda = std::max(1e-6, 0.3 * lambda);
      if (done) break;
    } else {
      lambda *= 8;
      if (lambda > 1e6) break;
    }
  }
  return error;
}

}  // namespace selvedge
