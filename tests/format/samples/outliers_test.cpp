#include "format/samples/outliers.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "format/base/random.h"

using namespace selvedge;

namespace {

/// A glossy texel repeated, with noise of up to a factor 2.
SampleLevel noisy_level(const SamplesHeader& header, int height) {
  SampleLevel level;
  level.width = header.width;
  level.height = height;
  level.views = header.views.count();
  level.lights = header.lights.count();
  Random random(11);
  for (int t = 0; t < level.texels(); ++t) {
    for (const V3f& v : directions_of(header.views)) {
      level.alpha.push_back(0.5F);
      for (const V3f& l : directions_of(header.lights)) {
        const auto noise = static_cast<float>(0.5 + random.uniform());
        const float gloss = std::pow(std::max(0.0F, l.z * v.z - l.x * v.x - l.y * v.y), 30.0F);
        level.radiance.push_back(V3f(0.1F, 0.2F, 0.05F) * (l.z + 5 * gloss) * noise);
      }
    }
  }
  return level;
}

}  // namespace

TEST_CASE("a sample far out of all around it is named, with its number among all rows") {
  SamplesHeader header;
  header.width = 3;
  header.height = 4;
  OutlierSearch search(header);
  search.add(noisy_level(header, 2));
  CHECK(search.warnings().empty());
  SampleLevel rows = noisy_level(header, 2);
  const auto at = [&](int texel, int view, int light) -> V3f& {
    return rows.radiance[(texel * rows.views + view) * rows.lights + light];
  };
  at(4, 5, 6).y = 1000;
  at(2, 63, 0) = V3f(100);
  search.add(rows);
  const Issues found = search.warnings();
  REQUIRE(found.size() == 1);
  CHECK(found[0].code == Code::samples_outlier);
  CHECK(found[0].place == "texel 1,3, view 5, light 6");
  CHECK(found[0].message.find("2 samples") != std::string::npos);
}

TEST_CASE("a highlight that its neighbours share is none, nor is a texel that is dark but for one sample") {
  SamplesHeader header;
  header.width = header.height = 1;
  SampleLevel level = noisy_level(header, 1);
  // Bright in neighbouring lights.
  for (const int light : {27, 28}) level.radiance[std::size_t{20} * level.lights + light] = V3f(50);
  OutlierSearch shared(header);
  shared.add(level);
  CHECK(shared.warnings().empty());
  std::fill(level.radiance.begin(), level.radiance.end(), V3f(0));
  level.radiance[100] = V3f(1);
  OutlierSearch alone(header);
  alone.add(level);
  CHECK(alone.warnings().empty());
}
