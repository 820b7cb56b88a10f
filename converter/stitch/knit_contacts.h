// Contacts of a knit at rest, which its energy and its Hessian share (knit_cloth.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "converter/stitch/knit_cloth.h"
#include "format/base/parallel.h"

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

/// Pieces that a thread takes at a time, and that all look at before what they found is used.
constexpr std::size_t pieces_a_part = 512;
constexpr std::size_t pieces_a_round = 64 * pieces_a_part;

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
  for (int k = 0; k < 3; ++k) walked_period_ += std::abs(up[k] - last_repeat_way_[k]);
  last_repeat_way_ = up;
  contacts_.resize(pieces_a_round / pieces_a_part);
  // Parts of the cloth at once; their contacts are visited in order, so that sums are the same.
  for (std::size_t first = 0; first < points_.size(); first += pieces_a_round) {
    const std::size_t count = std::min(pieces_a_round, points_.size() - first);
    parallel_chunks(count, pieces_a_part, [&](std::size_t begin, std::size_t end) {
      std::vector<Contact>& found = contacts_[begin / pieces_a_part];
      found.clear();
      for (std::size_t a = begin; a < end; ++a)
        find_contacts(static_cast<std::uint32_t>(first + a), margin, found);
    });
    for (std::size_t part = 0; part * pieces_a_part < count; ++part)
      for (const Contact& contact : contacts_[part]) visit(contact);
  }
}

}  // namespace selvedge
