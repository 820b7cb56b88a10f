#include "apps/report/svg.h"

#include <doctest/doctest.h>
#include <OpenImageIO/detail/pugixml/pugixml.hpp>

#include "apps/report/chart.h"

using namespace selvedge;

namespace {

OIIO::pugi::xml_node parsed(OIIO::pugi::xml_document& document, const std::string& svg) {
  REQUIRE(document.load_string(svg.c_str()));
  return document.child("svg");
}

std::vector<double> ticks_of(const Axis& axis) {
  std::vector<double> ticks;
  for (const Axis::Tick& tick : axis.ticks) ticks.push_back(tick.at);
  return ticks;
}

}  // namespace

TEST_CASE("svg: it is XML that has every shape, and texts as they are") {
  const auto draw = [] {
    Svg svg;
    svg.text({1, 2}, "a < b & \"c\" > 8°\x1b", 13, ink, Svg::Anchor::end, true);
    svg.line({{1, 2}, {3, 4.125}}, 1.5, "#0102ff");
    svg.disc({4, 5}, 6, ink);
    svg.box({2, 1}, {3.5, 2}, blue);
    return svg;
  };
  const std::string svg = draw().file(30, 20, "a \"drawing\"");
  OIIO::pugi::xml_document document;
  const auto root = parsed(document, svg);
  CHECK(std::string(root.attribute("viewBox").value()) == "0 0 30 20");
  CHECK(std::string(root.child_value("title")) == "a \"drawing\"");
  CHECK(std::string(root.child_value("text")) == "a < b & \"c\" > 8°\\x1B");
  CHECK(std::string(root.child("text").attribute("text-anchor").value()) == "end");
  CHECK(std::string(root.child("text").attribute("font-weight").value()) == "bold");
  CHECK(std::string(root.child("polyline").attribute("points").value()) == "1,2 3,4.13");
  CHECK(std::string(root.child("polyline").attribute("stroke").value()) == "#0102ff");
  CHECK(std::string(root.child("circle").attribute("r").value()) == "6");
  CHECK(std::string(root.last_child().attribute("width").value()) == "3.5");
  CHECK(svg == draw().file(30, 20, "a \"drawing\""));
}

TEST_CASE("svg: a picture is a PNG of its pixels, encoded for the screen, in its place") {
  const Image two{2, 1, 3, {0, 0, 0, srgb_to_linear(0.6F), 0, 0}};
  Svg svg;
  REQUIRE(svg.picture({7, 8}, two, "two <pixels>"));
  OIIO::pugi::xml_document document;
  const auto picture = parsed(document, svg.file(30, 20, "")).child("image");
  CHECK(std::string(picture.child_value("title")) == "two <pixels>");
  CHECK(std::string(picture.attribute("x").value()) == "7");
  CHECK(std::string(picture.attribute("width").value()) == "2");
  const auto png = encode_png(two);
  REQUIRE(png);
  CHECK(std::string(picture.attribute("href").value()) == png_address(*png));
}

TEST_CASE("svg: base64 is that of RFC 4648") {
  const auto encoded = [](std::string_view text) {
    return png_address({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  };
  CHECK(encoded("") == "data:image/png;base64,");
  CHECK(encoded("f") == "data:image/png;base64,Zg==");
  CHECK(encoded("fo") == "data:image/png;base64,Zm8=");
  CHECK(encoded("foob") == "data:image/png;base64,Zm9vYg==");
  CHECK(encoded("foobar") == "data:image/png;base64,Zm9vYmFy");
}

TEST_CASE("chart: ticks are round and lie within the axis") {
  CHECK(ticks_of(axis_from_zero(0.47)) == std::vector<double>{0, 0.1, 0.2, 0.1 * 3, 0.4, 0.5});
  CHECK(axis_from_zero(32).high == 40);
  CHECK(axis_from_zero(0).high == 1);
  CHECK(ticks_of(linear_axis(-3, 9)) == std::vector<double>{-2, 0, 2, 4, 6, 8});
  CHECK(linear_axis(-3, 9).ticks[1].text == "0");
  CHECK(ticks_of(logarithmic_axis(15, 2500)) == std::vector<double>{20, 50, 100, 200, 500, 1000, 2000});
  CHECK(logarithmic_axis(900, 1e6).ticks.back().text == "1 M");
  CHECK(round_up(0.03) == doctest::Approx(0.05));
  CHECK(round_up(-1) == 1);
}

TEST_CASE("chart: points lie where the axes say, with their labels") {
  Svg svg;
  Chart chart{"title", "left", "below", {1, 100, true, {}}, {0, 10, false, {}}, {}};
  chart.series.push_back({{{1, 0}, {10, 5}, {100, 10}}, blue, 2, 3, {"a", "b", "c"}, {6, -4}});
  draw_chart(svg, {50, 60}, {200, 100}, chart);
  OIIO::pugi::xml_document document;
  const auto root = parsed(document, svg.file(300, 300, ""));
  CHECK(std::string(root.child("polyline").attribute("points").value()) == "50,160 150,110 250,60");
  const auto label =
      root.find_child([](const OIIO::pugi::xml_node& n) { return n.child_value() == std::string("b"); });
  CHECK(std::string(label.attribute("x").value()) == "156");
  CHECK(std::string(label.attribute("y").value()) == "106");
  for (const char* text : {"title", "left", "below"}) {
    CAPTURE(text);
    CHECK(
        root.find_child([&](const OIIO::pugi::xml_node& n) { return n.child_value() == std::string(text); }));
  }
}
