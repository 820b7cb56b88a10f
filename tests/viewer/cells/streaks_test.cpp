// Triangles whose texture says nothing: rims without area in texture coordinates, slivers, strays.
#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <string>

#include "tests/viewer/paths.h"

namespace selvedge {
namespace {

constexpr std::uint32_t side = 9;  ///< vertices along a sheet

std::uint32_t corner(std::uint32_t sheet, std::uint32_t x, std::uint32_t y) {
  return side * side * sheet + side * y + x;
}

/// Two sheets of cloth back to back with the same texture coordinates.
ScenePrimitive two_sheets() {
  ScenePrimitive p;
  p.name = "sheets/0";
  for (const std::uint32_t sheet : {0U, 1U}) {
    for (std::uint32_t y = 0; y < side; ++y) {
      for (std::uint32_t x = 0; x < side; ++x) {
        const V2d at(x / (side - 1.0), y / (side - 1.0));
        p.positions.emplace_back(2 * at.x - 1, 1 - 2 * at.y, sheet == 0 ? 0.02 : -0.02);
        p.normals.emplace_back(0.0F, 0.0F, sheet == 0 ? 1.0F : -1.0F);
        p.tex_coords[0].emplace_back(at * 40.0);
        if (x + 1 == side || y + 1 == side) continue;
        const std::uint32_t a = corner(sheet, x, y);
        for (const std::uint32_t c : {1U, 0U, side, 1U, side, side + 1}) p.indices.push_back(a + c);
        if (sheet == 0) continue;
        std::swap(p.indices.end()[-2], p.indices.end()[-3]);
        std::swap(p.indices.end()[-5], p.indices.end()[-6]);
      }
    }
  }
  return p;
}

void add_triangle(ScenePrimitive& p, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  p.indices.insert(p.indices.end(), {a, b, c});
}

void join_rims(ScenePrimitive& p, bool mirrored = false) {
  constexpr std::uint32_t last = side - 1;
  const auto edge = [&](std::uint32_t x, std::uint32_t y, std::uint32_t to_x, std::uint32_t to_y) {
    if (mirrored) {
      std::swap(x, to_x);
      std::swap(y, to_y);
    }
    add_triangle(p, corner(0, x, y), corner(1, x, y), corner(0, to_x, to_y));
    add_triangle(p, corner(0, to_x, to_y), corner(1, x, y), corner(1, to_x, to_y));
  };
  for (std::uint32_t i = 0; i < last; ++i) {
    edge(i + 1, 0, i, 0);
    edge(i, last, i + 1, last);
    edge(0, i, 0, i + 1);
    edge(last, i + 1, last, i);
  }
}

/// Gives the triangles from `first` on vertices of their own, with coordinates as `of_corner` says.
void expand(ScenePrimitive& p, std::size_t first, const std::function<V2d(V2d, std::size_t)>& of_corner) {
  for (std::size_t k = first; k < p.indices.size(); ++k) {
    const std::uint32_t old = std::exchange(p.indices[k], static_cast<std::uint32_t>(p.positions.size()));
    p.positions.push_back(V3f(p.positions[old]));
    p.normals.push_back(V3f(p.normals[old]));
    p.tex_coords[0].push_back(of_corner(p.tex_coords[0][old], k));
  }
}

Frame drawn(const std::vector<std::pair<ScenePrimitive, int>>& parts) {
  test::Setting setting;
  for (const auto& [primitive, fabric] : parts) test::add(setting.scene, primitive, test::material(fabric));
  setting.fabrics = {test::random_fabric(16, 16, 3)};
  for (FabricLevel& level : setting.fabrics[0].levels) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(level.texels()) * setting.fabrics[0].views.count();
         ++i)
      level.opacity()[i] = 1;  // nothing behind it is seen
  }
  setting.options.width = setting.options.height = 64;
  setting.options.lights = default_lights(test::camera_of(setting));
  Frame frame = test::drawn(setting, RenderPath::raster);
  for (const V4f& p : frame.pixels) CHECK(std::isfinite(p.x + p.y + p.z + p.w));
  return frame;
}

TEST_CASE("triangles whose texture says nothing change nothing beside them, whatever they join") {
  const std::size_t first = two_sheets().indices.size();
  const Frame plain = drawn({{two_sheets(), 0}});
  const auto own = [first](double scale, const V2d& offset) {
    return [=](ScenePrimitive& p) {
      join_rims(p);
      expand(p, first, [&](const V2d& uv, std::size_t) { return uv * scale + offset; });
    };
  };
  const auto moved_back = [](double by) {
    return [by](ScenePrimitive& p) {
      for (std::size_t i = p.tex_coords[0].size() / 2; i < p.tex_coords[0].size(); ++i)
        p.tex_coords[0][i] += V2d(by, 0.7 * by);
      join_rims(p);
    };
  };
  struct Case {
    std::string name;
    std::function<void(ScenePrimitive&)> change;
  };
  for (const Case& example : {
           Case{"a rim", [](ScenePrimitive& p) { join_rims(p); }},
           Case{"a rim turned over", [](ScenePrimitive& p) { join_rims(p, true); }},
           Case{"a rim of 1e-12 repeats", moved_back(1e-12)},
           Case{"a rim of 1e-7 repeats", moved_back(1e-7)},
           Case{"a rim of 1e-3 repeats", moved_back(1e-3)},
           Case{"a rim with coordinates of its own", own(1, V2d(0, 0))},
           Case{"a rim elsewhere", own(1, V2d(200.5, -300.25))},
           Case{"a rim in a point", own(0, V2d(0.5, 0.5))},
           Case{"a rim in the origin", own(0, V2d(0, 0))},
           Case{"a rim far away", own(1, V2d(1e9, 1e9))},
           Case{"a rim without end", own(1e300, V2d(0, 0))},
           Case{"a rim as dense as noise", own(1e7, V2d(0, 0))},
           Case{"a rim in u alone",
                [first](ScenePrimitive& p) {
                  join_rims(p);
                  expand(p, first, [](const V2d& uv, std::size_t k) {
                    return V2d(uv.x + static_cast<double>(k % 3), 1e-9 * static_cast<double>(k % 2));
                  });
                }},
           Case{"no vertex is shared",
                [](ScenePrimitive& p) {
                  join_rims(p);
                  expand(p, 0, [](const V2d& uv, std::size_t) { return uv; });
                }},
           Case{"a rim that was there twice",
                [](ScenePrimitive& p) {
                  join_rims(p);
                  join_rims(p, true);
                }},
           Case{"points", [](ScenePrimitive& p) { add_triangle(p, 3, 3, 3); }},
           Case{"lines across the sheets",
                [](ScenePrimitive& p) {
                  add_triangle(p, corner(0, 0, 0), corner(1, 8, 8), corner(0, 0, 0));
                  add_triangle(p, corner(0, 8, 0), corner(1, 0, 8), corner(1, 8, 0));
                }},
           Case{"a triangle without area in space",
                [](ScenePrimitive& p) {
                  p.positions.push_back(V3f(p.positions[corner(0, 4, 4)]));
                  p.normals.emplace_back(0.0F, 0.0F, 1.0F);
                  p.tex_coords[0].emplace_back(1e6, -1e6);
                  add_triangle(p, corner(0, 4, 4), corner(0, 5, 4),
                               static_cast<std::uint32_t>(p.positions.size() - 1));
                }},
       }) {
    INFO(example.name);
    ScenePrimitive changed = two_sheets();
    example.change(changed);
    CHECK(test::decibels(drawn({{changed, 0}}), plain, 1) > 45);
    // Beside a part without fabric, in any order.
    ScenePrimitive button = test::square(1, 0);
    CHECK(test::decibels(drawn({{button, -1}, {changed, 0}}), plain, 1) > 35);
    CHECK(test::decibels(drawn({{changed, 0}, {button, -1}, {changed, 0}}), plain, 1) > 35);
  }
}

TEST_CASE("cloth whose texture coordinates say nothing anywhere shows the mean of its fabric") {
  const auto mean = [](const Frame& frame) {
    double sum = 0;
    for (const V4f& p : frame.pixels) sum += static_cast<double>(p.x + p.y + p.z);
    return sum / static_cast<double>(frame.pixels.size());
  };
  const double expected = mean(drawn({{test::square(4000), 0}}));
  for (const V2d& scale : {V2d(0, 0), V2d(1, 0), V2d(0, -3), V2d(0, 1e300)}) {
    INFO(scale.x, " ", scale.y);
    ScenePrimitive square = test::square(40);
    for (V2d& uv : square.tex_coords[0]) uv *= scale;
    CHECK(mean(drawn({{square, 0}})) == doctest::Approx(expected).epsilon(0.1));
  }
}

}  // namespace
}  // namespace selvedge
