#include "converter/stitch/fibre_layout.h"

#include <doctest/doctest.h>

#include <cmath>

#include "converter/stitch/fibres.h"
#include "converter/stitch/implicit_surface.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "converter/stitch/yarn_plies.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

struct Laid {
  StitchPattern pattern;
  CellMesh mesh;
  Fibres fibres;
};

Laid lay(const char* stitch, const StitchSettings& settings, const FibreLayout& layout) {
  auto pattern = test::need(find_stitch(stitch, of_tubes(settings))).pattern;
  auto mesh = test::need(mesh_stitch(pattern));
  auto fibres = test::need(lay_fibres(pattern, mesh, layout));
  return {std::move(pattern), std::move(mesh), std::move(fibres)};
}

}  // namespace

TEST_CASE("fibres lie within their plies, as many as are asked for, and go on in the next repeat") {
  const Laid wool = lay("plain-knit", {{"yarn", {2}}}, {25});
  const Fibres& f = wool.fibres;
  CHECK(f.period == wool.pattern.period_mm);
  const int laid = f.count() - static_cast<int>(wool.mesh.hairs.roots.size());
  CHECK(laid == 25 * static_cast<int>(f.yarns.size()));
  REQUIRE(f.first.size() == static_cast<std::size_t>(f.count()) + 1);
  const auto surface =
      test::need(ImplicitSurface::build(test::need(lay_plies(wool.pattern, "wool")), 0.7, "wool"));
  double outermost = -1;
  for (int k = 0; k < laid; ++k) {
    const V3d way = V3d(f.points[f.first[k + 1] - 1]) - V3d(f.points[f.first[k]]);
    CHECK(way.x / f.period.x == doctest::Approx(std::round(way.x / f.period.x)).epsilon(1e-4));
    CHECK(way.y / f.period.y == doctest::Approx(std::round(way.y / f.period.y)).epsilon(1e-4));
    CHECK(std::abs(way.z) < 1e-5);
    for (int p = f.first[k]; p < f.first[k + 1]; ++p) {
      outermost = std::max(outermost, surface.distance(V3d(f.points[p])) + static_cast<double>(f.radius[k]));
    }
  }
  // Inside of the plies, which are as thick and thin as they are, but for what bends change.
  CHECK(outermost < 0.02);
  CHECK(outermost > -0.05);
}

TEST_CASE("a ply has as many fibres as fill half of it, unless fewer are asked for: these are thicker") {
  const Laid silk = lay("satin", {{"yarn", {3}}}, {});
  const double radius = silk.fibres.yarns[0].radius_mm;
  // 12 um wide.
  const double expected = 0.5 * radius * radius / (0.006 * 0.006);
  int count = 0;
  double area = 0;
  for (int k = 0; k < silk.fibres.count() && silk.fibres.yarn[k] == 0; ++k) {
    ++count;
    area += std::pow(static_cast<double>(silk.fibres.radius[k]), 2);
  }
  CHECK(count == doctest::Approx(expected).epsilon(1e-3));
  // Thickness varies by a tenth: of 1,000 areas, the mean by 0.7 %.
  CHECK(area == doctest::Approx(0.5 * radius * radius).epsilon(0.03));
  const Laid few = lay("satin", {{"yarn", {3}}}, {40, 0.5});
  CHECK(static_cast<double>(few.fibres.radius[0]) ==
        doctest::Approx(radius * std::sqrt(0.5 / 40)).epsilon(0.2));
}

TEST_CASE("the fibres of a ply lean at its surface as the stitch says") {
  const Laid knit = lay("plain-knit", {{"twist_per_mm", {0.2}}}, {60});
  const Yarn& yarn = knit.fibres.yarns[0];
  // The outermost of a round yarn climb about it by the slope of its twist: longer than the innermost by
  // sqrt(1 + slope^2).
  const auto length_of = [&](int k) {
    double length = 0;
    for (int p = knit.fibres.first[k]; p + 1 < knit.fibres.first[k + 1]; ++p) {
      length += static_cast<double>((knit.fibres.points[p + 1] - knit.fibres.points[p]).length());
    }
    return length;
  };
  const double slope = 2 * std::acos(-1.0) * yarn.radius_mm * 0.2;
  double outer = 0;
  for (int k = 50; k < 60; ++k) outer += length_of(k) / 10;
  // Their place is 0.95 of the room; bends and sway lengthen both.
  CHECK(outer / length_of(0) == doctest::Approx(std::sqrt(1 + slope * slope)).epsilon(0.1));
}

TEST_CASE("too many fibres are refused in one line") {
  const auto found = test::need(find_stitch("plain-knit", {{"yarn", {2}}}));
  const auto mesh = test::need(mesh_stitch(found.pattern));
  const Error error = test::error_of(lay_fibres(found.pattern, mesh, {max_fibres_each_ply + 1}));
  CHECK(error.code == Code::option_out_of_range);
  CHECK(error.place == "--fibres");
}
