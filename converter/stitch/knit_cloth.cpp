#include "converter/stitch/knit_cloth.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "converter/mesh/surface_points.h"
#include "converter/stitch/flat_yarn.h"
#include "converter/stitch/knit_contacts.h"
#include "converter/stitch/relax_chain.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

using std::numbers::pi;

/// Length of pieces, in radii. Curves through their ends leave them by up to this gap, beside contacts.
constexpr double piece_radii = 0.75;
constexpr double chord_gap = 0.006;
/// Loops that one tile of the Hessian holds; fewer than the second are not cut.
constexpr double loops_a_tile = 64;
constexpr double max_loops_a_tile = 128;
/// Pieces that may touch one, after it, for which there is memory at first.
constexpr std::size_t mean_neighbours = 20;
/// Friction of yarn that slides from a loop into the next: slid yarn, in loops, times this is the difference
/// of tensions that it bears, in units of bending stiffness by radius squared (chosen). Sweeps of Jacobi's
/// method.
constexpr double friction = 2;
constexpr int sliding_sweeps = 40;
/// Fraction of its radius to which soft yarn gives way while the cloth takes its size.
constexpr double soft_core = 0.85;
/// Sections of soft yarn (as in yarn_relax.cpp): strain for a contact force of 1, its bound a step; what a
/// step takes back, and passes on to either neighbour.
constexpr double pressure = 0.05;
constexpr double max_pressure = 0.1;
constexpr double recovery = 0.05;
constexpr double spread = 0.25;

double length_of(const V3d& v) { return std::sqrt(v.length2()); }  // length() is a call

}  // namespace

KnitCloth::KnitCloth(const DrawnKnit& knit, double gap_radii, const std::vector<double>& curvature)
    : gap_(gap_radii + chord_gap), period_(knit.pattern.period_mm), min_period_(0.25 * period_) {
  for (std::size_t y = 0; y < knit.pattern.yarns.size(); ++y) {
    const Yarn& yarn = knit.pattern.yarns[y];
    Chain chain;
    chain.begin = static_cast<std::uint32_t>(points_.size());
    chain.radius = yarn.radius_mm;
    chain.soft = yarn.fibre_kind != 0;
    chain.flattening = chain.soft ? yarn.flattening : 1;
    unit_ = std::max(unit_, yarn.radius_mm);
    const V2i turns = chain_periods(yarn, period_);
    chain.turns = {1.0 * turns.x, 1.0 * turns.y};
    if (!chains_.empty()) chain.row = chains_.back().row;
    if (knit.parts[y].front().begins_row) ++chain.row;
    std::size_t segment = 0;
    for (const KnitPart& part : knit.parts[y]) {
      constexpr int fine = 8;
      std::vector<V3d> line;
      for (std::size_t s = 0; s < part.segments; ++s)
        for (int k = 0; k < fine; ++k) line.push_back(point_at(yarn.segments[segment + s], 1.0 * k / fine));
      segment += part.segments;
      line.push_back(yarn.segments[segment - 1][3]);
      // Rounded, as the sines of drawings differ in their last bits between machines.
      const double unit = yarn.radius_mm / (1 << 20);
      for (V3d& p : line)
        for (int k = 0; k < 3; ++k) p[k] = unit * std::round(p[k] / unit);
      double length = 0;
      for (std::size_t i = 0; i + 1 < line.size(); ++i) length += length_of(line[i + 1] - line[i]);
      const double count = std::max(3.0, std::round(part.length_mm / (piece_radii * chain.radius)));
      const auto begin = static_cast<std::uint32_t>(points_.size());
      chain.parts.push_back(
          {begin, begin + static_cast<std::uint32_t>(count), part.is_loop, length, part.length_mm});
      double walked = 0;
      std::size_t i = 0;
      for (double k = 0; k < count; ++k) {
        const double goal = length * k / count;
        double step = length_of(line[i + 1] - line[i]);
        while (walked + step < goal) {
          walked += step;
          ++i;
          step = length_of(line[i + 1] - line[i]);
        }
        points_.push_back(line[i] + (line[i + 1] - line[i]) * ((goal - walked) / std::max(step, 1e-300)));
        double bent = 0;
        if (part.is_loop && !curvature.empty()) {
          const std::size_t n = curvature.size();
          const double place = k / count * static_cast<double>(n);
          const auto j = static_cast<std::size_t>(place);
          const double f = place - std::floor(place);
          bent = curvature[j % n] * (1 - f) + curvature[(j + 1) % n] * f;
        }
        curvatures_.push_back(bent);
      }
    }
    chain.end = static_cast<std::uint32_t>(points_.size());
    for (std::uint32_t i = chain.begin; i < chain.end; ++i) {
      next_.push_back(i + 1 < chain.end ? i + 1 : chain.begin);
      chain_of_.push_back(static_cast<std::uint32_t>(chains_.size()));
    }
    chains_.push_back(std::move(chain));
  }
  set_tiles();
  if (tiles_.size() > 1) find_kinds();
  if (!has_kinds_) find_mirror();
  const std::size_t count = points_.size();
  lengths_.resize(count);
  height_ = free_height * unit_;
  radii_.resize(count);
  reaches_.resize(count);
  squeezes_.resize(count, V3d(0));
  strains_.resize(count, Imath::M33d(0.0));
  gradient_.points.resize(count);
  pieces_.resize(count);
  walked_.resize(count, 0);
  set_lengths();
}

/// Cuts large cloth into tiles: the factor of a whole one would take more memory than all else.
void KnitCloth::set_tiles() {
  double loops = 0;
  for (const Chain& chain : chains_) loops += static_cast<double>(chain.parts.size());
  const double area = loops > max_loops_a_tile ? loops_a_tile / loops * period_.x * period_.y : 1e300;
  const double most = std::max(1.0, std::round(period_.x * period_.y / area));
  const double across = std::clamp(std::round(period_.x / std::sqrt(area)), 1.0, most);
  const auto columns = static_cast<std::uint32_t>(across);
  const auto rows = static_cast<std::uint32_t>(std::max(1.0, std::round(most / across)));
  tiles_.resize(std::size_t{columns} * rows);
  factors_.resize(tiles_.size());
  for (const Chain& chain : chains_) {
    for (const Part& part : chain.parts) {
      const V3d& begin = points_[part.begin];
      const auto x = static_cast<std::uint32_t>(wrap_to_repeat(begin.x, period_.x) / period_.x * columns);
      const auto y = static_cast<std::uint32_t>(wrap_to_repeat(begin.y, period_.y) / period_.y * rows);
      const std::uint32_t tile = std::min(y, rows - 1) * columns + std::min(x, columns - 1);
      for (std::uint32_t i = part.begin; i < part.end; ++i) {
        tile_of_.push_back(tile);
        place_of_.push_back(static_cast<std::uint32_t>(tiles_[tile].size()));
        tiles_[tile].push_back(i);
      }
    }
  }
}

void KnitCloth::set_lengths() {
  for (const Chain& chain : chains_) {
    double taken = chain.parts.back().slid;
    for (const Part& p : chain.parts) {
      const double length = p.length * (p.is_loop ? 1 : float_factor_);
      std::fill(lengths_.begin() + p.begin, lengths_.begin() + p.end,
                (p.drawn + (length - p.drawn) * lengthened_ + p.slid - taken) / (p.end - p.begin));
      taken = p.slid;
    }
  }
}

/// Yarn slides over the feet between the parts of a row into the tighter one, until friction holds the
/// difference.
void KnitCloth::slide() {
  for (Chain& chain : chains_) {
    const std::size_t count = chain.parts.size();
    std::vector<double> tensions(count), stiffness(count), taken(count, 0), last;
    double row = 0;
    for (std::size_t p = 0; p < count; ++p) {
      const Part& part = chain.parts[p];
      double length = 0;
      for (std::uint32_t i = part.begin; i < part.end; ++i) length += length_of(along(i));
      const double rest = lengths_[part.begin] * (part.end - part.begin);
      row += rest;
      stiffness[p] = stretch_stiffness / rest;
      tensions[p] = stiffness[p] * (length - rest);
    }
    const double rubbing = friction * static_cast<double>(count) / row;
    for (int sweep = 0; sweep < sliding_sweeps; ++sweep) {
      last = taken;
      for (std::size_t p = 0; p < count; ++p) {
        const std::size_t next = p + 1 < count ? p + 1 : 0;
        if (is_still(chain.parts[p].begin) || is_still(chain.parts[next].begin)) continue;
        const double slope = tensions[p] - tensions[next] - rubbing * chain.parts[p].slid;
        taken[p] = (slope + stiffness[next] * last[next] + stiffness[p] * last[p > 0 ? p - 1 : count - 1]) /
                   (rubbing + stiffness[next] + stiffness[p]);
      }
    }
    for (std::size_t p = 0; p < count; ++p) chain.parts[p].slid += taken[p];
  }
  if (has_kinds_) {
    // Over a foot to the left: in the mirror, to the right.
    std::vector<V3d> slid(points_.size(), V3d(0));
    for (const Chain& chain : chains_)
      for (const Part& part : chain.parts) slid[next_[part.end - 1]].x = part.slid;
    average_by_kind(kind_of_, images_, slid);
    for (Chain& chain : chains_)
      for (Part& part : chain.parts) part.slid = slid[next_[part.end - 1]].x;
  }
  set_lengths();
}

void KnitCloth::set_radii() {
  for (const Chain& chain : chains_) {
    const double core = chain.soft ? soft_core + (1 - soft_core) * swollen_ : 1;
    const double radius = grown_ * thin_ * chain.radius * core;
    for (std::uint32_t i = chain.begin; i < chain.end; ++i) {
      if (is_still(i)) continue;
      reaches_[i] = radii_[i] > 0 ? reaches_[i] * radius / radii_[i] : radius;
      radii_[i] = radius;
    }
  }
}

/// The energy and its derivatives.
double KnitCloth::energy(Vector& gradient) {
  std::fill(gradient.points.begin(), gradient.points.end(), V3d(0));
  double energy = 0;
  V3d stress(0);
  const auto add_stress = [&](const V3d& force, const V3d& difference) {
    stress += V3d(force.x * difference.x, force.y * difference.y, force.x * difference.y);
  };
  const double stretching = stiffness_ * stretch_stiffness / unit_;
  for (const Chain& chain : chains_) {
    std::uint32_t last = chain.end - 1;
    V3d before = along(last);
    for (std::uint32_t i = chain.begin; i < chain.end; last = i++) {
      const V3d d = along(i);
      if (is_still(last) && is_still(i) && is_still(next_[i])) {
        before = d;
        continue;
      }
      const double length = std::max(length_of(d), 1e-300);
      const double rest = lengths_[i];
      const double strain = length / rest - 1;
      energy += 0.5 * stretching * rest * strain * strain;
      const V3d pull = d * (stretching * strain / length);
      gradient.points[i] -= pull;
      gradient.points[next_[i]] += pull;
      add_stress(pull, d);
      const double weight = flat_stiffness_ * rest / (unit_ * unit_ * unit_);
      const double thick = points_[i].z - std::clamp(points_[i].z, -height_, height_);
      energy += 0.5 * weight * thick * thick;
      gradient.points[i].z += weight * thick;
      const V3d bend = d - before;
      const double set = curvatures_[i] * rest * rest;
      const double size = std::sqrt(bend.length2() + set * set);
      const double bending = unit_ / (rest * rest * rest);
      energy += 0.5 * bending * (size - set) * (size - set);
      before = d;
      const V3d moment = bend * (bending * (1 - set / std::max(size, 1e-300)));
      gradient.points[last] += moment;
      gradient.points[i] -= moment * 2.0;
      gradient.points[next_[i]] += moment;
      add_stress(moment, bend);
    }
  }
  overlap_ = 0;
  const double contacting = stiffness_ * contact_stiffness / (grown_ * grown_ * unit_ * unit_);
  visit_contacts([&](const Contact& contact) {
    const auto [a, b, s, t, slope, apart, depth] = contact;
    overlap_ = std::max(overlap_, depth / std::min(radii_[a], radii_[b]));
    energy += 0.5 * contacting * depth * depth;
    const V3d push = slope * (contacting * depth);
    gradient.points[a] -= push * (1 - s);
    gradient.points[next_[a]] -= push * s;
    gradient.points[b] += push * (1 - t);
    gradient.points[next_[b]] += push * t;
    add_stress(-push, apart);
  });
  gradient.period = V3d(stress.x, stress.y, leans_ ? stress.z : 0);
  for (std::uint32_t i = 0; i < active_.size(); ++i)
    if (is_still(i)) gradient.points[i] = V3d(0);
  if (has_kinds_) average_by_kind(kind_of_, images_, gradient.points);
  return energy;
}

/// Adds the contacts of a piece with the ones behind it.
void KnitCloth::find_contacts(std::uint32_t a, double margin, std::vector<Contact>& found) {
  for (std::uint32_t k = first_neighbour_[a]; k < first_neighbour_[a + 1]; ++k) {
    Neighbour& pair = neighbours_[k];
    const std::uint32_t b = pair.piece;
    const double walked = walked_[a] + walked_[b] + walked_period_ * (std::abs(pair.x) + std::abs(pair.y)) +
                          margin + apart_margin * unit_;
    if (walked < pair.apart_until) continue;
    const auto skip = [&](double apart) { pair.apart_until = static_cast<float>(walked + apart); };
    const V3d shift = way(pair.x, pair.y);
    const Piece& one = pieces_[a];
    const Piece& other = pieces_[b];
    const double gap = gap_ * std::max(radii_[a], radii_[b]) + margin;
    const double far = reaches_[a] + reaches_[b] + gap;
    const double near = far + 0.55 * (lengths_[a] + lengths_[b]);
    const V3d between = one.middle - other.middle - shift;
    if (between.length2() > near * near) {
      skip(std::sqrt(between.length2()) - near - 2 * apart_margin * unit_);
      continue;
    }
    const V3d& u = one.along;
    const V3d& v = other.along;
    const V3d w = between + (v - u) * 0.5;
    const auto [s, t] = nearest_of(w, u, v);
    const V3d apart = w + u * s - v * t;
    const double distance = std::sqrt(apart.length2());
    if (distance >= far) skip(distance - far - 2 * apart_margin * unit_);
    if (distance >= far || distance == 0) continue;
    const V3d n = apart / distance;
    V3d slope(0);
    const double depth = support(a, n, slope) + support(b, n, slope) + gap - distance;
    if (depth > 0)
      found.push_back({a, b, s, t, n - (slope - n * slope.dot(n)) / distance, apart, depth - margin});
  }
}

/// As support_of(), of a unit direction; adds its derivative.
double KnitCloth::support(std::uint32_t piece, const V3d& direction, V3d& slope) const {
  const V3d& squeeze = squeezes_[piece];
  const double wide2 = squeeze.length2();
  if (wide2 == 0) return radii_[piece];
  const double thin = 1 - wide2;
  const double across = squeeze.dot(direction);
  const double factor = 2 + wide2 / thin;
  const double root = std::sqrt(thin + across * across * factor);
  slope += squeeze * (radii_[piece] * factor * across / root);
  return radii_[piece] * root;
}

/// Contacts press the sections of soft yarn, which pass on their strain along the yarn, recover, and stay
/// across it.
void KnitCloth::fit_sections() {
  visit_contacts([&](const Contact& contact) {
    const V3d n = contact.apart.normalized();
    const double strain =
        std::min(max_pressure, pressure * stiffness_ * contact_stiffness * contact.depth / unit_);
    for (const std::uint32_t piece : {contact.a, contact.b}) {
      if (!chains_[chain_of_[piece]].soft || is_still(piece)) continue;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) strains_[piece][i][j] -= strain * n[i] * n[j];
    }
  });
  if (has_kinds_) average_by_kind(kind_of_, images_, strains_);
  for (const Chain& chain : chains_) {
    if (!chain.soft || swollen_ == 0) continue;
    std::vector<Imath::M33d> still;
    if (!active_.empty()) still = strains_;
    diffuse_strains({strains_.begin() + chain.begin, strains_.begin() + chain.end}, spread, recovery);
    // Rounded, as logarithms differ in their last bits between machines.
    const double flat = recovery * swollen_ * static_cast<float>(std::log(chain.flattening));
    for (std::uint32_t i = chain.begin; i < chain.end; ++i) {
      if (is_still(i)) {
        strains_[i] = still[i];
        continue;
      }
      // The press that finishes cloth makes free yarn as flat as it is to be.
      strains_[i][2][2] += flat;
      reaches_[i] = radii_[i] * set_squeeze(strains_[i], along(i).normalized(), squeezes_[i]);
    }
  }
}

void KnitCloth::search() {
  neighbours_.clear();
  neighbours_.reserve(mean_neighbours * points_.size());
  first_neighbour_.assign(points_.size() + 1, 0);
  searched_.assign(points_.begin(), points_.end());
  double reach = 0;
  double widest = 0;
  std::vector<V3d> middles, inside;
  middles.reserve(points_.size());
  inside.reserve(points_.size());
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    const V3d d = along(i);
    reach = std::max(reach, length_of(d));
    widest = std::max(widest, reaches_[i]);
    middles.push_back(points_[i] + d * 0.5);
    const V3d& m = middles.back();
    // Upright, in which distances grow by up to the lean.
    inside.emplace_back(wrap_to_repeat(m.x - m.y * lean_, period_.x), wrap_to_repeat(m.y, period_.y), m.z);
  }
  reach += 2 * widest + unit_ * (gap_ + search_margin);
  reach *= 1 + std::abs(lean_);
  const PeriodicGrid grid(inside, period_, reach);
  const auto find = [&](std::uint32_t a, std::vector<Neighbour>& found) {
    if (is_still(a)) return;
    double far = reach;
    grid.visit_near(inside[a], far, [&](int other, const V3d& upright) {
      const V3d offset(upright.x + upright.y * lean_, upright.y, upright.z);
      const auto b = static_cast<std::uint32_t>(other);
      if (b < a && !is_still(b)) return;
      const double near =
          reaches_[a] + reaches_[b] + 0.55 * (lengths_[a] + lengths_[b]) + unit_ * (gap_ + search_margin);
      if (offset.length2() > near * near) return;
      const V3d turned = middles[a] + offset - middles[b];
      const double y = std::round(turned.y / period_.y);
      const double x = std::round((turned.x - y * period_.y * lean_) / period_.x);
      // Each pair once.
      if (b == a && (x < 0 || (x == 0 && y <= 0))) return;
      if (follow(a, b, x, y)) return;
      found.push_back({b, static_cast<std::int8_t>(x), static_cast<std::int8_t>(y)});
    });
  };
  std::vector<std::vector<Neighbour>> found(pieces_a_round / pieces_a_part);
  for (std::size_t first = 0; first < points_.size(); first += pieces_a_round) {
    const std::size_t count = std::min(pieces_a_round, points_.size() - first);
    parallel_chunks(count, pieces_a_part, [&](std::size_t begin, std::size_t end) {
      std::vector<Neighbour>& own = found[begin / pieces_a_part];
      own.clear();
      for (std::size_t a = begin; a < end; ++a) {
        first_neighbour_[first + a] = static_cast<std::uint32_t>(own.size());
        find(static_cast<std::uint32_t>(first + a), own);
      }
    });
    for (std::size_t a = 0; a < count; ++a) {
      const std::vector<Neighbour>& own = found[a / pieces_a_part];
      if (a % pieces_a_part == 0) neighbours_.insert(neighbours_.end(), own.begin(), own.end());
      first_neighbour_[first + a] += static_cast<std::uint32_t>(neighbours_.size() - own.size());
    }
  }
  first_neighbour_.back() = static_cast<std::uint32_t>(neighbours_.size());
}

/// Whether the pieces are so close along one chain that they do not count as a contact.
bool KnitCloth::follow(std::uint32_t a, std::uint32_t b, double x, double y) const {
  if (chain_of_[a] != chain_of_[b]) return false;
  const Chain& chain = chains_[chain_of_[a]];
  double turns = 0;
  if (chain.turns.x != 0) turns = x / chain.turns.x;
  if (turns != std::round(turns) || turns * chain.turns.y != y) return false;
  const double between = std::abs(static_cast<double>(b) - a + turns * (chain.end - chain.begin));
  return between * lengths_[a] < pi * chain.radius / std::sqrt(chain.flattening) + lengths_[a];
}

std::vector<double> KnitCloth::curvature() const {
  constexpr std::size_t samples = 64;
  std::vector<double> mean(samples, 0);
  double loops = 0;
  for (const Chain& chain : chains_) {
    const auto curvature_at = [&](std::uint32_t i) {
      i = i < chain.end ? i : chain.begin;
      return length_of(after(chain, i + 1) - points_[i] * 2.0 + before(chain, i)) /
             (lengths_[i] * lengths_[i]);
    };
    for (const Part& part : chain.parts) {
      if (!part.is_loop) continue;
      ++loops;
      for (std::size_t k = 0; k < samples; ++k) {
        const double place = 1.0 * (part.end - part.begin) * static_cast<double>(k) / samples;
        const auto i = static_cast<std::uint32_t>(place);
        const double f = place - i;
        mean[k] += (1 - f) * curvature_at(part.begin + i) + f * curvature_at(part.begin + i + 1);
      }
    }
  }
  for (double& k : mean) k /= loops;
  return mean;
}

double KnitCloth::stretch() const {
  double largest = -1;
  for (const Chain& chain : chains_) {
    double length = 0;
    double rest = 0;
    for (std::uint32_t i = chain.begin; i < chain.end; ++i) {
      length += length_of(along(i));
      rest += lengths_[i];
    }
    largest = std::max(largest, length / rest - 1);
  }
  return largest;
}

void KnitCloth::give(DrawnKnit& knit) const {
  knit.pattern.period_mm = period_;
  for (std::size_t c = 0; c < chains_.size(); ++c) {
    const Chain& chain = chains_[c];
    Yarn& yarn = knit.pattern.yarns[c];
    yarn.segments.clear();
    yarn.squeezes.clear();
    for (std::size_t p = 0; p < chain.parts.size(); ++p)
      knit.parts[c][p].segments = 2 * (chain.parts[p].end - chain.parts[p].begin);
    // The curve runs half as far inside of the polygon's corners as outside of its sides, an eighth of the
    // second difference from each other.
    const std::uint32_t count = chain.end - chain.begin;
    std::vector<V3d> places(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t k = chain.begin + i;
      places[i] = points_[k] * 0.875 + (before(chain, k) + after(chain, k + 1)) * 0.0625;
    }
    const auto place = [&](std::uint32_t i) {
      return i < count ? places[i] : places[i - count] + way(chain);
    };
    const auto tangent = [&](std::uint32_t i) {
      return (place(i + 1) - (i > 0 ? places[i - 1] : places[count - 1] - way(chain))) * 0.5;
    };
    // Plies follow segments of half a piece better.
    for (std::uint32_t k = 0; k < count; ++k) {
      const V3d end = place(k + 1);
      const V3d leaves = tangent(k) / 3.0;
      const V3d arrives = tangent(k + 1 < count ? k + 1 : 0) / 3.0;
      const V3d middle = (places[k] + end) * 0.5 + (leaves - arrives) * 0.375;
      const V3d along = (end - places[k]) * 0.25 - (leaves + arrives) * 0.125;
      yarn.segments.push_back({places[k], places[k] + leaves * 0.5, middle - along, middle});
      yarn.segments.push_back({middle, middle + along, end - arrives * 0.5, end});
      if (!chain.soft) continue;
      const V3d& squeeze = squeezes_[chain.begin + k];
      yarn.squeezes.push_back(
          squeeze_between(squeezes_[chain.begin + (k > 0 ? k : count) - 1], squeeze, 0.5));
      yarn.squeezes.push_back(squeeze);
    }
  }
}

}  // namespace selvedge
