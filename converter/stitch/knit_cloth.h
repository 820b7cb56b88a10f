// A knit as yarns that keep their lengths, bend and touch, in a repeat whose size may be free.
//
// At rest its energy is least. In units of bending stiffness by radius r of the thickest yarn, for pieces of
// length l,
//
//   sum over points of r / (2 l^3) (sqrt(|b|^2 + (k l^2)^2) - k l^2)^2
//                                                           bending: b the second difference, k the curvature
//                                                           that is set; of any way, and convex
//   + sum over pieces of s l / (2 r) (|d| / l - 1)^2        stretch of a piece d
//   + sum over pairs of pieces of c / 2 (overlap / r)^2     contact
//   + sum over pieces of p l / (2 r) max(0, |z| / r - h)^2  cloth dries lying flat
//
// of the points, of the logarithms of the repeat's width and height, and of its shear. It is found by L-BFGS
// (Nocedal and Wright, "Numerical Optimization", 7.2), which begins with the inverse of the Gauss-Newton
// Hessian: without it a wale that turns, or a repeat that draws in, takes thousands of steps. Anchors: Kaldor
// et al. 2008, "Simulating Knitted Cloth at the Yarn Level"; Leaf et al. 2018, "Interactive Design of
// Periodic Yarn-Level Cloth Patterns".
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "converter/stitch/knit.h"
#include "converter/stitch/knit_factor.h"

namespace selvedge {

/// State that a cloth is brought to in stages, and rests in.
struct ClothGoal {
  bool grows = false;       ///< from the drawing: yarn grows to its thickness, loops to their lengths
  bool presses = false;     ///< soft yarn takes its full section, flat where it is pressed
  bool is_free = false;     ///< whether the size of the repeat is free at last
  V2d period_mm{0, 0};      ///< size of the repeat at the end of the stages; 0: as it is
  double lean = 0;          ///< of it, then (KnitCloth::lean())
  double float_factor = 1;  ///< on the lengths of floats
  int max_steps = 300;      ///< after the stages
};

struct RestedKnit;

class KnitCloth {
 public:
  /// `curvature`: at rest, of a loop, 1/mm, at equal distances from foot to foot; empty: straight.
  KnitCloth(const DrawnKnit& knit, double gap_radii, const std::vector<double>& curvature);

  /// Lets stitches that are drawn alike, with all around them, rest alike: knits cut into tiles do without.
  void find_kinds();
  void rest(const ClothGoal& goal);
  /// Takes the rest of a knit that differs in some stitches, before rest(): only these and the ones around
  /// them move then. False: too much differs, and this is no cloth any more.
  bool edit(const DrawnKnit& knit, const RestedKnit& last, const V2d& gauge);
  /// Called in every step.
  void on_step(std::function<void()> told) { on_step_ = std::move(told); }

  V2d period() const { return period_; }
  /// mm to the right a mm upwards, by which the repeat stands on the one below it.
  double lean() const { return lean_; }
  /// Goes on from a rest whose repeat is free to one whose lean is, too, in so many steps. What is symmetric,
  /// or would lean by less than a degree, stays straight.
  void find_lean(int max_steps);
  /// Mean curvature of its loops, as it is given.
  std::vector<double> curvature() const;
  /// Steps taken.
  int steps() const { return steps_; }
  /// Fraction of the energy that the last steps_between_factors steps have freed.
  double residual() const { return residual_; }
  /// Fraction by which the yarn that is stretched most is longer than its parts.
  double stretch() const;
  /// Fraction of the radius of yarn that there is room for.
  double radius_fraction() const { return thin_; }
  /// Gives yarns their segments, squeezes and period; radii stay.
  void give(DrawnKnit& knit) const;

 private:
  struct Part {
    std::uint32_t begin, end;  ///< points
    bool is_loop;
    double drawn, length;  ///< mm
    double slid = 0;       ///< mm of yarn that it has taken from the next part, at the cost of friction
  };
  struct Chain {
    std::uint32_t begin = 0, end = 0;
    V2d turns{0, 0};
    double radius = 0;
    bool soft = false;
    double flattening = 1;
    int row = -1;  ///< from below
    std::vector<Part> parts;
  };
  /// From a point to the next.
  struct Piece {
    V3d along, middle;
    double reach;  ///< from its middle
  };
  /// A piece that another one may touch, moved by whole periods.
  struct Neighbour {
    std::uint32_t piece;
    std::int8_t x, y;
    float apart_until = 0;  ///< mm that both have walked, until which they cannot touch
  };
  struct Contact {
    std::uint32_t a, b;
    double s, t;   ///< fractions of both pieces
    V3d slope;     ///< what the distance grows by when a moves
    V3d apart;     ///< from b to a
    double depth;  ///< of the overlap, mm
  };
  /// One vector for each point, and the logarithms of the period and its shear.
  template <class Real>
  struct VectorOf {
    std::vector<Imath::Vec3<Real>> points;
    V3d period{0, 0, 0};
    template <class Other>
    double dot(const VectorOf<Other>& other) const {
      double sum = period.dot(other.period);
      for (std::size_t i = 0; i < points.size(); ++i) sum += V3d(points[i]).dot(V3d(other.points[i]));
      return sum;
    }
    template <class Other>
    void add(double factor, const VectorOf<Other>& other) {
      for (std::size_t i = 0; i < points.size(); ++i) points[i] += V3d(other.points[i]) * factor;
      period += other.period * factor;
    }
  };
  using Vector = VectorOf<double>;
  using RoughVector = VectorOf<float>;
  /// A square in the Hessian: weight (sum of part n x of points + rate times the period's logarithms and
  /// shear)^2. All three axes, the rates along their own and the shear's along x, where n is 0.
  struct Square {
    std::uint32_t points[3];
    double parts[3];
    int count;
    V3d n;
    V3d rate;
    double weight;
  };
  /// The Hessian's rows of the period.
  struct Border {
    RoughVector sides[3];   ///< of all points with it
    double corner[6] = {};  ///< xx, xy, yy, and with the shear: x, y, itself
    void add_corner(const Square& square) {
      const bool has_axes = square.n == V3d(0);
      const V3d& rate = square.rate;
      corner[0] += square.weight * rate.x * rate.x;
      if (!has_axes) corner[1] += square.weight * rate.x * rate.y;
      corner[2] += square.weight * rate.y * rate.y;
      corner[3] += square.weight * rate.x * rate.z;
      if (!has_axes) corner[4] += square.weight * rate.y * rate.z;
      corner[5] += square.weight * rate.z * rate.z;
    }
  };

  // knit_edit.cpp: what stays.
  struct Kept;
  bool adopt_rest(const DrawnKnit& knit, const RestedKnit& last, Kept& kept);
  void hold(const DrawnKnit& knit, const std::vector<V3d>& rest, const std::vector<char>& known);
  bool is_still(std::uint32_t i) const { return !active_.empty() && active_[i] == 0; }

  // knit_kinds.cpp: what rests alike.
  struct PartShape;
  std::vector<std::vector<std::array<int, 2>>> part_shapes() const;
  void find_mirror();

  // knit_cloth.cpp: what rests.
  void set_tiles();
  void set_lengths();
  void slide();
  void set_radii();
  void fit_sections();
  double energy(Vector& gradient);
  /// Visits pairs that are less than `margin`, mm, from touching.
  template <class Visit>
  void visit_contacts(const Visit& visit, double margin = 0);
  void find_contacts(std::uint32_t a, double margin, std::vector<Contact>& found);
  void search();
  bool follow(std::uint32_t a, std::uint32_t b, double x, double y) const;
  double support(std::uint32_t piece, const V3d& direction, V3d& slope) const;
  V3d way(double x, double y) const { return {x * period_.x + y * period_.y * lean_, y * period_.y, 0}; }
  V3d way(const Chain& chain) const { return way(chain.turns.x, chain.turns.y); }
  V3d after(const Chain& chain, std::uint32_t i) const {
    return i < chain.end ? points_[i] : points_[i - (chain.end - chain.begin)] + way(chain);
  }
  V3d before(const Chain& chain, std::uint32_t i) const {
    return i > chain.begin ? points_[i - 1] : points_[chain.end - 1] - way(chain);
  }
  /// From point i to the next.
  V3d along(std::uint32_t i) const {
    const V3d d = points_[next_[i]] - points_[i];
    return next_[i] > i ? d : d + way(chains_[chain_of_[i]]);
  }

  // knit_descent.cpp: how it comes to rest.
  void converge(int max_steps, int pressing_steps = 0);
  bool step(double& energy);
  Vector descent() const;
  void move(const Vector& direction, double step);
  void move_to(const V2d& period, double lean = 0);
  template <class Visit>
  void visit_squares(const Chain& chain, std::uint32_t point, const Visit& visit) const;
  void add(const Square& square, std::uint32_t tile, BlockMatrix& matrix, Border& border) const;
  void factor();
  void solve(Vector& v) const;
  template <class Real>
  void solve_upright(VectorOf<Real>& v) const;
  template <class Real>
  void solve_points(VectorOf<Real>& v) const;

  double gap_;
  V2d period_;
  double lean_ = 0;
  V2d min_period_;  ///< of jammed cloth, which would shrink to nothing
  std::vector<Chain> chains_;
  std::vector<V3d> points_;
  std::vector<V3f> searched_;                 ///< points at the last search
  std::vector<double> lengths_, curvatures_;  ///< at rest, of the piece behind each point; in the point
  std::vector<double> radii_, reaches_;       ///< of pieces: of a round section; half the width
  std::vector<V3d> squeezes_;
  std::vector<Imath::M33d> strains_;  ///< logarithms of stretches across soft yarn, without trace
  std::vector<std::uint32_t> next_, chain_of_;
  std::vector<char> active_;                    ///< points that move; empty: all do
  std::vector<Piece> pieces_;                   ///< of visit_contacts()
  std::vector<double> walked_;                  ///< mm, of pieces, and by which they have grown
  double walked_period_ = 0;                    ///< mm, by which repeats have come nearer or farther
  V3d last_repeat_way_{0, 0, 0};                ///< of visit_contacts(): of a repeat; z: its width
  std::vector<std::vector<Contact>> contacts_;  ///< of parts of a round of visit_contacts()
  std::vector<Neighbour> neighbours_;           ///< of pieces, after them
  std::vector<std::uint32_t> first_neighbour_;  ///< of each piece, and the end
  double unit_ = 0;                             ///< radius of the thickest yarn, mm
  double grown_ = 1, swollen_ = 0, thin_ = 1;   ///< fractions of the radius; 0: a round core, 1: its section
  double lengthened_ = 1;                       ///< part of the way from drawn to their own lengths
  double float_factor_ = 1;
  double height_ = 0;              ///< from the middle, mm, from which on it is pressed
  double flat_stiffness_ = 0.035;  ///< of that; more in the press
  double stiffness_ = 1;           ///< factor on the stiffness of pieces and contacts
  double overlap_ = 0;             ///< largest, in radii of the thinner yarn

  std::vector<std::uint32_t> kind_of_;  ///< of points, which move as the others of their kind
  std::vector<std::uint32_t> images_;   ///< of kinds in the mirror, left for right; empty: there are no kinds
  bool has_kinds_ = false;              ///< by find_kinds(): else every point is its own, and has an image
  Vector gradient_;
  std::vector<std::pair<RoughVector, RoughVector>>
      history_;  ///< moves and changes of the gradient, the oldest first
  std::vector<std::vector<std::uint32_t>>
      tiles_;  ///< points of the parts of the cloth factored by themselves
  std::vector<std::uint32_t> tile_of_, place_of_;  ///< of points: in their tile
  std::vector<BlockCholesky> factors_;             ///< of tiles
  std::array<RoughVector, 3> borders_;             ///< what points do for the period, by the inverse
  std::array<double, 3> period_inverse_{1, 0, 1};  ///< of its Schur complement: xx, xy, yy
  double shear_pivot_ = 1;                         ///< what is left of the shear
  bool is_free_ = false, leans_ = false;
  int steps_ = 0;
  std::function<void()> on_step_;
  double residual_ = 1;
};

}  // namespace selvedge
