#include "converter/stitch/yarn_relax.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>

#include "converter/mesh/surface_points.h"
#include "converter/stitch/clearance.h"
#include "converter/stitch/flat_yarn.h"
#include "converter/stitch/relax_chain.h"
#include "converter/stitch/weave.h"

namespace selvedge {
namespace {

using std::numbers::pi;

/// Length of the pieces that a chain is cut into, in radii: a bend with the yarn's own radius deviates from
/// such chords by 1/50 of it.
constexpr double piece_radii = 0.4;
constexpr int projections = 8;  // of the contacts, per step
/// Distances, in half widths of the widest yarn, up to which pairs are kept in a list until pieces may have
/// come as much nearer: all that are searched for, and those that are projected.
constexpr double search_margin = 0.6;
constexpr double touch_margin = 0.06;
/// Sections beside each other may come nearer so many times as fast as they travel, as their direction turns
/// and their nearest points slide.
constexpr double turning = 4;
constexpr int steps_between_distributions = 20;
constexpr int settling_steps = 60;  // at the end, contacts alone
constexpr int max_settling_steps = 400;
constexpr double settled_overlap = 2e-3;  // overlap, in radii, that ends the settling
constexpr double over_relaxation = 1.4;   // of projections that are averaged

/// The same of rough relaxation.
constexpr double rough_piece_radii = 0.8;
constexpr int rough_projections = 6;
constexpr int rough_steps = 60;
constexpr double rough_settled_overlap = 0.02;
constexpr double crimp = 1.1;  // of yarns over their way, about

/// Sections of soft yarn: strain that a step adds for an overlap of a radius; fraction of the strain that it
/// takes back, and that it passes on to either neighbour.
constexpr double soft_pressure = 1.5;
constexpr double soft_recovery = 0.05;
constexpr double soft_spread = 0.25;

/// Length of the resulting segments, in radii; sections of soft yarn change within a radius.
constexpr double segment_radii = 0.8;
constexpr double soft_segment_radii = 0.4;

/// A straight piece of a chain, as the contacts see it.
struct Piece {
  V3d start, along;
  YarnSection section;
  double reach = 0;                              ///< half the width, mm
  double extent = 0;                             ///< the same with its gap, as far as the yarn has grown
  double half = 0;                               ///< of its length, mm
  std::uint32_t chain = 0, index = 0, next = 0;  ///< `index` in its chain, `next` among all points
};

/// Two pieces that may touch: the second one moved by `shift`.
struct Contact {
  std::uint32_t a, b;
  V3d shift;
  double free = 0;  ///< how far both have travelled together when they may touch first, mm
};

class Relaxation {
 public:
  Relaxation(const StitchPattern& pattern, const RelaxOptions& options)
      : options_(options), period_(pattern.period_mm.x, pattern.period_mm.y, 0) {
    if (options.is_rough) options_.steps = rough_steps;
    if (options.is_rough && options.in_plane_restoring > 0) kinds_ = crossing_kinds(pattern);
    for (const Yarn& yarn : pattern.yarns) {
      RelaxChain chain;
      chain.is_soft = yarn.fibre_kind != 0;
      any_soft_ |= chain.is_soft;
      chain.radius = yarn.radius_mm;
      chain.flattening = yarn.flattening;
      chain.log_flattening = static_cast<float>(std::log(yarn.flattening));
      chain.half_width = chain.is_soft ? yarn.radius_mm : half_width_of(yarn);
      chain.half_thickness = chain.is_soft ? yarn.radius_mm : half_thickness_of(yarn);
      const V2i turns = chain_periods(yarn, pattern.period_mm);
      chain.period_offset = {turns.x * period_.x, turns.y * period_.y, 0};
      constexpr int fine = 32;
      for (const BezierSegment& segment : yarn.segments)
        for (int k = 0; k < fine; ++k) chain.points.push_back(point_at(segment, 1.0 * k / fine));
      // Parts of yarns that rest alike begin half-way between two crossings.
      if (!kinds_.empty()) {
        std::rotate(chain.points.begin(), chain.points.begin() + fine / 2, chain.points.end());
        for (int k = 0; k < fine / 2; ++k) chain.points.end()[-1 - k] += chain.period_offset;
      }
      // Rounded, as the sines of drawings differ in their last bits between machines.
      const double unit = yarn.radius_mm / (1 << 20);
      for (V3d& p : chain.points)
        for (int k = 0; k < 3; ++k) p[k] = unit * std::round(p[k] / unit);
      if (chain.period_offset.length2() > 0)
        chain.across = V3d(-chain.period_offset.y, chain.period_offset.x, 0).normalized();
      for (const V3d& p : chain.points)
        chain.drawn_offset += p.dot(chain.across) / static_cast<double>(chain.points.size());
      chains_.push_back(chain);
      thickest_ = std::max(thickest_, chain.half_thickness);
    }
    distribute();
    number_points();
  }

  /// Returns the fraction of the radii for which there is room.
  double run() {
    const int growing = any_soft_ ? options_.steps * 9 / 10 : options_.steps / 2;
    const double growth = (1 - options_.start_fraction) / (0.4 * options_.steps);
    grown_ = options_.start_fraction;
    if (!options_.is_rough) piece_ = piece_radii;
    for (int step = 0; step < options_.steps; ++step) {
      if (options_.progress) options_.progress(1.0 * step / options_.steps);
      if (step % steps_between_distributions == 0) distribute();
      // Long steps for the thickness while the yarns grow, then shrinking ones.
      const double remaining =
          step < growing ? 1.0 : static_cast<double>(options_.steps - step) / (options_.steps - growing);
      const double time = 0.03 * remaining * remaining * grown_ * grown_ + 1e-4;
      for (RelaxChain& chain : chains_) {
        smooth(chain, time, options_.bending_length_radii);
        for (V3d& p : chain.points)
          p += chain.across *
               (options_.in_plane_restoring * remaining * (chain.drawn_offset - p.dot(chain.across)));
      }
      lay_pieces();
      if (any_soft_) soften(soft_recovery);
      const double overlap = push_apart();
      // Soft yarn jams for moments, and grows again.
      const bool jammed = overlap > (any_soft_ ? 0.06 : 0.05 * remaining + 0.01);
      if (jammed) grown_ *= 1 - 0.5 * growth;
      if (!jammed && (any_soft_ || step < growing)) grown_ = std::min(1.0, grown_ + growth);
    }
    // Contacts alone; the yarns become thinner if they do not settle. Sections keep their shape then: as it
    // spreads, those under pressure would grow thicker.
    for (int step = 0; step < max_settling_steps; ++step) {
      if (any_soft_ && step < settling_steps) soften(0);
      const double overlap = push_apart();
      if (overlap < (options_.is_rough ? rough_settled_overlap : settled_overlap)) break;
      if (step >= settling_steps) grown_ *= 1 - 0.25 * overlap;
    }
    // Woven yarn that is longer has climbed over others.
    constexpr double max_crimped = 1.6;
    const bool climbed =
        options_.in_plane_restoring > 0 && std::ranges::any_of(chains_, [](const RelaxChain& chain) {
          return chain.length() > max_crimped * chain.period_offset.length();
        });
    return climbed ? std::min(grown_, 0.9) : grown_;
  }

  /// `squeezes`: of soft yarn, where the segments start.
  std::vector<BezierSegment> segments_of(std::size_t index, std::vector<V3d>& squeezes) const {
    const RelaxChain& chain = chains_[index];
    const auto count = static_cast<long>(chain.points.size());
    const double node_count =
        std::round(chain.length() / ((chain.is_soft ? soft_segment_radii : segment_radii) * chain.radius));
    // Keeps some of the points, with tangents from their neighbours.
    const auto nodes = static_cast<long>(std::clamp(node_count, 4.0, static_cast<double>(count)));
    const auto point = [&](long i) {
      const long turn = i >= 0 ? i / count : -((count - 1 - i) / count);
      return chain.points[i - turn * count] + chain.period_offset * static_cast<double>(turn);
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
      if (chain.is_soft)
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
    for (const RelaxChain& chain : chains_) {
      for (const V3d& p : chain.points) {
        low = std::min(low, p.z - chain.half_thickness);
        high = std::max(high, p.z + chain.half_thickness);
      }
    }
    for (RelaxChain& chain : chains_)
      for (V3d& p : chain.points) p.z -= 0.5 * (low + high);
  }

 private:
  /// Lists the contacts of pieces that may touch now.
  void find_touching() {
    if (approach_ <= touch_margin * widest_) return;
    double moved = 0;  // since the last search; pieces of different chains may have met
    for (std::size_t i = 0; i < pieces_.size(); ++i)
      moved = std::max(moved, std::sqrt((pieces_[i].start - searched_[i].start).length2()) +
                                  pieces_[i].extent - searched_[i].extent);
    if ((options_.is_rough ? 1 : 2) * moved > (search_margin - touch_margin) * widest_) search();
    touching_.clear();
    touching_.reserve(contacts_.size());
    const double margin = touch_margin * widest_;
    const double* const travels = travels_.data();
    for (Contact& c : contacts_)
      if (travels[c.a] + travels[c.b] + margin >= c.free) touching_.push_back(&c);
    approach_ = 0;
  }

  /// Projects all contacts repeatedly; returns the largest remaining overlap, in radii.
  double push_apart() {
    double overlap = 0;
    for (int k = 0; k < (options_.is_rough ? rough_projections : projections); ++k) overlap = project();
    return overlap;
  }

  void distribute() {
    std::size_t begin = 0;
    for (std::size_t c = 0; c < chains_.size(); ++c) {
      RelaxChain& chain = chains_[c];
      const std::size_t parts = kinds_.empty() ? 1 : kinds_[c].size();
      const double length = kinds_.empty() ? chain.length() : crimp * chain.period_offset.length();
      const auto each = static_cast<double>(parts);
      const double pieces =
          each * std::max(std::ceil(12 / each), std::round(length / (piece_ * chain.radius * each)));
      const std::size_t before = chain.points.size();
      chain.points = resampled(chain, static_cast<std::size_t>(pieces), parts);
      chain.half_widths.assign(chain.points.size(), chain.half_width);
      const std::vector<Imath::M33d> old = chain.strains;
      chain.strains.assign(chain.points.size(), Imath::M33d(0.0));
      for (std::size_t i = 0; i < chain.points.size() && !old.empty(); ++i)
        chain.strains[i] = old[i * before / chain.points.size()];
      set_squeezes(chain);
      chain.first_index = begin;
      chain.spacing = chain.length() / pieces;
      begin += chain.points.size();
    }
    lay_pieces();
    search();
  }

  /// Gives the points of equal crossings the same numbers: left to themselves these rest up to 0.3 radii
  /// apart. Points belong to the crossing that is nearest along their yarn, or to both.
  void number_points() {
    std::map<std::array<std::size_t, 4>, std::uint32_t> numbers;
    for (std::size_t c = 0; c < kinds_.size(); ++c) {
      const std::size_t parts = kinds_[c].size();
      const std::size_t count = chains_[c].points.size() / parts;
      for (std::size_t i = 0; i < parts * count; ++i) {
        const std::size_t at = i % count;
        const std::size_t own = kinds_[c][(i / count + 1) % parts];
        const bool is_warp = c < kinds_.size() - kinds_[0].size();
        const std::array key{is_warp ? at : ~at, count, own, at == 0 ? kinds_[c][i / count] : own};
        const auto number = static_cast<std::uint32_t>(numbers.size());
        kind_of_.push_back(numbers.try_emplace(key, number).first->second);
      }
    }
    images_.assign(numbers.size(), no_image);
  }

  template <class Value>
  void average_chains_by_kind(std::vector<Value> RelaxChain::*values) {
    std::vector<Value> all;
    for (const RelaxChain& chain : chains_)
      all.insert(all.end(), (chain.*values).begin(), (chain.*values).end());
    average_by_kind(kind_of_, images_, all);
    auto mean = all.begin();
    for (RelaxChain& chain : chains_)
      for (Value& value : chain.*values) value = *mean++;
  }

  /// Adds the straight yarns to the points, or subtracts them.
  void add_straight(double sign) {
    for (RelaxChain& chain : chains_) {
      V3d straight = chain.across * (sign * chain.drawn_offset);
      for (V3d& p : chain.points) {
        p += straight;
        straight += chain.period_offset * (sign / static_cast<double>(chain.points.size()));
      }
    }
  }

  /// Sets pieces_ by the chains, and adds to travels_.
  void lay_pieces() {
    if (!kind_of_.empty()) {
      add_straight(-1);
      average_chains_by_kind(&RelaxChain::points);
      add_straight(1);
    }
    const std::size_t total = chains_.back().first_index + chains_.back().points.size();
    pieces_.resize(total);
    travels_.resize(total);
    moved_.resize(total);
    widest_ = 0;
    V2d farthest(0);
    for (std::size_t c = 0; c < chains_.size(); ++c) {
      const RelaxChain& chain = chains_[c];
      for (std::size_t i = 0; i < chain.points.size(); ++i) {
        const V3d along = chain.next_point(i) - chain.points[i];
        const double length = std::sqrt(along.length2());  // length() is a call
        YarnSection section{chain.radius};
        if (chain.is_soft) section.squeeze = chain.squeezes[i];
        if (!chain.is_soft && chain.flattening < 1 && length > 0)
          section.squeeze = squeeze_of(chain.flattening, along / length);
        const double extent = grown_ * (chain.half_widths[i] + options_.gap_radii * chain.radius);
        const std::size_t k = chain.first_index + i;
        Piece& piece = pieces_[k];
        const V3d& old = piece.section.squeeze;
        const double turned2 = std::min((section.squeeze - old).length2(), (section.squeeze + old).length2());
        const double swell = std::abs(extent - piece.extent) + std::sqrt(turned2) * chain.half_widths[i];
        moved_[k] = std::sqrt((chain.points[i] - piece.start).length2());
        travels_[k] += swell;
        farthest = {std::max(farthest.x, moved_[k]), std::max(farthest.y, swell)};
        const std::size_t next = chain.first_index + (i + 1 < chain.points.size() ? i + 1 : 0);
        piece = {chain.points[i],
                 along,
                 section,
                 chain.half_widths[i],
                 extent,
                 0.5 * length,
                 static_cast<std::uint32_t>(c),
                 static_cast<std::uint32_t>(i),
                 static_cast<std::uint32_t>(next)};
        widest_ = std::max(widest_, piece.reach);
      }
    }
    for (std::size_t i = 0; i < total; ++i) travels_[i] += std::max(moved_[i], moved_[pieces_[i].next]);
    approach_ += 2 * (farthest.x + farthest.y);
  }

  double distance_of(const Piece& a, const Piece& b, double reach) const {
    return grown_ * (reach + options_.gap_radii * std::max(a.section.radius, b.section.radius));
  }

  /// Direction in which pieces leave each other. Soft ones that cross stay on their sides.
  V3d direction_of(const V3d& apart, const Piece& a, const Piece& b) const {
    constexpr double min_sine2 = 0.1;
    const double sine2 = a.along.cross(b.along).length2() / (a.along.length2() * b.along.length2());
    if (any_soft_ && sine2 > min_sine2) return apart.normalized();
    return separating_direction(apart, a.section, b.section, options_.is_rough ? 1 : 4);
  }

  /// How two pieces overlap.
  struct Overlap {
    double depth = 0;  ///< mm; negative: at most their distance
    Nearest nearest{};
    V3d direction{0, 0, 0};  ///< unit, from the second to the first; 0 where they are far
    /// How far pieces that are apart travel together before they may overlap, mm.
    double way() const { return direction == V3d(0) ? -depth : -depth / turning; }
  };
  Overlap overlap_of(const Contact& c) const {
    const Piece& a = pieces_[c.a];
    const Piece& b = pieces_[c.b];
    const double min_distance = distance_of(a, b, a.reach + b.reach);
    const double far = min_distance + a.half + b.half;
    const V3d between = a.start - b.start - c.shift;
    const double middle2 = (between + (a.along - b.along) * 0.5).length2();
    if (middle2 > far * far) return {far - std::sqrt(middle2)};
    const Nearest n = nearest_of(between, a.along, b.along);
    const V3d apart = between + a.along * n.s - b.along * n.t;
    const double distance = std::sqrt(apart.length2());
    if (distance >= min_distance || distance == 0) return {min_distance - distance};
    if (a.section.squeeze == V3d(0) && b.section.squeeze == V3d(0))
      return {min_distance - distance, n, apart / distance};
    const V3d d = direction_of(apart, a, b);
    return {distance_of(a, b, support_of(a.section, d) + support_of(b.section, d)) - apart.dot(d), n, d};
  }

  double travelled(const Contact& c) const { return travels_[c.a] + travels_[c.b]; }
  /// Pieces that are apart are not looked at again before they have travelled.
  Overlap overlap_now(Contact& c) const {
    if (travelled(c) < c.free) return {-1};
    Overlap overlap = overlap_of(c);
    if (overlap.depth <= 0) c.free = travelled(c) + overlap.way();
    return overlap;
  }

  /// Sections flatten under pressure, pass it on along the yarn, and recover by this fraction.
  void soften(double recovery) {
    find_touching();
    for (Contact* c : touching_) {
      const Overlap overlap = overlap_now(*c);
      if (overlap.depth <= 0) continue;
      const V3d& d = overlap.direction;
      for (const std::size_t index : {c->a, c->b}) {
        const Piece& piece = pieces_[index];
        if (!chains_[piece.chain].is_soft) continue;
        Imath::M33d& strain = chains_[piece.chain].strains[piece.index];
        const double fraction = soft_pressure * overlap.depth / (grown_ * piece.section.radius);
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) strain[i][j] -= fraction * d[i] * d[j];
      }
    }
    if (!kind_of_.empty()) average_chains_by_kind(&RelaxChain::strains);
    for (RelaxChain& chain : chains_) {
      if (!chain.is_soft) continue;
      diffuse_strains(chain.strains, soft_spread, recovery);
      // The press that finishes cloth makes free yarn as flat as it is to be.
      for (Imath::M33d& strain : chain.strains) strain[2][2] += recovery * chain.log_flattening;
      set_squeezes(chain);
    }
    lay_pieces();
  }

  /// Keeps strains across their piece, without trace, and within bounds.
  static void set_squeezes(RelaxChain& chain) {
    if (!chain.is_soft) return;
    chain.squeezes.resize(chain.points.size());
    for (std::size_t i = 0; i < chain.points.size(); ++i) {
      const V3d along = (chain.next_point(i) - chain.points[i]).normalized();
      const double wide = set_squeeze(chain.strains[i], along, chain.squeezes[i]);
      chain.half_widths[i] = chain.radius * wide;
    }
  }

  /// Whether the pieces are so close along one chain that they do not count as a contact.
  bool follow(const Contact& c) const {
    if (pieces_[c.a].chain != pieces_[c.b].chain) return false;
    const RelaxChain& chain = chains_[pieces_[c.a].chain];
    const auto n = static_cast<double>(chain.points.size());
    double along = static_cast<double>(c.b) - static_cast<double>(c.a);
    const double way2 = chain.period_offset.length2();
    if (way2 == 0) {
      if (c.shift != V3d(0)) return false;
      along = std::abs(along);
      along = std::min(along, n - along);
    } else {
      const double turns = std::round(c.shift.dot(chain.period_offset) / way2);
      if ((c.shift - chain.period_offset * turns).length2() > 1e-12 * way2) return false;
      along = std::abs(along + turns * n);
    }
    return along * chain.spacing < (pi + piece_) * chain.half_width;
  }

  void search() {
    contacts_.clear();
    approach_ = std::numeric_limits<double>::max();
    searched_ = pieces_;
    const double margin = search_margin * widest_;
    double reach = 0;
    for (const Piece& piece : pieces_) reach = std::max(reach, piece.half);
    reach = 2 * reach + grown_ * widest_ * (2 + options_.gap_radii) + margin;
    std::vector<V3d> middles, inside;
    for (const Piece& piece : pieces_) {
      middles.push_back(piece.start + piece.along * 0.5);
      const V3d& m = middles.back();
      inside.emplace_back(wrap_to_repeat(m.x, period_.x), wrap_to_repeat(m.y, period_.y), m.z);
    }
    const PeriodicGrid grid(inside, {period_.x, period_.y}, reach);
    for (std::uint32_t a = 0; a < pieces_.size(); ++a) {
      double far = reach;
      grid.visit_near(inside[a], far, [&](int other, const V3d& offset) {
        const auto b = static_cast<std::uint32_t>(other);
        if (b < a || offset.length2() > reach * reach) return;
        const V3d turned = middles[a] + offset - middles[b];
        const V3d shift(std::round(turned.x / period_.x) * period_.x,
                        std::round(turned.y / period_.y) * period_.y, 0);
        // Each pair once.
        if (b == a && (shift.x < 0 || (shift.x == 0 && shift.y <= 0))) return;
        Contact contact{a, b, shift};
        const Overlap overlap = overlap_of(contact);
        // Sections that lie on each other may turn, and are kept.
        if (overlap.depth < -margin && (options_.is_rough || overlap.direction == V3d(0))) return;
        contact.free = travelled(contact) + overlap.way();
        if (!follow(contact)) contacts_.push_back(contact);
      });
    }
  }

  /// Moves overlapping pieces apart once; returns the largest overlap before, in radii.
  double project() {
    double largest = 0;
    find_touching();
    moves_.assign(pieces_.size(), V3d(0));
    weights_.assign(pieces_.size(), 0.0);
    for (Contact* c : touching_) {
      const Overlap overlap = overlap_now(*c);
      if (overlap.depth <= 0) continue;
      const Piece& a = pieces_[c->a];
      const Piece& b = pieces_[c->b];
      const Nearest& n = overlap.nearest;
      largest = std::max(largest, overlap.depth / (grown_ * std::min(a.section.radius, b.section.radius)));
      const double parts[4] = {1 - n.s, n.s, 1 - n.t, n.t};
      double norm = 0;
      for (const double part : parts) norm += part * part;
      const V3d move = overlap.direction * (overlap.depth / norm);
      const std::size_t indices[4] = {c->a, a.next, c->b, b.next};
      for (std::size_t k = 0; k < 4; ++k) {
        moves_[indices[k]] += move * (k < 2 ? parts[k] : -parts[k]) * parts[k];
        weights_[indices[k]] += parts[k];
      }
    }
    for (RelaxChain& chain : chains_) {
      for (std::size_t i = 0; i < chain.points.size(); ++i) {
        const double weight = weights_[chain.first_index + i];
        if (weight > 0) chain.points[i] += moves_[chain.first_index + i] * (over_relaxation / weight);
      }
    }
    for (RelaxChain& chain : chains_) {
      if (options_.max_thickness_radii == 0) break;
      const double max_z =
          grown_ * std::max(0.0, 0.5 * options_.max_thickness_radii * thickest_ - chain.half_thickness);
      for (V3d& p : chain.points) p.z = std::clamp(p.z, -max_z, max_z);
    }
    lay_pieces();
    return largest;
  }

  RelaxOptions options_;
  double piece_ = rough_piece_radii;  ///< length of pieces, radii
  V3d period_;
  std::vector<RelaxChain> chains_;
  std::vector<std::vector<std::uint32_t>> kinds_;  ///< of many crossings; else empty
  std::vector<std::uint32_t> kind_of_, images_;    ///< of all points; of kinds
  std::vector<Piece> pieces_, searched_;           ///< now, and at the last search
  std::vector<Contact> contacts_;
  std::vector<Contact*> touching_;  ///< or nearly
  std::vector<double> travels_;     ///< of pieces, mm: an upper bound of how far their surfaces have moved
  std::vector<V3d> moves_;
  std::vector<double> moved_;  ///< how far points were when pieces were last laid
  std::vector<double> weights_;
  double thickest_ = 0, widest_ = 0;  ///< the most of half the thickness and of half the width, mm
  double grown_ = 0;
  double approach_ = 0;  ///< distance, mm, by which pieces may have come nearer since touching_ was made
  bool any_soft_ = false;
};

/// Scales yarns that overlap by more than touching_overlap down by enough that they do not. Steep sections of
/// flat yarn turn along a piece of the relaxation, and the yarns of a draft may overlap by much of the
/// thinner.
void thin_to_touch(RelaxResult& relaxed) {
  StitchPattern& pattern = relaxed.pattern;
  double overlap = 0;
  do {
    const auto clearance =
        relaxed.lean_repeats == 1
            ? minimum_clearance(pattern, "")
            : minimum_clearance(close_lean(pattern, relaxed.lean, relaxed.lean_repeats), "");
    if (!clearance) break;  // no valid pattern
    overlap = -*clearance / min_half_thickness(pattern);
    if (overlap <= touching_overlap) break;
    const double factor = std::max(0.5, 1 - 0.5 * overlap);
    for (Yarn& yarn : pattern.yarns) yarn.radius_mm *= factor;
    relaxed.radius_fraction *= factor;
  } while (overlap > 1);
}

}  // namespace

RelaxResult relax(const StitchPattern& pattern, const RelaxOptions& options) {
  if (!options.parts.empty()) {
    RelaxResult rested = rest_knit(pattern, options);
    if (options.may_thin && !options.is_rough && !rested.is_edit) thin_to_touch(rested);
    return rested;
  }
  const double min_part = options.is_rough ? 0.85 : 0.95;
  constexpr int max_tries = 4;
  RelaxResult relaxed{pattern, 1};
  Relaxation relaxation(pattern, options);
  double part = relaxation.run();
  for (int tries = 1; options.may_thin && part < min_part && tries < max_tries; ++tries) {
    const double thinner = 0.95 * part;
    relaxed.radius_fraction *= thinner;
    for (Yarn& yarn : relaxed.pattern.yarns) yarn.radius_mm *= thinner;
    relaxation = Relaxation(relaxed.pattern, options);
    part = relaxation.run();
  }
  relaxed.radius_fraction *= part;
  relaxed.has_settled = part >= min_part;
  relaxation.centre();
  for (std::size_t y = 0; y < relaxed.pattern.yarns.size(); ++y) {
    relaxed.pattern.yarns[y].segments = relaxation.segments_of(y, relaxed.pattern.yarns[y].squeezes);
    relaxed.pattern.yarns[y].radius_mm *= part;
    if (!relaxed.pattern.yarns[y].squeezes.empty()) relaxed.pattern.yarns[y].flattening = 1;
  }
  if (options.may_thin && !options.is_rough) thin_to_touch(relaxed);
  return relaxed;
}

RelaxResult (*default_relaxer)(const StitchPattern& pattern, const RelaxOptions& options) = relax;

}  // namespace selvedge
