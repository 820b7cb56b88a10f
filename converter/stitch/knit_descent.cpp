#include <algorithm>
#include <cmath>

#include "converter/stitch/knit_contacts.h"
#include "converter/stitch/relax_chain.h"
#include "converter/stitch/yarn_relax.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

/// Fraction of their radius that yarns begin with, as drawn.
constexpr double start_fraction = 0.13;
/// Stages in which yarn grows or swells and the repeat moves, of an edit fewer, and steps of each.
constexpr int all_stages = 8;
constexpr int edit_stages = 2;
constexpr int stage_steps = 6;
/// While pressed, soft sections are fitted to their contacts every so many steps; and such steps for each
/// step of rest.
constexpr int steps_between_section_fits = 3;
constexpr int steps_between_slides = 3;
constexpr int pressing_steps_per_rest_step = 2;
/// The press that finishes soft cloth within these radii of its middle (ribs and cables are left to stand
/// out): fraction of its height from which on it is pressed, and its stiffness.
constexpr double flat_height = 2.5;
constexpr double pressed_height_fraction = 0.75;
constexpr double pressing_stiffness = 0.5;
/// Factor on the stiffness of pieces and contacts at last.
constexpr double last_stiffness = 8;
/// Steps after which the Hessian is factored again, and rest is looked for: where they free less than this
/// fraction of the energy.
constexpr int steps_between_factors = 20;
constexpr double max_residual = 5e-4;
/// Pairs within these radii of touching are in the Hessian with a fraction of their stiffness: without them
/// steps went a tenth of their way, until yarn touched that the Hessian did not know.
constexpr double near_radii = 0.25;
constexpr double near_stiffness = 0.1;
/// Largest move of a step, in radii, and of the period's logarithm.
constexpr double max_move = 0.4;
constexpr double max_growth = 0.06;
/// Lean that the quadratic model sees, a twentieth of what comes, from which on cloth pulls to a side: below
/// it, friction holds cloth straight. And a degree of lean, below which cloth counts as straight.
constexpr double min_pull = 0.0045;
constexpr double min_lean = 0.0175;
constexpr std::size_t max_history = 6;
/// Sufficient decrease of an L-BFGS step (Armijo), and tries.
constexpr double min_decrease = 1e-4;
constexpr int max_tries = 8;
/// Overlap with the gap beside chords, in radii, above which yarn becomes thinner: by half of what is above,
/// and of this more; rounds of it.
constexpr double max_overlap = touching_overlap + 0.004;
constexpr double min_thinning = 0.005;
constexpr int max_thinnings = 12;

}  // namespace

void KnitCloth::rest(const ClothGoal& goal) {
  const V2d begin = period_;
  const double lean = lean_;
  const double floats = goal.grows ? goal.float_factor : float_factor_;
  is_free_ = leans_ = false;
  double height = 0;
  for (const V3d& p : points_) height = std::max(height, std::abs(p.z));
  if (goal.presses && height < flat_height * unit_ && std::ranges::any_of(chains_, &Chain::soft)) {
    height_ = pressed_height_fraction * height;
    flat_stiffness_ = pressing_stiffness;
  }
  const int stages = active_.empty() ? all_stages : edit_stages;
  for (int stage = 1; stage <= stages; ++stage) {
    const double part = 1.0 * stage / stages;
    if (goal.grows) grown_ = start_fraction + (1 - start_fraction) * part;
    if (goal.presses) swollen_ = part;
    lengthened_ = goal.grows ? part : 1;
    float_factor_ = floats + (goal.float_factor - floats) * part;
    set_lengths();
    const V2d period = goal.period_mm.x > 0 ? begin + (goal.period_mm - begin) * part : begin;
    move_to(period, lean + (goal.lean - lean) * part);
    set_radii();
    converge(goal.presses ? 0 : stage_steps, goal.presses ? stage_steps : 0);
  }
  is_free_ = goal.is_free;
  if (goal.presses) stiffness_ = last_stiffness;
  converge(goal.max_steps, goal.presses ? pressing_steps_per_rest_step * goal.max_steps : 0);
  for (int k = 0; goal.presses && active_.empty() && overlap_ > max_overlap && k < max_thinnings; ++k) {
    thin_ *= 1 - 0.5 * std::min(0.2, overlap_ - max_overlap + min_thinning);
    set_radii();
    converge(steps_between_factors);
  }
  // Thinner yarn comes to rest anew.
  if (thin_ < 1 && residual_ > max_rest_residual) converge(2 * goal.max_steps);
}

void KnitCloth::find_lean(int max_steps) {
  if (!has_kinds_ && !images_.empty()) return;
  leans_ = true;
  history_.clear();
  energy(gradient_);
  factor();
  if (std::abs(descent().period.z) < min_pull) return;
  neighbours_.clear();
  factors_.assign(factors_.size(), {});
  KnitCloth straight = *this;
  converge(max_steps);
  if (std::abs(lean_) > min_lean) return;
  straight.steps_ = steps_;
  *this = std::move(straight);
}

/// Stretches the cloth to this repeat.
void KnitCloth::move_to(const V2d& period, double lean) {
  for (V3d& p : points_) {
    p.x -= p.y * lean_;
    for (int k = 0; k < 2; ++k) p[k] *= period[k] / period_[k];
    p.x += p.y * lean;
  }
  period_ = period;
  lean_ = lean;
}

/// Steps until rest, at most; before it, sections give way in the first ones.
void KnitCloth::converge(int max_steps, int pressing_steps) {
  history_.clear();
  search();
  double value = energy(gradient_);
  double last = value;
  int since_factor = steps_between_factors;
  for (int k = 0; k < pressing_steps + max_steps; ++k) {
    const int rested = k - pressing_steps;
    const bool fits = rested < 0 && k % steps_between_section_fits == 0;
    const bool slides = stiffness_ == 1 && k % steps_between_slides == 0;
    if (fits) fit_sections();
    if (slides) slide();
    if (fits || slides) value = energy(gradient_);
    if (rested >= 0 && rested % steps_between_factors == 0) {
      residual_ = rested > 0 ? (last - value) / value : 1;
      if (residual_ < max_residual) return;
      last = value;
    }
    if (since_factor >= steps_between_factors) {
      factor();
      since_factor = 0;
    }
    if (step(value)) {
      ++since_factor;
      continue;
    }
    // Nothing better along the way: a new factor, once. Then what its quadratic model would free is left.
    if (history_.empty() && since_factor == 0 && rested >= 0) {
      residual_ = -0.5 * descent().dot(gradient_) / value;
      return;
    }
    history_.clear();
    since_factor = steps_between_factors;
  }
  residual_ = (last - value) / value;
}

/// A step of L-BFGS; whether it has lowered the energy.
bool KnitCloth::step(double& value) {
  ++steps_;
  if (on_step_) on_step_();
  Vector direction = descent();
  double slope = direction.dot(gradient_);
  if (slope >= 0) {
    history_.clear();
    direction = descent();
    slope = direction.dot(gradient_);
  }
  if (!(slope < 0)) return false;
  double longest = 0;
  for (const V3d& way : direction.points) longest = std::max(longest, way.length2());
  const V3d& rates = direction.period;
  const double growth = std::max({std::abs(rates.x), std::abs(rates.y), std::abs(rates.z)});
  double length = std::min({1.0, max_move * grown_ * unit_ / std::max(std::sqrt(longest), 1e-300),
                            max_growth / std::max(growth, 1e-300)});
  const std::vector<V3d> points = points_;
  const V2d period = period_;
  const double lean = lean_;
  Vector change = gradient_;
  for (int tries = 0; tries < max_tries; ++tries) {
    move(direction, length);
    double moved2 = 0;
    for (std::size_t i = 0; i < points_.size(); ++i)
      moved2 = std::max(moved2, (points_[i] - V3d(searched_[i])).length2());
    if (2 * std::sqrt(moved2) > search_margin * unit_) search();
    const double next = energy(gradient_);
    if (next <= value + min_decrease * length * slope) {
      value = next;
      RoughVector way{{}, direction.period * length};
      RoughVector turn{{}, gradient_.period - change.period};
      way.points.reserve(points.size());
      turn.points.reserve(points.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        way.points.emplace_back(direction.points[i] * length);
        turn.points.emplace_back(gradient_.points[i] - change.points[i]);
      }
      if (turn.dot(way) <= 0) return true;
      if (history_.size() == max_history) history_.erase(history_.begin());
      history_.emplace_back(std::move(way), std::move(turn));
      return true;
    }
    // The least value of the parabola through both.
    const double best = -slope * length * length / (2 * std::max(next - value - slope * length, 1e-300));
    points_ = points;
    period_ = period;
    lean_ = lean;
    length = std::clamp(best, 0.1 * length, 0.5 * length);
  }
  gradient_ = std::move(change);
  return false;
}

void KnitCloth::move(const Vector& direction, double step) {
  V2d factor(1 + step * direction.period.x, 1 + step * direction.period.y);
  for (int k = 0; k < 2; ++k) factor[k] = std::max(factor[k], min_period_[k] / period_[k]);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    points_[i] += direction.points[i] * step;
    const double up = points_[i].y;
    for (int k = 0; k < 2; ++k) points_[i][k] *= factor[k];
    points_[i].x += step * direction.period.z * up;
  }
  period_ *= factor;
  lean_ = (lean_ * factor.x + step * direction.period.z) / factor.y;
}

/// The two loops of L-BFGS.
KnitCloth::Vector KnitCloth::descent() const {
  Vector v = gradient_;
  if (!is_free_) v.period = V3d(0);
  std::vector<double> factors(history_.size());
  for (std::size_t k = history_.size(); k-- > 0;) {
    const auto& [way, change] = history_[k];
    factors[k] = way.dot(v) / way.dot(change);
    v.add(-factors[k], change);
  }
  if (!is_free_) v.period = V3d(0);
  solve(v);
  for (std::size_t k = 0; k < history_.size(); ++k) {
    const auto& [way, change] = history_[k];
    v.add(factors[k] - change.dot(v) / way.dot(change), way);
  }
  for (V3d& p : v.points) p = -p;
  v.period = -v.period;
  if (!images_.empty()) average_by_kind(kind_of_, images_, v.points);
  return v;
}

template <class Visit>
void KnitCloth::visit_squares(const Chain& chain, std::uint32_t i, const Visit& visit) const {
  const std::uint32_t last = i > chain.begin ? i - 1 : chain.end - 1;
  const V3d d = along(i);
  const double rest = lengths_[i];
  const double length = std::max(std::sqrt(d.length2()), 1e-300);
  const V3d u = d / length;
  const double stretching = stiffness_ * stretch_stiffness / unit_;
  visit(Square{{i, next_[i]}, {-1, 1}, 2, u, V3d(u.x * d.x, u.y * d.y, u.x * d.y), stretching / rest});
  const double tension = std::max(0.0, stretching * (length / rest - 1) / length);
  // Holds thick cloth, and all of it a little, for cloth as a whole is free to move.
  const double holding = flat_stiffness_ * rest / (unit_ * unit_ * unit_);
  const V3d bend = d - along(last);
  visit(Square{
      {i, next_[i], last}, {-2, 1, 1}, 3, V3d(0), V3d(bend.x, bend.y, bend.y), unit_ / (rest * rest * rest)});
  visit(Square{{i, next_[i]}, {-1, 1}, 2, V3d(0), V3d(0), tension});
  visit(Square{{i}, {1}, 1, V3d(0), V3d(0), holding});
}

/// Adds a square to the Hessian of a tile. Squares of points in several tiles are replaced by their
/// bound by Cauchy and Schwarz, which does not couple these.
void KnitCloth::add(const Square& square, std::uint32_t tile, BlockMatrix& matrix, Border& border) const {
  double tiles = 0;
  for (int p = 0; p < square.count; ++p) {
    bool is_new = true;
    for (int q = 0; q < p; ++q) is_new = is_new && tile_of_[square.points[p]] != tile_of_[square.points[q]];
    tiles += is_new ? 1 : 0;
  }
  const V3d& n = square.n;
  const bool has_axes = n == V3d(0);
  for (int p = 0; p < square.count; ++p) {
    const std::uint32_t point = square.points[p];
    if (tile_of_[point] != tile) continue;
    for (int k = 0; k < (leans_ ? 3 : is_free_ ? 2 : 0); ++k) {
      V3d axis = n;
      if (has_axes) axis[k % 2] = 1;
      border.sides[k].points[point] += V3f(axis * (square.weight * square.parts[p] * square.rate[k]));
    }
    for (int q = 0; q <= p; ++q) {
      if (tile_of_[square.points[q]] != tile) continue;
      // A point may touch its own image: then this is both the block and its mirror.
      const double times = q < p && square.points[q] == point ? 2 * tiles : tiles;
      const double weight = times * square.weight * square.parts[p] * square.parts[q];
      Eigen::Matrix3f& block = matrix.at(place_of_[point], place_of_[square.points[q]]);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          block(i, j) += static_cast<float>(weight * (has_axes ? (i == j ? 1 : 0) : n[i] * n[j]));
    }
  }
}

/// Factors the Gauss-Newton Hessian of each tile.
void KnitCloth::factor() {
  struct Touch {
    std::uint32_t a, b;
    V3f slope, rate;
    float weight;
  };
  std::vector<Touch> contacts;
  contacts.reserve(3 * points_.size());
  std::vector<std::vector<std::uint32_t>> contacts_of(tiles_.size());
  const double contacting = stiffness_ * contact_stiffness / (grown_ * grown_ * unit_ * unit_);
  // A contact couples the nearest end of each piece: with all four ends, factors took twice as long.
  visit_contacts(
      [&](const Contact& c) {
        const std::uint32_t a = c.s < 0.5 ? c.a : next_[c.a];
        const std::uint32_t b = c.t < 0.5 ? c.b : next_[c.b];
        const auto index = static_cast<std::uint32_t>(contacts.size());
        contacts.push_back({a, b, V3f(c.slope),
                            V3f(V3d(c.slope.x * c.apart.x, c.slope.y * c.apart.y, c.slope.x * c.apart.y)),
                            static_cast<float>(c.depth > 0 ? contacting : near_stiffness * contacting)});
        contacts_of[tile_of_[a]].push_back(index);
        if (tile_of_[b] != tile_of_[a]) contacts_of[tile_of_[b]].push_back(index);
      },
      near_radii * grown_ * unit_);
  const auto visit_tile = [&](std::uint32_t tile, const auto& visit) {
    for (const std::uint32_t i : tiles_[tile]) {
      const Chain& chain = chains_[chain_of_[i]];
      const std::uint32_t last = i > chain.begin ? i - 1 : chain.end - 1;
      visit_squares(chain, i, visit);
      for (const std::uint32_t neighbour : {last, next_[i]})
        if (tile_of_[neighbour] != tile) visit_squares(chain, neighbour, visit);
    }
    for (const std::uint32_t index : contacts_of[tile]) {
      const auto& [a, b, slope, rate, weight] = contacts[index];
      visit(Square{{a, b}, {1, -1}, 2, V3d(slope), V3d(rate), weight});
    }
  };
  Border border;
  if (is_free_)
    for (RoughVector& side : border.sides) side.points.resize(points_.size(), V3f(0));
  parallel_for(0, static_cast<int>(tiles_.size()), [&](int t) {
    const auto tile = static_cast<std::uint32_t>(t);
    if (tiles_[tile].empty()) return;
    BlockMatrix matrix(static_cast<std::uint32_t>(tiles_[tile].size()));
    visit_tile(tile, [&](const Square& square) { add(square, tile, matrix, border); });
    factors_[tile] = BlockCholesky(std::move(matrix));
  });
  if (!is_free_) return;
  for (std::uint32_t tile = 0; tile < tiles_.size(); ++tile)
    visit_tile(tile, [&](const Square& square) {
      if (tile_of_[square.points[0]] == tile) border.add_corner(square);
    });
  for (int k = 0; k < 2; ++k) {
    borders_[k] = border.sides[k];
    solve_points(borders_[k]);
  }
  // The Schur complement of the period.
  double c[3] = {border.corner[0] - border.sides[0].dot(borders_[0]),
                 border.corner[1] - border.sides[0].dot(borders_[1]),
                 border.corner[2] - border.sides[1].dot(borders_[1])};
  const double determinant = c[0] * c[2] - c[1] * c[1];
  period_inverse_[0] = c[2] / determinant;
  period_inverse_[1] = -c[1] / determinant;
  period_inverse_[2] = c[0] / determinant;
  if (!leans_) return;
  // Then the shear, of what these two leave.
  borders_[2] = border.sides[2];
  borders_[2].period = V3d(border.corner[3], border.corner[4], 0);
  const V3d side = borders_[2].period;
  solve_upright(borders_[2]);
  shear_pivot_ = border.corner[5] - border.sides[2].dot(borders_[2]) - side.dot(borders_[2].period);
}

/// Multiplies by the inverse of what factor() has factored.
void KnitCloth::solve(Vector& v) const {
  if (!is_free_) {
    solve_points(v);
    return;
  }
  const double shear = leans_ ? (v.period.z - borders_[2].dot(v)) / shear_pivot_ : 0;
  solve_upright(v);
  if (!leans_) return;
  v.add(-shear, borders_[2]);
  v.period.z = shear;
}

/// The same without the shear.
template <class Real>
void KnitCloth::solve_upright(VectorOf<Real>& v) const {
  const V2d side(v.period.x - borders_[0].dot(v), v.period.y - borders_[1].dot(v));
  solve_points(v);
  v.period = V3d(period_inverse_[0] * side.x + period_inverse_[1] * side.y,
                 period_inverse_[1] * side.x + period_inverse_[2] * side.y, 0);
  for (int k = 0; k < 2; ++k)
    for (std::size_t i = 0; i < v.points.size(); ++i)
      v.points[i] -= Imath::Vec3<Real>(V3d(borders_[k].points[i]) * v.period[k]);
}

template <class Real>
void KnitCloth::solve_points(VectorOf<Real>& v) const {
  parallel_for(0, static_cast<int>(tiles_.size()), [&](int tile) {
    const std::vector<std::uint32_t>& points = tiles_[static_cast<std::size_t>(tile)];
    std::vector<Eigen::Vector3f> x;
    x.reserve(points.size());
    for (const std::uint32_t i : points)
      x.push_back(
          Eigen::Matrix<Real, 3, 1>(v.points[i].x, v.points[i].y, v.points[i].z).template cast<float>());
    factors_[static_cast<std::size_t>(tile)].solve(x);
    for (std::size_t i = 0; i < points.size(); ++i)
      for (int k = 0; k < 3; ++k) v.points[points[i]][k] = x[i][k];
  });
}

}  // namespace selvedge
