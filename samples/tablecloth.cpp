#include "samples/tablecloth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "samples/drape.h"

namespace selvedge::samples {
namespace {

constexpr double full_turn = 2 * std::numbers::pi;
constexpr double edge_rounding = 0.010;  // metres, of the table's top
constexpr double top_thickness = 0.028;
constexpr double cloth_margin = 0.002;

/// A disc of nearly equilateral triangles: ring i has 6 i vertices. Flat, counter-clockwise seen from +y.
struct Disc {
  std::vector<V2d> plane;  ///< x and z
  std::vector<V3i> triangles;
};

Disc make_disc(double radius, int rings) {
  Disc disc;
  disc.plane.emplace_back(0, 0);
  const auto ring_start = [](int ring) { return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1); };
  for (int ring = 1; ring <= rings; ++ring) {
    for (int k = 0; k < 6 * ring; ++k) {
      const double angle = full_turn * k / (6 * ring);
      const double s = radius * ring / rings;
      disc.plane.emplace_back(s * std::cos(angle), s * std::sin(angle));
    }
    for (int sector = 0; sector < 6; ++sector) {
      for (int k = 0; k < ring; ++k) {
        const int outer = ring_start(ring) + sector * ring + k;
        const int outer_next = ring_start(ring) + (sector * ring + k + 1) % (6 * ring);
        const int inside = std::max(1, 6 * (ring - 1));
        const int inner = ring_start(ring - 1) + (sector * (ring - 1) + k) % inside;
        disc.triangles.emplace_back(inner, outer_next, outer);
        if (k + 1 < ring) {
          const int inner_next = ring_start(ring - 1) + (sector * (ring - 1) + k + 1) % inside;
          disc.triangles.emplace_back(inner, inner_next, outer_next);
        }
      }
    }
  }
  return disc;
}

/// One fold of the overhang: a sector of the cloth that hangs in front of the same sector of the table. At
/// every distance from the cloth's middle its outline is r = edge + depth (1 - cos), as deep as it takes to
/// use up the cloth's circumference, which is more than the table's; threads that run outwards keep their
/// length, which gives the height.
class Fold {
 public:
  Fold(double start, double width, double edge, double top, double cloth_radius)
      : start_(start), width_(width), edge_(edge) {
    std::vector<V3d> ring;
    for (int m = 0; m <= columns; ++m) {
      const double angle = start + width * m / columns;
      ring.emplace_back(edge * std::cos(angle), top, edge * std::sin(angle));
    }
    rings_.push_back(ring);
    while (edge + ring_step * static_cast<double>(rings_.size() - 1) < cloth_radius) add_ring();
  }

  bool covers(double angle) const { return angle >= start_ && angle <= start_ + width_; }

  /// `s` in metres from the cloth's middle, at least the table's edge; `angle` on the flat cloth.
  V3d at(double s, double angle) const {
    const double row = (s - edge_) / ring_step;
    const std::size_t i = std::min(static_cast<std::size_t>(row), rings_.size() - 2);
    const double column = std::clamp((angle - start_) / width_, 0.0, 1.0) * columns;
    const std::size_t j = std::min(static_cast<std::size_t>(column), static_cast<std::size_t>(columns - 1));
    const double t = row - static_cast<double>(i);
    const double u = column - static_cast<double>(j);
    return (rings_[i][j] * (1 - u) + rings_[i][j + 1] * u) * (1 - t) +
           (rings_[i + 1][j] * (1 - u) + rings_[i + 1][j + 1] * u) * t;
  }

 private:
  static constexpr int columns = 64;
  static constexpr int outline_steps = 256;
  static constexpr double ring_step = 0.002;

  V3d outline(double depth, double part) const {
    const double angle = start_ + width_ * part;
    const double r = edge_ + depth * (1 - std::cos(full_turn * part));
    return {r * std::cos(angle), 0, r * std::sin(angle)};
  }

  void add_ring() {
    const std::vector<V3d>& last = rings_.back();
    const double s = edge_ + ring_step * static_cast<double>(rings_.size());
    // The way across that a column's width leaves after its rise.
    std::vector<double> across{0};
    for (std::size_t m = 0; m < columns; ++m) {
      const double cloth = s * width_ / columns;
      const double rise = last[m + 1].y - last[m].y;
      across.push_back(across.back() +
                       std::sqrt(std::max(0.04 * cloth * cloth, cloth * cloth - rise * rise)));
    }
    std::vector<double> lengths;
    double low = 0;
    double high = 0.5;
    double depth = 0;
    for (int round = 0; round < 30; ++round) {
      depth = (low + high) / 2;
      lengths.assign(1, 0);
      for (int i = 0; i < outline_steps; ++i) {
        const V3d a = outline(depth, static_cast<double>(i) / outline_steps);
        const V3d b = outline(depth, static_cast<double>(i + 1) / outline_steps);
        lengths.push_back(lengths.back() + (b - a).length());
      }
      (lengths.back() < across.back() ? low : high) = depth;
    }
    std::vector<V3d> ring;
    std::size_t i = 0;
    for (std::size_t m = 0; m <= columns; ++m) {
      const double target = across[m] / across.back() * lengths.back();
      while (i + 2 < lengths.size() && lengths[i + 1] < target) ++i;
      const double t = (target - lengths[i]) / (lengths[i + 1] - lengths[i]);
      V3d p = outline(depth, (static_cast<double>(i) + t) / outline_steps);
      const double out = V2d(p.x - last[m].x, p.z - last[m].z).length();
      p.y = last[m].y - std::sqrt(std::max(0.01 * ring_step * ring_step, ring_step * ring_step - out * out));
      ring.push_back(p);
    }
    rings_.push_back(std::move(ring));
  }

  double start_;
  double width_;
  double edge_;
  std::vector<std::vector<V3d>> rings_;
};

/// Where the cloth is put before it settles.
std::vector<V3d> lay_over(const Disc& disc, const TableclothOptions& o) {
  const double edge = o.table_radius + cloth_margin;
  const double top = o.table_height + cloth_margin;
  std::vector<double> widths;
  double sum = 0;
  for (int i = 0; i < o.folds; ++i) {
    // Folds of unlike widths; the numbers only have to look unlike.
    widths.push_back(1 + 0.22 * std::sin(2.4 * i + 0.6) + 0.10 * std::sin(4.1 * i));
    sum += widths.back();
  }
  std::vector<Fold> folds;
  double start = 0;
  for (const double width : widths) {
    folds.emplace_back(start, full_turn * width / sum, edge, top, o.table_radius + o.overhang);
    start += full_turn * width / sum;
  }
  std::vector<V3d> positions;
  for (const V2d& p : disc.plane) {
    const double s = p.length();
    if (s <= edge) {
      positions.emplace_back(p.x, top, p.y);
      continue;
    }
    const double angle = std::atan2(p.y, p.x) + (p.y < 0 ? full_turn : 0);
    const auto fold =
        std::find_if(folds.begin(), folds.end(), [&](const Fold& f) { return f.covers(angle); });
    positions.push_back((fold == folds.end() ? folds.back() : *fold).at(s, angle));
  }
  return positions;
}

Cloth cloth_of(const Disc& disc, const TableclothOptions& options) {
  constexpr double bending = 1e-5;
  Cloth cloth;
  cloth.positions = lay_over(disc, options);
  for (const V2d& p : disc.plane) cloth.held.push_back(p.length() < 0.8 * options.table_radius);
  const auto length = [&](int a, int b) { return (disc.plane[a] - disc.plane[b]).length(); };
  std::map<std::pair<int, int>, int> opposite;
  for (const V3i& t : disc.triangles) {
    for (int k = 0; k < 3; ++k) {
      const int a = t[k];
      const int b = t[(k + 1) % 3];
      const int c = t[(k + 2) % 3];
      const auto [entry, added] = opposite.try_emplace(std::minmax(a, b), c);
      if (added) {
        cloth.threads.push_back({a, b, length(a, b), 0});
      } else {
        cloth.threads.push_back({entry->second, c, length(entry->second, c), bending});
      }
    }
  }
  return cloth;
}

/// The body that the cloth falls on: the table's top with its rounded edge, and nothing to get under.
double top_distance(const V3d& p, const TableclothOptions& o) {
  const double across = std::hypot(p.x, p.z) - (o.table_radius - edge_rounding);
  const double up = p.y - (o.table_height - edge_rounding);
  return std::hypot(std::max(across, 0.0), std::max(up, 0.0)) + std::min(std::max(across, up), 0.0) -
         edge_rounding;
}

/// Top, leg and foot in one turned piece: (radius, height) from the middle of the top to the middle of the
/// foot.
std::vector<V2d> table_profile(const TableclothOptions& o) {
  std::vector<V2d> profile{{0, o.table_height}, {0.2, o.table_height}};
  const double inner = o.table_radius - edge_rounding;
  constexpr int bends = 6;
  for (int i = 0; i <= bends; ++i) {
    const double angle = std::numbers::pi / 2 * i / bends;
    profile.emplace_back(inner + edge_rounding * std::sin(angle),
                         o.table_height - edge_rounding * (1 - std::cos(angle)));
  }
  for (int i = 0; i <= bends; ++i) {
    const double angle = std::numbers::pi / 2 * i / bends;
    profile.emplace_back(inner + edge_rounding * std::cos(angle),
                         o.table_height - top_thickness + edge_rounding * (1 - std::sin(angle)));
  }
  const double under = o.table_height - top_thickness;
  for (const V2d& p : {V2d(0.12, under), V2d(0.075, under - 0.008), V2d(0.050, under - 0.03),
                       V2d(0.042, under - 0.07), V2d(0.040, 0.45), V2d(0.045, 0.30), V2d(0.050, 0.16),
                       V2d(0.058, 0.09), V2d(0.075, 0.055), V2d(0.12, 0.038), V2d(0.19, 0.028),
                       V2d(0.224, 0.022), V2d(0.230, 0.012), V2d(0.228, 0.003), V2d(0.222, 0.0), V2d(0, 0)}) {
    profile.push_back(p);
  }
  return profile;
}

void add_table(Assembly& assembly, const TableclothOptions& options) {
  constexpr int segments = 96;
  Patch patch;
  patch.material = "wood";
  const std::vector<V2d> profile = table_profile(options);
  double along = 0;
  for (std::size_t i = 0; i < profile.size(); ++i) {
    const bool pole = profile[i].x == 0;
    if (i > 0) along += (profile[i] - profile[i - 1]).length();
    const int first = static_cast<int>(assembly.points.size());
    for (int k = 0; k < (pole ? 1 : segments); ++k) {
      const double angle = full_turn * k / segments;
      assembly.points.emplace_back(profile[i].x * std::sin(angle), profile[i].y,
                                   profile[i].x * std::cos(angle));
    }
    const int here = static_cast<int>(patch.points.size());
    for (int k = 0; k <= segments; ++k) {
      patch.points.push_back(pole ? first : first + k % segments);
      patch.tex_coords.emplace_back(full_turn * options.table_radius * k / segments, along);
    }
    if (i == 0) continue;
    const int above = here - (segments + 1);
    for (int k = 0; k < segments; ++k) {
      if (!pole) patch.triangles.emplace_back(above + k, here + k, here + k + 1);
      if (profile[i - 1].x != 0) patch.triangles.emplace_back(above + k, here + k + 1, above + k + 1);
    }
  }
  assembly.patches.push_back(std::move(patch));
}

}  // namespace

Assembly make_tablecloth(const TableclothOptions& options) {
  const Disc disc = make_disc(options.table_radius + options.overhang, options.rings);
  DrapeOptions drape_options;
  drape_options.steps = options.drape_steps;
  drape_options.margin = cloth_margin;
  drape_options.gravity = 3;
  drape_options.drag = 150;
  const auto table = [&](const V3d& p) { return top_distance(p, options); };

  Assembly assembly;
  Cloth hanging = cloth_of(disc, options);
  hanging.positions = drape(hanging, table, drape_options);
  // The filter takes out the smallest creases, and with them some of the cloth's length, which comes back.
  hanging.positions = smooth(hanging, 4, 0.4);
  drape_options.steps = options.drape_steps / 4;
  assembly.points = drape(hanging, table, drape_options);
  Patch cloth;
  cloth.material = "tablecloth";
  for (std::size_t v = 0; v < disc.plane.size(); ++v) cloth.points.push_back(static_cast<int>(v));
  cloth.tex_coords = disc.plane;
  cloth.triangles = disc.triangles;
  assembly.patches.push_back(std::move(cloth));
  add_table(assembly, options);
  return assembly;
}

}  // namespace selvedge::samples
