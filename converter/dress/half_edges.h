// The edges of a surface of triangles: at most two faces at one, and around a vertex fans of faces with gaps.
#pragma once

#include <array>
#include <vector>

namespace selvedge {

/// An edge is two halves, 2 e and 2 e + 1, each with the face at its left; those without one run along the
/// border.
class HalfEdges {
 public:
  int add_vertex() {
    outgoing_.push_back(none);
    return static_cast<int>(outgoing_.size()) - 1;
  }
  /// Whether a face may be added at a vertex.
  bool is_open(int vertex) const { return outgoing_[vertex] == none || is_border(outgoing_[vertex]); }
  /// Adds a face with corners in this order, counter-clockwise; false, and nothing changes, where a vertex or
  /// an edge has faces all around, or faces at one of its vertices cannot be sorted around that.
  bool add_face(const std::array<int, 3>& corners);

  int edges() const { return static_cast<int>(halves_.size()) / 2; }
  int face(int half) const { return halves_[half].face; }  ///< below 0 at the border
  int begin(int half) const { return halves_[half ^ 1].end; }
  int end(int half) const { return halves_[half].end; }
  /// The halves of a face: to its first corner, from there, and the third.
  std::array<int, 3> halves(int face) const {
    const int first = first_[face];
    return {first, halves_[first].next, halves_[halves_[first].next].next};
  }

 private:
  static constexpr int none = -1;
  struct Half {
    int end;
    int face = none;
    int next = none;
    int previous = none;
  };
  struct Side {
    int half;
    bool is_new;
    bool was_known_border_half = false;  ///< the border's half that its vertex knew is no longer one
  };
  using Links = std::vector<std::array<int, 2>>;

  bool is_border(int half) const { return halves_[half].face == none; }
  int find(int begin, int end) const;
  bool relink_fans(const std::array<Side, 3>& sides, Links& links) const;
  void link_corner(int vertex, Side& side, Side& next, Links& links);
  void know_border(int vertex);

  std::vector<Half> halves_;
  std::vector<int> outgoing_;  ///< by vertex: a half that begins there, of the border if there is one
  std::vector<int> first_;     ///< by face
};

}  // namespace selvedge
