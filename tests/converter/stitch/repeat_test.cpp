#include "converter/stitch/pattern.h"

#include <doctest/doctest.h>

#include "converter/stitch/implicit_surface.h"
#include "converter/stitch/library.h"
#include "format/base/random.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;

TEST_CASE("several repeats of a stitch are the same cloth, of yarns as long") {
  for (const char* name : {"rib", "satin"}) {
    const StitchPattern one = test::need(find_stitch(name, of_tubes())).pattern;
    for (const int count : {2, 3}) {
      CAPTURE(name);
      CAPTURE(count);
      const StitchPattern many = repeat_pattern(one, count);
      CHECK(validate(many, name).has_value());
      CHECK(many.period_mm == one.period_mm * count);
      std::size_t segments = 0;
      for (const Yarn& yarn : one.yarns) segments += yarn.segments.size();
      std::size_t of_many = 0;
      for (const Yarn& yarn : many.yarns) of_many += yarn.segments.size();
      CHECK(of_many == segments * count * count);
      const auto surface = test::need(ImplicitSurface::build(one, 0.5, name));
      const auto repeated_surface = test::need(ImplicitSurface::build(many, 0.5, name));
      Random random(1);
      for (int i = 0; i < 500; ++i) {
        const V3d at(random.uniform() * many.period_mm.x, random.uniform() * many.period_mm.y,
                     surface.z_low() + random.uniform() * (surface.z_high() - surface.z_low()));
        CHECK(repeated_surface.distance(at) == doctest::Approx(surface.distance(at)).epsilon(1e-9));
      }
    }
  }
}
