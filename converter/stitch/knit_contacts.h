// Contacts of a knit at rest, which its energy and its Hessian share (knit_cloth.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "converter/stitch/knit_cloth.h"
#include "converter/stitch/relax_chain.h"

namespace selvedge {

/// Stiffnesses of the energy: of stretch and of contact, which grow by stiffness_ at last.
constexpr double stretch_stiffness = 40;
constexpr double contact_stiffness = 4;
/// Height from the middle, in radii, from which on cloth is pressed flat. Without it a 2x2 rib folds to 0.45
/// of plain knit's width; from 0.01 to 0.05 of stiffness ribs and garter stitch change by 0.06.
constexpr double free_height = 3.3;
/// Pairs within this many radii of touching are kept in a list.
constexpr double search_margin = 1.4;
/// Radii that rounding may take of the distance at which pairs need no look.
constexpr double apart_margin = 1e-3;

template <class Visit>
void KnitCloth::visit_contacts(const Visit& visit, double margin) {
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    const V3d d = along(i);
    const Piece piece{d, points_[i] + d * 0.5, reaches_[i] + gap_ * radii_[i]};
    const Piece& last = pieces_[i];
    walked_[i] += std::sqrt((piece.middle - last.middle).length2()) +
                  0.5 * std::sqrt((d - last.along).length2()) + std::max(0.0, piece.reach - last.reach);
    pieces_[i] = piece;
  }
  const V3d up(period_.y * lean_, period_.y, period_.x);
  for (int k = 0; k < 3; ++k) walked_period_ += std::abs(up[k] - last_way_up_[k]);
  last_way_up_ = up;
  for (std::uint32_t a = 0; a < points_.size(); ++a) {
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
        visit(Contact{a, b, s, t, n - (slope - n * slope.dot(n)) / distance, apart, depth - margin});
    }
  }
}

}  // namespace selvedge
