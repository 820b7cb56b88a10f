#include "converter/stitch/yarn_relax.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "converter/stitch/flat_yarn.h"

namespace selvedge {
namespace {

struct Nearest {
  double s, t;  ///< along either piece, 0 to 1
};

/// Nearest points of two straight pieces.
Nearest nearest_of(const V3d& a, const V3d& along_a, const V3d& b, const V3d& along_b) {
  const V3d between = a - b;
  const double aa = std::max(along_a.length2(), 1e-300);
  const double bb = std::max(along_b.length2(), 1e-300);
  const double ab = along_a.dot(along_b);
  const double ca = along_a.dot(between);
  const double cb = along_b.dot(between);
  const double parallel = aa * bb - ab * ab;
  double s = parallel > 1e-9 * aa * bb ? std::clamp((ab * cb - ca * bb) / parallel, 0.0, 1.0) : 0.5;
  double t = (ab * s + cb) / bb;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((ab * t - ca) / aa, 0.0, 1.0);
  }
  return {s, t};
}

using std::numbers::pi;

/// Length of the pieces that a chain is cut into, in radii: a bend with the yarn's own radius deviates from
/// such chords by 1/50 of it.
constexpr double piece_radii = 0.4;
constexpr int projections = 8;              // of the contacts, per step
constexpr int steps_per_search = 4;         // between searches for neighbours
constexpr double growth_per_search = 0.05;  // of the radii, at most
constexpr double search_margin = 0.3;  // distance, in radii, up to which pairs are kept until the next search
constexpr int steps_between_distributions = 20;
constexpr int settling_steps = 60;  // at the end, contacts alone
constexpr int max_settling_steps = 400;
constexpr double settled_overlap = 2e-3;  // overlap, in radii, that ends the settling
constexpr double over_relaxation = 1.4;   // of projections that are averaged

/// The same of rough relaxation.
constexpr double rough_piece_radii = 0.8;
constexpr int rough_steps = 60;
constexpr double rough_settled_overlap = 0.02;
/// Distances, in half widths of the widest yarn, up to which pairs are kept until the next search and through
/// the projections of a step.
constexpr double rough_search_margin = 0.2;
constexpr double rough_step_margin = 0.05;
constexpr std::size_t rough_kernel = 64;  ///< points, within which a smoothing kernel vanishes

/// Sections of soft yarn: strain that a step adds for an overlap of a radius; fraction of the strain that it
/// takes back, and that it passes on to either neighbour; least fraction of thickness in width.
constexpr double soft_pressure = 1.5;
constexpr double soft_recovery = 0.05;
constexpr double soft_spread = 0.25;
constexpr double soft_min_width = 0.3;

/// Length of the resulting segments, in radii; sections of soft yarn change within a radius.
constexpr double segment_radii = 0.8;
constexpr double soft_segment_radii = 0.4;

/// A yarn as a polyline. Point `size` is point 0 moved by `way`.
struct Chain {
  std::vector<V3d> points;
  V3d way;
  V3d across{0, 0, 0};  ///< unit, in the plane, perpendicular to `way`; zero for a ring
  double drawn = 0;     ///< its drawn position along `across`
  bool soft = false;
  double radius = 0;
  double flattening = 1;
  double wide = 0;              ///< half the width of its section, mm
  double thin = 0;              ///< and half the thickness
  std::vector<double> reaches;  ///< half the width by piece, mm
  /// Logarithms of stretches across soft yarn, by piece, without trace; and squeezes.
  std::vector<Imath::M33d> strains;
  std::vector<V3d> squeezes;
  std::size_t begin = 0;  ///< index of its first point among the points of all chains
  double spacing = 0;     ///< of its points, mm, within a factor of two of each
  double length() const {
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) sum += (next(i) - points[i]).length();
    return sum;
  }
  V3d next(std::size_t i) const { return i + 1 < points.size() ? points[i + 1] : points[0] + way; }
};

/// Points at equal distances along a chain, linear between the old ones.
std::vector<V3d> resampled(const Chain& chain, std::size_t count) {
  const double step = chain.length() / static_cast<double>(count);
  std::vector<V3d> points;
  double walked = 0;
  for (std::size_t i = 0; i < chain.points.size() && points.size() < count; ++i) {
    const V3d a = chain.points[i];
    const V3d b = chain.next(i);
    const double length = (b - a).length();
    while (points.size() < count && static_cast<double>(points.size()) * step <= walked + length) {
      const double part = (static_cast<double>(points.size()) * step - walked) / std::max(length, 1e-300);
      points.push_back(a + (b - a) * std::clamp(part, 0.0, 1.0));
    }
    walked += length;
  }
  while (points.size() < count) points.push_back(chain.points.back());  // rounding at the very end
  return points;
}

/// One implicit step of a closed chain under tension and bending is a convolution: the step's inverse is
/// diagonal in Fourier space. `time` in squared radii.
std::vector<double> kernel_of(std::size_t count, double spacing, double radius, double time, double bending) {
  const auto n = static_cast<double>(count);
  std::vector<double> damping(count);
  std::vector<double> cosine(count);
  for (std::size_t k = 0; k < count; ++k) {
    cosine[k] = std::cos(2 * pi * static_cast<double>(k) / n);
    const double stretch = 2 * (1 - cosine[k]) * radius * radius / (spacing * spacing);
    damping[k] = 1 / (1 + time * stretch * (1 + bending * bending * stretch));
  }
  std::vector<double> kernel(count, 0.0);
  for (std::size_t d = 0; d <= count / 2; ++d) {
    double sum = 0;
    for (std::size_t k = 0; k < count; ++k) sum += damping[k] * cosine[k * d % count];
    kernel[d] = sum / n;
    if (d > 0) kernel[count - d] = kernel[d];
  }
  return kernel;
}

void smooth(Chain& chain, const std::vector<double>& kernel) {
  const std::size_t count = chain.points.size();
  // The periodic part: the offset from the straight line between one repeat and the next.
  std::vector<V3d> bent(count);
  const V3d step = chain.way / static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i) bent[i] = chain.points[i] - step * static_cast<double>(i);
  const std::size_t width = kernel.size();
  for (std::size_t i = 0; i < count; ++i) {
    V3d sum(0);
    // A whole kernel begins at the first point, one that is cut off half its width before the point.
    std::size_t j = width == count ? 0 : (i + count - width / 2) % count;
    std::size_t d = width == count ? i : width / 2;
    for (std::size_t k = 0; k < width; ++k) {
      sum += bent[j] * kernel[d];
      j = j + 1 < count ? j + 1 : 0;
      d = d > 0 ? d - 1 : width - 1;
    }
    chain.points[i] = sum + step * static_cast<double>(i);
  }
}

/// Two pieces of chains that may touch: the second one moved by `shift`.
struct Contact {
  std::size_t chain_a, piece_a;
  std::size_t chain_b, piece_b;
  V3d shift;
};

class Relaxation {
 public:
  Relaxation(const StitchPattern& pattern, const RelaxOptions& options)
      : options_(options),
        piece_(options.rough ? rough_piece_radii : piece_radii),
        period_(pattern.period_mm.x, pattern.period_mm.y, 0) {
    if (options.rough) options_.steps = rough_steps;
    for (const Yarn& yarn : pattern.yarns) {
      Chain chain;
      chain.soft = yarn.fibre != 0;
      any_soft_ |= chain.soft;
      chain.radius = yarn.radius_mm;
      chain.flattening = yarn.flattening;
      chain.wide = chain.soft ? yarn.radius_mm : wide_of(yarn);
      chain.thin = chain.soft ? yarn.radius_mm : thin_of(yarn);
      const V2i turns = turns_of(yarn, pattern.period_mm);
      chain.way = {turns.x * period_.x, turns.y * period_.y, 0};
      constexpr int fine = 32;
      for (const BezierSegment& segment : yarn.segments) {
        for (int k = 0; k < fine; ++k) chain.points.push_back(point_at(segment, 1.0 * k / fine));
      }
      if (chain.way.length2() > 0) chain.across = V3d(-chain.way.y, chain.way.x, 0).normalized();
      for (const V3d& p : chain.points)
        chain.drawn += p.dot(chain.across) / static_cast<double>(chain.points.size());
      chains_.push_back(chain);
      thickest_ = std::max(thickest_, chain.thin);
    }
    distribute();
  }

  /// Returns the fraction of the radii for which there is room.
  double run() {
    const int growing = any_soft_ ? options_.steps * 9 / 10 : options_.steps / 2;
    const double growth = (1 - options_.start) / (0.4 * options_.steps);
    grown_ = options_.start;
    for (int step = 0; step < options_.steps; ++step) {
      if (step % steps_between_distributions == 0) distribute();
      // Long steps for the thickness while the yarns grow, then shrinking ones.
      const double remaining =
          step < growing ? 1.0 : static_cast<double>(options_.steps - step) / (options_.steps - growing);
      const double time = 0.03 * remaining * remaining * grown_ * grown_ + 1e-4;
      for (Chain& chain : chains_) {
        const double spacing = chain.length() / static_cast<double>(chain.points.size());
        const std::size_t count = chain.points.size();
        const std::size_t width = options_.rough ? std::min(count, rough_kernel) : count;
        smooth(chain, kernel_of(width, spacing, chain.radius, time, options_.bending));
        for (V3d& p : chain.points)
          p += chain.across * (options_.hold * remaining * (chain.drawn - p.dot(chain.across)));
      }
      if (any_soft_) soften(soft_recovery);
      const double overlap = push_apart(step);
      // Soft yarn jams for moments, and grows again.
      const bool jammed = overlap > (any_soft_ ? 0.06 : 0.05 * remaining + 0.01);
      if (jammed) grown_ *= 1 - 0.5 * growth;
      if (!jammed && (any_soft_ || step < growing)) grown_ = std::min(1.0, grown_ + growth);
    }
    // Contacts alone; the yarns become thinner if they do not settle.
    for (int step = 0; step < max_settling_steps; ++step) {
      if (any_soft_) soften(0);
      const double overlap = push_apart(step);
      if (overlap < (options_.rough ? rough_settled_overlap : settled_overlap)) break;
      if (step >= settling_steps) grown_ *= 1 - 0.25 * overlap;
    }
    // Woven yarn that is longer has climbed over others.
    constexpr double max_crimped = 1.6;
    const bool climbed = options_.hold > 0 && std::ranges::any_of(chains_, [](const Chain& chain) {
                           return chain.length() > max_crimped * chain.way.length();
                         });
    return climbed ? std::min(grown_, 0.9) : grown_;
  }

  /// `squeezes`: of soft yarn, where the segments start.
  std::vector<BezierSegment> segments_of(std::size_t index, std::vector<V3d>& squeezes) const {
    const Chain& chain = chains_[index];
    const auto count = static_cast<long>(chain.points.size());
    const double node_count =
        std::round(chain.length() / ((chain.soft ? soft_segment_radii : segment_radii) * chain.radius));
    // Keeps some of the points, with tangents from their neighbours.
    const auto nodes = static_cast<long>(std::clamp(node_count, 4.0, static_cast<double>(count)));
    const auto point = [&](long i) {
      const long turn = i >= 0 ? i / count : -((count - 1 - i) / count);
      return chain.points[i - turn * count] + chain.way * static_cast<double>(turn);
    };
    const auto node = [&](long k) {
      return std::lround(static_cast<double>(k * count) / static_cast<double>(nodes));
    };
    const auto tangent = [&](long i) {  // central differences of fourth order, per point
      return (point(i + 1) - point(i - 1)) * (2.0 / 3) - (point(i + 2) - point(i - 2)) * (1.0 / 12);
    };
    std::vector<BezierSegment> segments;
    for (long k = 0; k < nodes; ++k) {
      const long i = node(k);
      const long j = node(k + 1);
      if (chain.soft)
        squeezes.push_back(
            squeeze_between(chain.squeezes[(i + count - 1) % count], chain.squeezes[i % count], 0.5));
      const double third = static_cast<double>(j - i) / 3;
      const V3d end = point(j);
      segments.push_back({point(i), point(i) + tangent(i) * third, end - tangent(j) * third, end});
    }
    return segments;
  }

  void centre() {
    double low = std::numeric_limits<double>::max();
    double high = std::numeric_limits<double>::lowest();
    for (const Chain& chain : chains_) {
      for (const V3d& p : chain.points) {
        low = std::min(low, p.z - chain.thin);
        high = std::max(high, p.z + chain.thin);
      }
    }
    for (Chain& chain : chains_) {
      for (V3d& p : chain.points) p.z -= 0.5 * (low + high);
    }
  }

 private:
  /// Projects all contacts repeatedly; returns the largest remaining overlap, in radii.
  double push_apart(int step) {
    if (step % steps_per_search == 0) search();
    if (options_.rough) {
      touching_ = contacts_;
      std::erase_if(touching_, [&](const Contact& c) { return !overlap_of(c, rough_step_margin * widest_); });
    }
    double overlap = 0;
    for (int k = 0; k < projections; ++k) overlap = project();
    return overlap;
  }

  void distribute() {
    std::size_t begin = 0;
    for (Chain& chain : chains_) {
      const double pieces = std::max(12.0, std::round(chain.length() / (piece_ * chain.radius)));
      const std::size_t before = chain.points.size();
      chain.points = resampled(chain, static_cast<std::size_t>(pieces));
      chain.reaches.assign(chain.points.size(), chain.wide);
      if (chain.soft) {
        const std::vector<Imath::M33d> old = chain.strains;
        chain.strains.assign(chain.points.size(), Imath::M33d(0.0));
        for (std::size_t i = 0; i < chain.points.size() && !old.empty(); ++i)
          chain.strains[i] = old[i * before / chain.points.size()];
        set_squeezes(chain);
      }
      chain.begin = begin;
      chain.spacing = chain.length() / pieces;
      begin += chain.points.size();
    }
    contacts_.clear();
    search();
  }

  double distance_of(const Contact& c, double reach) const {
    return grown_ * (reach + options_.gap * std::max(chains_[c.chain_a].radius, chains_[c.chain_b].radius));
  }

  /// Direction in which pieces leave each other. Soft ones that cross stay on their sides.
  V3d direction_of(const V3d& apart, const Section& a, const Section& b, const V3d& along_a,
                   const V3d& along_b) const {
    constexpr double min_sine2 = 0.1;
    const double sine2 = along_a.cross(along_b).length2() / (along_a.length2() * along_b.length2());
    if (any_soft_ && sine2 > min_sine2) return apart.normalized();
    return options_.rough ? direction_between(apart, a, b, 1) : direction_between(apart, a, b);
  }

  /// How two pieces overlap.
  struct Overlap {
    Nearest nearest;
    V3d direction;  ///< unit, from the second to the first
    double depth;   ///< mm
  };
  /// Nothing where they are `margin` or more apart, mm.
  std::optional<Overlap> overlap_of(const Contact& c, double margin = 0) const {
    const Chain& chain_a = chains_[c.chain_a];
    const Chain& chain_b = chains_[c.chain_b];
    const V3d a = chain_a.points[c.piece_a];
    const V3d b = chain_b.points[c.piece_b] + c.shift;
    const V3d along_a = chain_a.next(c.piece_a) - a;
    const V3d along_b = chain_b.next(c.piece_b) + c.shift - b;
    double min_distance = distance_of(c, chain_a.reaches[c.piece_a] + chain_b.reaches[c.piece_b]) + margin;
    const double far = min_distance + chain_a.spacing + chain_b.spacing;
    if ((a + along_a * 0.5 - b - along_b * 0.5).length2() > far * far) return std::nullopt;
    const Nearest n = nearest_of(a, along_a, b, along_b);
    const V3d apart = a + along_a * n.s - b - along_b * n.t;
    double distance = std::sqrt(apart.length2());  // length() is a call, on the hottest path here
    if (distance >= min_distance || distance == 0) return std::nullopt;
    V3d direction = apart / distance;
    if (any_soft_ || chain_a.flattening < 1 || chain_b.flattening < 1) {
      const Section section_a = section_of(chain_a, c.piece_a, along_a);
      const Section section_b = section_of(chain_b, c.piece_b, along_b);
      direction = direction_of(apart, section_a, section_b, along_a, along_b);
      distance = apart.dot(direction);
      min_distance =
          distance_of(c, support_of(section_a, direction) + support_of(section_b, direction)) + margin;
      if (distance >= min_distance) return std::nullopt;
    }
    return Overlap{n, direction, min_distance - distance};
  }

  /// Flattens soft sections where pieces overlap.
  void press() {
    for (const Contact& c : contacts_) {
      const auto overlap = overlap_of(c);
      if (!overlap) continue;
      const V3d& d = overlap->direction;
      for (const auto& [chain, piece] : {std::pair(c.chain_a, c.piece_a), std::pair(c.chain_b, c.piece_b)}) {
        if (!chains_[chain].soft) continue;
        Imath::M33d& strain = chains_[chain].strains[piece];
        const double fraction = soft_pressure * overlap->depth / (grown_ * chains_[chain].radius);
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j) strain[i][j] -= fraction * d[i] * d[j];
        }
      }
    }
  }

  /// Sections flatten under pressure, pass it on along the yarn, and recover by this fraction.
  void soften(double recovery) {
    press();
    for (Chain& chain : chains_) {
      if (!chain.soft) continue;
      const std::vector<Imath::M33d> old = chain.strains;
      const std::size_t count = old.size();
      for (std::size_t i = 0; i < count; ++i) {
        chain.strains[i] = (old[i] * (1 - 2 * soft_spread) +
                            (old[(i + 1) % count] + old[(i + count - 1) % count]) * soft_spread) *
                           (1 - recovery);
      }
      // The press that finishes cloth makes free yarn as flat as it is to be.
      for (Imath::M33d& strain : chain.strains) strain[2][2] += recovery * std::log(chain.flattening);
      set_squeezes(chain);
    }
  }

  /// Keeps strains across their piece, without trace, and within bounds.
  static void set_squeezes(Chain& chain) {
    if (!chain.soft) return;
    chain.squeezes.resize(chain.points.size());
    for (std::size_t i = 0; i < chain.points.size(); ++i) {
      const V3d along = (chain.next(i) - chain.points[i]).normalized();
      const V3d axis = std::abs(along.z) < 0.9 ? V3d(0, 0, 1) : V3d(1, 0, 0);
      const V3d x = (axis - along * axis.dot(along)).normalized();
      const V3d y = along.cross(x);
      Imath::M33d& strain = chain.strains[i];
      // In the plane of x and y it is (c, s; s, -c).
      const double c = 0.5 * (x.dot(x * strain) - y.dot(y * strain));
      const double s = x.dot(y * strain);
      const double most = -0.5 * std::log(soft_min_width);
      const double size = std::hypot(c, s);
      const double part = size > most ? most / size : 1;
      for (int k = 0; k < 3; ++k) {
        for (int l = 0; l < 3; ++l)
          strain[k][l] = part * (c * (x[k] * x[l] - y[k] * y[l]) + s * (x[k] * y[l] + y[k] * x[l]));
      }
      const double stretch = std::min(size, most);
      const double angle = 0.5 * std::atan2(s, c);
      chain.squeezes[i] = (x * std::cos(angle) + y * std::sin(angle)) * std::sqrt(1 - std::exp(-2 * stretch));
      chain.reaches[i] = chain.radius * std::exp(stretch);
    }
  }

  static Section section_of(const Chain& chain, std::size_t piece, const V3d& along) {
    if (chain.soft) return {chain.radius, chain.squeezes[piece]};
    const bool flat = chain.flattening < 1 && along.length2() > 0;
    return {chain.radius, flat ? squeeze_of(chain.flattening, along.normalized()) : V3d(0, 0, 0)};
  }

  /// Whether the pieces are so close along one chain that they do not count as a contact.
  bool follow(const Contact& c) const {
    if (c.chain_a != c.chain_b) return false;
    const Chain& chain = chains_[c.chain_a];
    const auto n = static_cast<double>(chain.points.size());
    double along = static_cast<double>(c.piece_b) - static_cast<double>(c.piece_a);
    const double way2 = chain.way.length2();
    if (way2 == 0) {
      if (c.shift != V3d(0)) return false;
      along = std::abs(along);
      along = std::min(along, n - along);
    } else {
      const double turns = std::round(c.shift.dot(chain.way) / way2);
      if ((c.shift - chain.way * turns).length2() > 1e-12 * way2) return false;
      along = std::abs(along + turns * n);
    }
    return along * chain.length() / n < (pi + piece_) * chain.wide;
  }

  void search() {
    contacts_.clear();
    widest_ = 0;
    for (const Chain& chain : chains_) widest_ = std::max(widest_, std::ranges::max(chain.reaches));
    const double reach = widest_ * (2 + options_.gap + piece_ + search_margin);
    const int nx = std::max(1, static_cast<int>(period_.x / reach));
    const int ny = std::max(1, static_cast<int>(period_.y / reach));
    struct Place {
      std::size_t chain, piece;
      V3d middle;       ///< within the cell
      V3d cell_origin;  ///< of its cell, subtracted to bring it there
    };
    std::vector<std::vector<Place>> bins(static_cast<std::size_t>(nx) * ny);
    std::vector<Place> places;
    const auto bin_at = [](double value, double period, int bins_along) {
      return static_cast<int>(std::floor(value / period * bins_along));
    };
    for (std::size_t c = 0; c < chains_.size(); ++c) {
      const Chain& chain = chains_[c];
      for (std::size_t i = 0; i < chain.points.size(); ++i) {
        const V3d middle = (chain.points[i] + chain.next(i)) * 0.5;
        const V3d cell_origin(std::floor(middle.x / period_.x) * period_.x,
                              std::floor(middle.y / period_.y) * period_.y, 0);
        const V3d inside = middle - cell_origin;
        places.push_back({c, i, inside, cell_origin});
        const int x = std::clamp(bin_at(inside.x, period_.x, nx), 0, nx - 1);
        const int y = std::clamp(bin_at(inside.y, period_.y, ny), 0, ny - 1);
        bins[y * nx + x].push_back(places.back());
      }
    }
    for (const Place& a : places) {
      const int x0 = bin_at(a.middle.x - reach, period_.x, nx);
      const int x1 = bin_at(a.middle.x + reach, period_.x, nx);
      const int y0 = bin_at(a.middle.y - reach, period_.y, ny);
      const int y1 = bin_at(a.middle.y + reach, period_.y, ny);
      for (int y = y0; y <= y1; ++y) {
        const int turn_y = static_cast<int>(std::floor(static_cast<double>(y) / ny));
        for (int x = x0; x <= x1; ++x) {
          const int turn_x = static_cast<int>(std::floor(static_cast<double>(x) / nx));
          const V3d turned(turn_x * period_.x, turn_y * period_.y, 0);
          for (const Place& b : bins[(y - turn_y * ny) * nx + x - turn_x * nx]) {
            add(a.chain, a.piece, b.chain, b.piece, b.middle + turned - a.middle,
                turned + a.cell_origin - b.cell_origin);
          }
        }
      }
    }
  }

  void add(std::size_t chain_a, std::size_t piece_a, std::size_t chain_b, std::size_t piece_b,
           const V3d& between, const V3d& shift) {
    // Each pair once.
    if (chain_b < chain_a || (chain_b == chain_a && piece_b < piece_a)) return;
    if (chain_b == chain_a && piece_b == piece_a && (shift.x < 0 || (shift.x == 0 && shift.y <= 0))) return;
    const double radii = chains_[chain_a].reaches[piece_a] + chains_[chain_b].reaches[piece_b];
    const double reach =
        std::min(1.0, grown_ + growth_per_search) * radii + widest_ * (options_.gap + piece_ + search_margin);
    if (between.length2() > reach * reach) return;
    const Contact contact{chain_a, piece_a, chain_b, piece_b, shift};
    if (options_.rough && !overlap_of(contact, rough_search_margin * widest_)) return;
    if (!follow(contact)) contacts_.push_back(contact);
  }

  /// Moves overlapping pieces apart once; returns the largest overlap before, in radii.
  double project() {
    double largest = 0;
    const std::size_t total = chains_.back().begin + chains_.back().points.size();
    moves_.assign(total, V3d(0));
    weights_.assign(total, 0.0);
    for (const Contact& c : options_.rough ? touching_ : contacts_) {
      const Chain& chain_a = chains_[c.chain_a];
      const Chain& chain_b = chains_[c.chain_b];
      const auto overlap = overlap_of(c);
      if (!overlap) continue;
      const Nearest& n = overlap->nearest;
      largest = std::max(largest, overlap->depth / (grown_ * std::min(chain_a.radius, chain_b.radius)));
      const double parts[4] = {1 - n.s, n.s, 1 - n.t, n.t};
      double norm = 0;
      for (const double part : parts) norm += part * part;
      const V3d move = overlap->direction * (overlap->depth / norm);
      const std::size_t indices[4] = {
          chain_a.begin + c.piece_a, chain_a.begin + (c.piece_a + 1) % chain_a.points.size(),
          chain_b.begin + c.piece_b, chain_b.begin + (c.piece_b + 1) % chain_b.points.size()};
      for (std::size_t k = 0; k < 4; ++k) {
        moves_[indices[k]] += move * (k < 2 ? parts[k] : -parts[k]) * parts[k];
        weights_[indices[k]] += parts[k];
      }
    }
    for (Chain& chain : chains_) {
      for (std::size_t i = 0; i < chain.points.size(); ++i) {
        const double weight = weights_[chain.begin + i];
        if (weight > 0) chain.points[i] += moves_[chain.begin + i] * (over_relaxation / weight);
      }
    }
    limit_thickness();
    return largest;
  }

  /// Clamps all yarns to max_thickness.
  void limit_thickness() {
    if (options_.max_thickness == 0) return;
    for (Chain& chain : chains_) {
      const double max_z = grown_ * std::max(0.0, 0.5 * options_.max_thickness * thickest_ - chain.thin);
      for (V3d& p : chain.points) p.z = std::clamp(p.z, -max_z, max_z);
    }
  }

  RelaxOptions options_;
  double piece_;  ///< length of pieces, radii
  V3d period_;
  std::vector<Chain> chains_;
  std::vector<Contact> contacts_;
  std::vector<Contact> touching_;  ///< or nearly; of rough relaxation
  std::vector<V3d> moves_;
  std::vector<double> weights_;
  double thickest_ = 0, widest_ = 0;  ///< the most of half the thickness and of half the width, mm
  double grown_ = 0;
  bool any_soft_ = false;
};

}  // namespace

Relaxed relax(const StitchPattern& pattern, const RelaxOptions& options) {
  const double min_part = options.rough ? 0.85 : 0.95;
  constexpr int max_tries = 4;
  Relaxed relaxed{pattern, 1};
  Relaxation relaxation(pattern, options);
  double part = relaxation.run();
  for (int tries = 1; options.thins && part < min_part && tries < max_tries; ++tries) {
    const double thinner = 0.95 * part;
    relaxed.part *= thinner;
    for (Yarn& yarn : relaxed.pattern.yarns) yarn.radius_mm *= thinner;
    relaxation = Relaxation(relaxed.pattern, options);
    part = relaxation.run();
  }
  relaxed.part *= part;
  relaxed.settled = part >= min_part;
  relaxation.centre();
  for (std::size_t y = 0; y < relaxed.pattern.yarns.size(); ++y) {
    relaxed.pattern.yarns[y].segments = relaxation.segments_of(y, relaxed.pattern.yarns[y].squeezes);
    relaxed.pattern.yarns[y].radius_mm *= part;
    if (!relaxed.pattern.yarns[y].squeezes.empty()) relaxed.pattern.yarns[y].flattening = 1;
  }
  return relaxed;
}

}  // namespace selvedge
