#include "converter/dress/half_edges.h"

namespace selvedge {

/// The half from one vertex to another, looked for clockwise; `none` without one.
int HalfEdges::find(int begin, int end) const {
  const int first = outgoing_[begin];
  for (int half = first; half != none;) {
    if (halves_[half].end == end) return half;
    half = halves_[half ^ 1].next;
    if (half == first) break;
  }
  return none;
}

/// Moves fans between two old sides that meet at a corner into another gap; false without one.
bool HalfEdges::relink_fans(const std::array<Side, 3>& sides, Links& links) const {
  for (std::size_t i = 0; i < 3; ++i) {
    const Side& side = sides[i];
    const Side& next = sides[(i + 1) % 3];
    if (side.is_new || next.is_new || halves_[side.half].next == next.half) continue;
    int before = next.half ^ 1;
    do before = halves_[before].next ^ 1;
    while (!is_border(before));
    if (before == side.half) return false;
    links.push_back({before, halves_[side.half].next});
    links.push_back({halves_[next.half].previous, halves_[before].next});
    links.push_back({side.half, next.half});
  }
  return true;
}

/// Links two sides at the vertex between them, of which one is new, and their other halves along the border.
void HalfEdges::link_corner(int vertex, Side& side, Side& next, Links& links) {
  if (!side.is_new && !next.is_new) {
    next.was_known_border_half = outgoing_[vertex] == next.half;
    return;
  }
  const int arriving = next.half ^ 1;
  const int leaving = side.half ^ 1;
  int& known = outgoing_[vertex];
  if (!next.is_new) {
    links.push_back({halves_[next.half].previous, leaving});
    known = leaving;
  } else if (!side.is_new) {
    links.push_back({arriving, halves_[side.half].next});
    known = halves_[side.half].next;
  } else if (known == none) {
    known = leaving;
    links.push_back({arriving, leaving});
  } else {
    links.push_back({halves_[known].previous, leaving});
    links.push_back({arriving, known});
  }
  links.push_back({side.half, next.half});
}

void HalfEdges::know_border(int vertex) {
  int half = outgoing_[vertex];
  do {
    if (is_border(half)) {
      outgoing_[vertex] = half;
      return;
    }
    half = halves_[half ^ 1].next;
  } while (half != outgoing_[vertex]);
}

bool HalfEdges::add_face(const std::array<int, 3>& corners) {
  std::array<Side, 3> sides{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!is_open(corners[i])) return false;
    const int half = find(corners[i], corners[(i + 1) % 3]);
    if (half != none && !is_border(half)) return false;
    sides[i] = {half, half == none};
  }
  Links links;
  if (!relink_fans(sides, links)) return false;
  const int face = static_cast<int>(first_.size());
  for (std::size_t i = 0; i < 3; ++i) {
    if (!sides[i].is_new) continue;
    sides[i].half = static_cast<int>(halves_.size());
    halves_.push_back({corners[(i + 1) % 3]});
    halves_.push_back({corners[i]});
  }
  first_.push_back(sides[2].half);
  for (std::size_t i = 0; i < 3; ++i) {
    link_corner(corners[(i + 1) % 3], sides[i], sides[(i + 1) % 3], links);
    halves_[sides[i].half].face = face;
  }
  for (const auto& [half, next] : links) {
    halves_[half].next = next;
    halves_[next].previous = half;
  }
  for (std::size_t i = 0; i < 3; ++i)
    if (sides[i].was_known_border_half) know_border(corners[i]);
  return true;
}

}  // namespace selvedge
