#include "apps/report/drawing.h"

#include <doctest/doctest.h>
#include <OpenImageIO/detail/pugixml/pugixml.hpp>

#include <algorithm>
#include <cmath>

#include "apps/report/colour_map.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

constexpr Rgb black{0, 0, 0};

Drawing on_white(int width, int height, std::vector<Drawn> shapes) {
  Drawing drawing;
  drawing.width = width;
  drawing.height = height;
  drawing.title = "a drawing";
  drawing.shapes = std::move(shapes);
  return drawing;
}

Image drawn(const Drawing& drawing) {
  const auto png = test::need(png_of(drawing));
  return test::need(decode_image(png, "drawing", Transfer::keep));
}

float red_at(const Image& image, int x, int y) {
  return image.pixels[4 * static_cast<std::size_t>(y * image.width + x)];
}

double ink_of(const Image& image) {
  double ink = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) ink += 1 - static_cast<double>(image.pixels[i]);
  return ink;
}

}  // namespace

TEST_CASE("drawing: a box covers its pixels, and those at its edge by their share") {
  const Image image = drawn(on_white(8, 6, {DrawnBox{{2, 1}, {3.5, 2}, black}}));
  CHECK(image.width == 8);
  CHECK(image.height == 6);
  CHECK(red_at(image, 1, 1) == 1);
  CHECK(red_at(image, 2, 1) == 0);
  CHECK(red_at(image, 4, 2) == 0);
  CHECK(red_at(image, 5, 2) == doctest::Approx(0.5).epsilon(0.005));  // 8 bits
  CHECK(red_at(image, 6, 2) == 1);
  CHECK(red_at(image, 3, 3) == 1);
}

TEST_CASE("drawing: discs and lines have the area that they should") {
  // Coverage by distance is right to a few per cent for shapes of several pixels.
  const double disc = ink_of(drawn(on_white(40, 40, {DrawnDisc{{20.3, 19.6}, 12, black}})));
  CHECK(disc == doctest::Approx(3.14159 * 144).epsilon(0.01));
  const DrawnLine line{{{8, 9}, {50, 40}, {90, 12}}, 3, black};
  const double length = std::hypot(42, 31) + std::hypot(40, 28);
  CHECK(ink_of(drawn(on_white(100, 60, {line}))) == doctest::Approx(3 * length).epsilon(0.04));
}

TEST_CASE("drawing: a picture's pixels are those of the drawing, encoded for the screen") {
  const Image two{2, 1, 3, {0, 0, 0, srgb_to_linear(0.6F), 0, 0}};
  const Image image = drawn(on_white(10, 6, {DrawnPicture{{1, 2}, two, "two"}}));
  CHECK(red_at(image, 1, 2) == 0);
  CHECK(red_at(image, 2, 2) == doctest::Approx(0.6).epsilon(0.004));
  CHECK(ink_of(image) == doctest::Approx(1.4).epsilon(0.004));
}

TEST_CASE("drawing: texts stand where their anchor says, degrees included") {
  using Anchor = DrawnText::Anchor;
  const auto columns = [&](Anchor anchor, const std::string& text) {
    const Image image = drawn(on_white(200, 40, {DrawnText{{100, 25}, text, 14, black, anchor, false}}));
    int first = 200;
    int last = -1;
    for (int x = 0; x < 200; ++x) {
      for (int y = 0; y < 40; ++y) {
        if (red_at(image, x, y) > 0.7F) continue;
        first = std::min(first, x);
        last = std::max(last, x);
      }
    }
    return V2i(first, last);
  };
  for (const std::string text : {"HIJKLH", "H30°H"}) {
    const V2i start = columns(Anchor::start, text);
    const V2i middle = columns(Anchor::middle, text);
    const V2i end = columns(Anchor::end, text);
    CHECK(std::abs(start.x - 101) <= 2);
    CHECK(std::abs(middle.x + middle.y - 200) <= 4);
    CHECK(std::abs(end.y - 98) <= 2);
    CHECK(start.y - start.x > 30);
  }
  // A degree is a ring, not a letter: wider than nothing, and with ink.
  CHECK(columns(Anchor::start, "30°").y > columns(Anchor::start, "30").y + 2);
}

TEST_CASE("drawing: the SVG is XML that has every shape, and texts as they are") {
  const Image one{1, 1, 3, {1, 0, 0}};
  const Drawing drawing =
      on_white(30, 20,
               {DrawnText{{1, 2}, "a < b & \"c\" > 8°\x1b", 13, black, DrawnText::Anchor::end, true},
                DrawnLine{{{1, 2}, {3, 4.125}}, 1.5, {1, 2, 255}}, DrawnDisc{{4, 5}, 6, black},
                DrawnPicture{{7, 8}, one, "one <pixel>"}});
  const auto svg = test::need(svg_of(drawing));
  OIIO::pugi::xml_document document;
  REQUIRE(document.load_string(svg.c_str()));
  const auto root = document.child("svg");
  CHECK(std::string(root.attribute("viewBox").value()) == "0 0 30 20");
  CHECK(std::string(root.child_value("title")) == "a drawing");
  CHECK(std::string(root.child_value("text")) == "a < b & \"c\" > 8°\\x1B");
  CHECK(std::string(root.child("text").attribute("text-anchor").value()) == "end");
  CHECK(std::string(root.child("polyline").attribute("points").value()) == "1,2 3,4.13");
  CHECK(std::string(root.child("polyline").attribute("stroke").value()) == "#0102ff");
  CHECK(std::string(root.child("circle").attribute("r").value()) == "6");
  const auto picture = root.child("image");
  CHECK(std::string(picture.child_value("title")) == "one <pixel>");
  CHECK(std::string(picture.attribute("href").value()).starts_with("data:image/png;base64,iVBORw0KGgo"));
  CHECK(svg == *svg_of(drawing));
}

TEST_CASE("drawing: colours of differences are as light on both sides, and lightness falls evenly") {
  // Oklab's lightness by the matrices of its publication.
  const auto lightness = [](const V3f& c) {
    const V3d d(c);
    const double l = 0.4122214708 * d.x + 0.5363325363 * d.y + 0.0514459929 * d.z;
    const double m = 0.2119034982 * d.x + 0.6806995451 * d.y + 0.1073969566 * d.z;
    const double s = 0.0883024619 * d.x + 0.2817188376 * d.y + 0.6299787005 * d.z;
    return 0.2104542553 * std::cbrt(l) + 0.7936177850 * std::cbrt(m) - 0.0040720468 * std::cbrt(s);
  };
  for (double t = 0; t < 1.01; t += 0.125) {
    for (const double sign : {-1.0, 1.0}) {
      // What the screen cannot show is cut off; the lightness then moves by less than one can see.
      CHECK(std::abs(lightness(diverging_colour(sign * t)) - (0.975 - 0.525 * t)) < 0.012);
    }
  }
  CHECK(diverging_colour(-0.5).z > diverging_colour(-0.5).x);
  CHECK(diverging_colour(0.5).x > diverging_colour(0.5).z);
  CHECK(diverging_colour(7) == diverging_colour(1));
}
