#include "format/fabric/footprint.h"

#include <doctest/doctest.h>

TEST_CASE("what a pixel's coordinates do not tell is level 0") {
  CHECK(std::log2(selvedge::pixel_width_texels({{0, 0}, {0, 0}})) < 0);
}
