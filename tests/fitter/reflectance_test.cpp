#include "tests/fitter/reflectance.h"

#include <doctest/doctest.h>

#include "tests/require.h"
#include "tests/shared_data.h"

using namespace selvedge;

TEST_CASE("measured fabrics: the error falls with the lobes, green fabric's to 0.048 with three") {
  for (const char* name : {"beige-fabric", "green-fabric", "nylon", "pink-felt", "red-fabric"}) {
    const std::string file = test::shared_data(std::string("reflectance/sgd_") + name + ".csv");
    if (file.empty()) return;
    const auto reflectance = test::need(test::read_reflectance(file));
    double before = 1;
    for (const int lobes : {1, 2, 3}) {
      const test::ReflectanceError error = test::fit_reflectance(reflectance, lobes);
      CHECK(error.weighted < before);
      before = error.weighted;
    }
    if (std::string(name) == "green-fabric") CHECK(before <= 0.048);
  }
}
