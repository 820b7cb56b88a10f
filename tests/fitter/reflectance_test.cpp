// Measured reflectance of fabrics (../shared/data/reflectance), as the samples of one texel.
#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#include "fitter/lobes/lobe_fit.h"
#include "format/fabric/lafortune.h"
#include "tests/require.h"
#include "tests/shared_data.h"

using namespace selvedge;

namespace {

/// f_r (1/sr, without cosine) over a full grid of incoming and outgoing directions; isotropic.
struct Reflectance {
  std::vector<V3f> lights;
  std::vector<V3f> views;
  std::map<std::pair<std::size_t, std::size_t>, V3f> values;  ///< by view and light
};

V3f direction(double theta, double phi) {
  constexpr double degree = std::numbers::pi / 180;
  return V3f(V3d(std::sin(theta * degree) * std::cos(phi * degree),
                 std::sin(theta * degree) * std::sin(phi * degree), std::cos(theta * degree)));
}

/// theta_i, theta_o, dphi in degrees, then r, g, b; # comments, one line of names.
Reflectance read_reflectance(const std::string& path) {
  std::ifstream file(path);
  std::map<std::pair<double, double>, std::size_t> lights;
  std::map<double, std::size_t> views;
  Reflectance result;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#' || line[0] == 't') continue;
    std::istringstream text(line);
    double in = 0;
    double out = 0;
    double phi = 0;
    V3f value;
    char comma = 0;
    text >> in >> comma >> out >> comma >> phi >> comma >> value.x >> comma >> value.y >> comma >> value.z;
    REQUIRE(text);
    const auto light = lights.try_emplace({in, phi}, lights.size());
    if (light.second) result.lights.push_back(direction(in, phi));
    const auto view = views.try_emplace(out, views.size());
    if (view.second) result.views.push_back(direction(out, 0));
    result.values[{view.first->second, light.first->second}] = value;
  }
  REQUIRE(result.values.size() == lights.size() * views.size());
  return result;
}

/// sqrt(sum w^2 (m - d)^2 / sum w^2 d^2) over all channels, w = cos theta_i cos theta_o, of a fit without
/// table. Its least squares are the weighted error's: opacity is cos^2 theta_o.
double error_of_fit(const Reflectance& data, int lobes) {
  std::vector<float> alpha;
  std::vector<V3f> radiance;
  for (std::size_t v = 0; v < data.views.size(); ++v) {
    alpha.push_back(data.views[v].z * data.views[v].z);
    for (std::size_t l = 0; l < data.lights.size(); ++l)
      radiance.push_back(data.values.at({v, l}) * data.lights[l].z);
  }
  FitOptions options{
      .lobes = lobes, .view_table = false, .starts = 16, .max_iterations = 1000, .tolerance = 1e-6};
  // The grid ends at 80 degrees, where forward lobes still rise.
  options.max_peak_ratio = 4;
  const std::array<ChannelFit, 3> fits = fit_texel(
      gather_texel(alpha.data(), radiance.data(), {data.views, data.lights}, {0, 0, 1}, {1, 0, 0}), options);
  double error = 0;
  double energy = 0;
  for (const auto& [at, value] : data.values) {
    const V3d view(data.views[at.first]);
    const V3d light(data.lights[at.second]);
    const double weight = std::pow(view.z * light.z, 2);
    for (int c = 0; c < 3; ++c) {
      const double model = lafortune_lobes(fits[c].parameters.data(), lobes, &light.x, &view.x);
      error += weight * std::pow(model - static_cast<double>(value[c]), 2);
      energy += weight * std::pow(static_cast<double>(value[c]), 2);
    }
  }
  return std::sqrt(error / energy);
}

}  // namespace

TEST_CASE("measured fabrics: the error falls with the lobes, green fabric's to 0.048 with three") {
  for (const char* name : {"beige-fabric", "green-fabric", "nylon", "pink-felt", "red-fabric"}) {
    const std::string file = test::shared_data(std::string("reflectance/sgd_") + name + ".csv");
    if (file.empty()) return;
    const Reflectance reflectance = read_reflectance(file);
    double before = 1;
    for (const int lobes : {1, 2, 3}) {
      const double error = error_of_fit(reflectance, lobes);
      CHECK(error < before);
      before = error;
    }
    if (std::string(name) == "green-fabric") CHECK(before <= 0.048);
  }
}
