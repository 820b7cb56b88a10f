// CIEDE2000 beside the table of Sharma, Wu and Dalal (2005), in colours of the screen.
#include "format/base/colour_difference.h"

#include <doctest/doctest.h>

using namespace selvedge;

TEST_CASE("CIEDE2000: pairs of linear colours and their differences") {
  struct Row {
    V3f a, b;
    double difference;
  };
  for (const Row& row : {
           Row{V3f(0, 0, 0), V3f(1, 1, 1), 100},
           Row{V3f(0.3F, 0.1F, 0.7F), V3f(0.3F, 0.1F, 0.7F), 0},
           Row{V3f(-0.19177992F, 0.21203774F, 1.0160534F), V3f(-0.23097506F, 0.21879307F, 1.0646111F),
               2.0425},
           Row{V3f(0.19921056F, 0.17969204F, 0.18445014F), V3f(0.169423F, 0.18860301F, 0.18392793F), 7.1792},
           Row{V3f(0.19927407F, 0.17967361F, 0.18444559F), V3f(0.64491838F, 0.37294944F, 0.66188528F),
               27.1492},
           Row{V3f(0.13527474F, 0.34925404F, 0.077055296F), V3f(0.14141446F, 0.3517631F, 0.065964349F),
               1.2644},
           Row{V3f(0.0048455277F, 0.029852985F, 0.20533531F), V3f(0.00301429F, 0.033645651F, 0.18562105F),
               2.0373},
           Row{V3f(0.75788293F, 0.78939387F, 0.75901382F), V3f(0.76268765F, 0.79589849F, 0.78709846F),
               1.4441},
           Row{V3f(0.001967318F, 0.0023141849F, 0.0031400217F),
               V3f(0.00075750964F, 0.0010310725F, 0.0014067007F), 0.9082},
           Row{V3f(0.0064240164F, 0.0076392958F, 0.0092899569F),
               V3f(0.0056453014F, 0.0065880251F, 0.0081458756F), 0.6377},
           Row{V3f(-0.037404019F, 0.12336985F, 0.071029912F), V3f(-0.031190335F, 0.12041472F, 0.077844178F),
               1.8645},
           Row{V3f(0.33918867F, 0.024065838F, 0.04368304F), V3f(0.35415364F, 0.018864279F, 0.037274267F),
               1.4146},
       }) {
    CHECK(ciede2000(row.a, row.b) == doctest::Approx(row.difference).epsilon(1e-3));
    CHECK(ciede2000(row.b, row.a) == doctest::Approx(row.difference).epsilon(1e-3));
  }
}
