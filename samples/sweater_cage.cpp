#include "samples/sweater_cage.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selvedge::samples {
namespace {

constexpr double degrees = std::numbers::pi / 180;
constexpr double sleeve_angle = 35 * degrees;

/// Rings of the torso below the arms.
struct TorsoRing {
  double y, half_width, half_depth;
};
constexpr std::array torso_rings{
    TorsoRing{-.035, 0.183, 0.119}, TorsoRing{0.027, 0.188, 0.122}, TorsoRing{0.073, 0.203, 0.133},
    TorsoRing{0.150, 0.204, 0.131}, TorsoRing{0.235, 0.200, 0.125}, TorsoRing{0.315, 0.203, 0.127},
};
constexpr int columns = 9;  // of the front; the back shares the two outermost
constexpr int upper_rows = 4;

/// The right half of front and back above the armpit's height: columns 4 (centre) to 7 (armhole).
constexpr double front_upper[upper_rows][4][3] = {
    {{0, .385, .131}, {.075, .385, .127}, {.140, .385, .106}, {.190, .385, .062}},
    {{0, .437, .126}, {.071, .437, .121}, {.128, .437, .102}, {.170, .437, .070}},
    {{0, .487, .114}, {.068, .490, .107}, {.123, .488, .089}, {.166, .487, .064}},
    {{0, .530, .098}, {.080, .562, .062}, {.127, .549, .060}, {.178, .540, .046}},
};
constexpr double back_upper[upper_rows][4][3] = {
    {{0, .385, -.127}, {.075, .385, -.124}, {.140, .385, -.106}, {.190, .385, -.062}},
    {{0, .445, -.127}, {.073, .445, -.122}, {.134, .440, -.107}, {.176, .437, -.072}},
    {{0, .525, -.114}, {.071, .525, -.107}, {.133, .500, -.094}, {.176, .487, -.066}},
    {{0, .630, -.083}, {.066, .625, -.067}, {.134, .572, -.070}, {.183, .541, -.052}},
};
constexpr V3d armpit{.208, .387, 0};
constexpr V3d shoulder_line[3] = {{.199, .581, -.006}, {.144, .601, -.010}, {.092, .609, -.004}};

/// Rings of a sleeve: distance along it, radius, how far the centre lies above the sleeve's line, and how
/// much farther the underside reaches than the mean (the first rings follow the armhole).
struct SleeveRing {
  double along, radius, lift, tilt;
};
constexpr std::array sleeve_rings{
    SleeveRing{0.070, .060, .006, .052}, SleeveRing{0.135, .0625, .002, .026},
    SleeveRing{0.205, .061, 0, .010},    SleeveRing{0.275, .059, 0, .003},
    SleeveRing{0.345, .0565, 0, 0},      SleeveRing{0.415, .053, 0, 0},
    SleeveRing{0.470, .042, 0, 0},       SleeveRing{0.535, .039, 0, 0},
};

class CageBuilder {
 public:
  QuadSurface build() {
    add_torso();
    add_upper();
    add_shoulders();
    add_sleeve(+1);
    add_sleeve(-1);
    add_collar();
    return std::move(cage_);
  }

 private:
  int add_vertex(const V3d& p) {
    cage_.positions.push_back(p);
    return static_cast<int>(cage_.positions.size()) - 1;
  }
  void add_quad(int label, Quad quad, bool mirrored = false) {
    if (mirrored) std::swap(quad[1], quad[3]);
    cage_.quads.push_back(quad);
    cage_.labels.push_back(label);
  }

  /// Sixteen columns: the front from -x to +x, then the back from +x to -x.
  void add_torso() {
    std::vector<std::array<int, 16>> rings;
    // A polygon's limit curve lies inside of it.
    const double outwards = 1 / (1 - (1 - std::cos(22.5 * degrees)) / 3);
    for (const TorsoRing& ring : torso_rings) {
      std::array<int, 16> indices{};
      for (int k = 0; k < 16; ++k) {
        const double angle = (k - 4) * 22.5 * degrees;
        indices[k] = add_vertex(V3d(outwards * ring.half_width * std::sin(angle), ring.y,
                                    outwards * ring.half_depth * std::cos(angle)));
      }
      rings.push_back(indices);
    }
    for (int row = 0; row < upper_rows; ++row) {
      for (int c = 1; c < columns - 1; ++c) {
        front_[row][c] = add_vertex(upper_point(front_upper, row, c));
        back_[row][c] = add_vertex(upper_point(back_upper, row, c));
      }
    }
    for (int side : {-1, 1}) {
      const int index = add_vertex(V3d(side * armpit.x, armpit.y, armpit.z));
      front_[0][side < 0 ? 0 : 8] = back_[0][side < 0 ? 0 : 8] = index;
    }
    std::array<int, 16> top{};
    for (int k = 0; k < 16; ++k) top[k] = k <= 8 ? front_[0][k] : back_[0][16 - k];
    rings.push_back(top);

    for (std::size_t row = 0; row + 1 < rings.size(); ++row) {
      for (std::size_t k = 0; k < 16; ++k) {
        const std::size_t next = (k + 1) % 16;
        const int label = row == 0 ? panel_hem : (k < 8 ? panel_front : panel_back);
        add_quad(label, {rings[row][k], rings[row][next], rings[row + 1][next], rings[row + 1][k]});
      }
    }
  }

  static V3d upper_point(const double (&table)[upper_rows][4][3], int row, int column) {
    const double* p = table[row][std::abs(column - 4)];
    return {column < 4 ? -p[0] : p[0], p[1], p[2]};
  }

  void add_upper() {
    for (int row = 0; row + 1 < upper_rows; ++row) {
      for (int c = 1; c + 1 < columns - 1; ++c) {
        add_quad(panel_front,
                 {front_[row][c], front_[row][c + 1], front_[row + 1][c + 1], front_[row + 1][c]});
        add_quad(panel_back, {back_[row][c + 1], back_[row][c], back_[row + 1][c], back_[row + 1][c + 1]});
      }
    }
  }

  void add_shoulders() {
    const int top = upper_rows - 1;
    for (int side : {-1, 1}) {
      std::array<int, 3>& line = shoulders_[side < 0 ? 0 : 1];
      for (std::size_t k = 0; k < 3; ++k) {
        line[k] = add_vertex(V3d(side * shoulder_line[k].x, shoulder_line[k].y, shoulder_line[k].z));
      }
      for (std::size_t k = 0; k < 2; ++k) {
        const int outer = 4 + side * (3 - static_cast<int>(k));
        const int inner = outer - side;
        add_quad(panel_front, {front_[top][inner], front_[top][outer], line[k], line[k + 1]}, side < 0);
        add_quad(panel_back, {back_[top][outer], back_[top][inner], line[k + 1], line[k]}, side < 0);
      }
    }
  }

  void add_sleeve(int side) {
    const int column = side < 0 ? 1 : 7;
    std::array<int, 10> ring{};
    ring[0] = front_[0][side < 0 ? 0 : 8];
    for (int row = 0; row < upper_rows; ++row) {
      ring[1 + row] = front_[row][column];
      ring[9 - row] = back_[row][column];
    }
    ring[5] = shoulders_[side < 0 ? 0 : 1][0];

    const double outwards = 1 / (1 - (1 - std::cos(36 * degrees)) / 3);
    for (std::size_t j = 0; j < sleeve_rings.size(); ++j) {
      const SleeveRing& shape = sleeve_rings[j];
      std::array<int, 10> next{};
      for (std::size_t k = 0; k < 10; ++k) {
        const double angle = static_cast<double>(k) * 36 * degrees;
        const double radius = outwards * shape.radius;
        const V3d centre = sleeve_centre(shape.along + shape.tilt * std::cos(angle), side);
        // Across the bent sleeve, not across its straight line.
        const V3d onwards =
            (sleeve_centre(shape.along + 0.01, side) - sleeve_centre(shape.along, side)).normalized();
        const V3d to_front = onwards.cross(sleeve_up(side)) * side;
        next[k] = add_vertex(centre + sleeve_up(side) * (shape.lift - radius * std::cos(angle)) +
                             to_front * (1.04 * radius * std::sin(angle)));
      }
      for (std::size_t k = 0; k < 10; ++k) {
        const bool front = k < 5;
        int label = side > 0 ? (front ? panel_sleeve_right_front : panel_sleeve_right_back)
                             : (front ? panel_sleeve_left_front : panel_sleeve_left_back);
        if (j + 1 == sleeve_rings.size()) label = side > 0 ? panel_cuff_right : panel_cuff_left;
        const std::size_t after = (k + 1) % 10;
        add_quad(label, {ring[k], next[k], next[after], ring[after]}, side < 0);
      }
      ring = next;
    }
  }

  void add_collar() {
    const int top = upper_rows - 1;
    const std::array<int, 8> base{shoulders_[0][2], front_[top][3], front_[top][4], front_[top][5],
                                  shoulders_[1][2], back_[top][5],  back_[top][4],  back_[top][3]};
    std::array<int, 8> edge{};
    for (std::size_t k = 0; k < 8; ++k) {
      const V3d p = cage_.positions[base[k]];
      edge[k] = add_vertex(p + V3d(-0.13 * p.x, p.z > 0 ? 0.021 : 0.019, p.z > 0 ? -0.005 : 0.002));
    }
    for (std::size_t k = 0; k < 8; ++k) {
      const std::size_t next = (k + 1) % 8;
      add_quad(panel_collar, {base[k], base[next], edge[next], edge[k]});
    }
  }

  QuadSurface cage_;
  int front_[upper_rows][columns] = {};
  int back_[upper_rows][columns] = {};
  std::array<std::array<int, 3>, 2> shoulders_{};
};

double ellipsoid_distance(const V3d& p, const V3d& radii) {
  const double k0 = (p / radii).length();
  const double k1 = (p / (radii * radii)).length();
  return k1 > 0 ? k0 * (k0 - 1) / k1 : -std::min({radii.x, radii.y, radii.z});
}

/// A cone with round ends.
double limb_distance(const V3d& p, const V3d& a, const V3d& b, double radius_a, double radius_b) {
  const V3d axis = b - a;
  const double t = std::clamp((p - a).dot(axis) / axis.dot(axis), 0.0, 1.0);
  return (p - a - axis * t).length() - (radius_a + t * (radius_b - radius_a));
}

double blend(double a, double b, double width) {
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - h * h * width / 4;
}

}  // namespace

V3d sleeve_direction(int side) { return {side * std::sin(sleeve_angle), -std::cos(sleeve_angle), 0}; }

V3d sleeve_up(int side) { return {side * std::cos(sleeve_angle), std::sin(sleeve_angle), 0}; }

V3d sleeve_centre(double along, int side) {
  const double bent = std::max(0.0, along - 0.22);
  return V3d(side * 0.185, 0.485, 0) + sleeve_direction(side) * along + V3d(0, 0, 0.45 * bent * bent);
}

QuadSurface sweater_cage() { return CageBuilder().build(); }

double body_distance(const V3d& p) {
  struct Slice {
    double y, half_width, half_depth;
  };
  constexpr std::array slices{
      Slice{-0.30, .172, .108}, Slice{-0.10, .172, .108}, Slice{0.065, .172, .108}, Slice{0.16, .167, .102},
      Slice{0.25, .166, .102},  Slice{0.33, .172, .106},  Slice{0.41, .178, .108},  Slice{0.47, .177, .098},
      Slice{0.52, .172, .080},  Slice{0.555, .163, .063}, Slice{0.578, .136, .054}, Slice{0.592, .104, .050},
      Slice{0.605, .078, .048}, Slice{0.64, .060, .050},  Slice{0.80, .055, .050},  Slice{0.90, .055, .050},
  };
  std::size_t i = 1;
  while (i + 3 < slices.size() && p.y > slices[i + 1].y) ++i;
  const double y = std::clamp(p.y, slices[i].y, slices[i + 1].y);
  // A smooth curve through the slices (cubic Hermite with Catmull-Rom's slopes): a step in the body shows.
  const auto across = [&](double Slice::*size) {
    const auto slope_at = [&](std::size_t k) {
      return (slices[k + 1].*size - slices[k - 1].*size) / (slices[k + 1].y - slices[k - 1].y);
    };
    const double span = slices[i + 1].y - slices[i].y;
    const double t = (y - slices[i].y) / span;
    const double u = 1 - t;
    return slices[i].*size * (1 + 2 * t) * u * u + slope_at(i) * span * t * u * u +
           slices[i + 1].*size * (1 + 2 * u) * t * t - slope_at(i + 1) * span * u * t * t;
  };
  const double width = across(&Slice::half_width);
  const double depth = across(&Slice::half_depth);
  const double slope = (slices[i].half_width - slices[i + 1].half_width) / (slices[i + 1].y - slices[i].y);
  double distance = ellipsoid_distance(V3d(p.x, 0, p.z), V3d(width, 1, depth)) / std::sqrt(1 + slope * slope);

  const int side = p.x < 0 ? -1 : 1;
  const V3d joint = sleeve_centre(-0.040, side);
  const V3d elbow = sleeve_centre(0.27, side);
  const V3d wrist = sleeve_centre(0.60, side);
  const double arm =
      std::min(limb_distance(p, joint, elbow, 0.053, 0.042), limb_distance(p, elbow, wrist, 0.042, 0.026));
  return blend(distance, arm, 0.03);
}

}  // namespace selvedge::samples
