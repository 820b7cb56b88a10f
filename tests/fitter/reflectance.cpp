#include "tests/fitter/reflectance.h"

#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <utility>

#include "format/fabric/lafortune.h"

namespace selvedge::test {
namespace {

V3f direction(double theta, double phi) {
  constexpr double degree = std::numbers::pi / 180;
  return V3f(V3d(std::sin(theta * degree) * std::cos(phi * degree),
                 std::sin(theta * degree) * std::sin(phi * degree), std::cos(theta * degree)));
}

}  // namespace

Result<Reflectance> read_reflectance(const std::string& path) {
  std::ifstream file(path);
  if (!file) return fail(Code::file_missing, path, {}, "cannot be opened");
  std::map<std::pair<double, double>, std::size_t> lights;
  std::map<double, std::size_t> views;
  std::map<std::pair<std::size_t, std::size_t>, V3f> values;
  Reflectance result;
  std::string line;
  while (std::getline(file, line)) {
    if (line.empty() || line[0] == '#' || line[0] == 't') continue;
    std::istringstream text(line);
    double in = 0;
    double out = 0;
    double phi = 0;
    V3f value;
    char comma = 0;
    text >> in >> comma >> out >> comma >> phi >> comma >> value.x >> comma >> value.y >> comma >> value.z;
    if (!text) return fail(Code::samples_malformed, path, line, "not six numbers");
    const auto light = lights.try_emplace({in, phi}, lights.size());
    if (light.second) result.lights.push_back(direction(in, phi));
    const auto view = views.try_emplace(out, views.size());
    if (view.second) result.views.push_back(direction(out, 0));
    values[{view.first->second, light.first->second}] = value;
  }
  for (std::size_t v = 0; v < result.views.size(); ++v) {
    for (std::size_t l = 0; l < result.lights.size(); ++l) {
      const auto found = values.find({v, l});
      if (found == values.end()) return fail(Code::samples_malformed, path, {}, "not a full grid");
      result.values.push_back(found->second);
    }
  }
  return result;
}

TexelSamples texel_of(const Reflectance& reflectance) {
  std::vector<float> alpha;
  std::vector<V3f> radiance;
  for (const V3f& view : reflectance.views) {
    alpha.push_back(view.z * view.z);
    for (const V3f& light : reflectance.lights)
      radiance.push_back(reflectance.values[radiance.size()] * light.z);
  }
  return gather_texel(alpha.data(), radiance.data(), {reflectance.views, reflectance.lights}, {0, 0, 1},
                      {1, 0, 0});
}

ReflectanceError fit_reflectance(const Reflectance& reflectance, int lobes) {
  LobeFitOptions options;
  options.lobes = lobes;
  options.starts = 16;
  options.tolerance = 1e-6;
  options.max_iterations = 1000;
  options.channel.view_table = false;
  // The grid ends at 80 degrees, where forward lobes still rise.
  options.channel.peak = 4;
  const std::array<ChannelFit, 3> fits = fit_texel(texel_of(reflectance), options);
  V2d error(0, 0);
  V2d energy(0, 0);
  for (std::size_t v = 0; v < reflectance.views.size(); ++v) {
    for (std::size_t l = 0; l < reflectance.lights.size(); ++l) {
      const V3d view(reflectance.views[v]);
      const V3d light(reflectance.lights[l]);
      const V2d weight(view.z * view.z * light.z * light.z, 1);
      for (std::size_t c = 0; c < 3; ++c) {
        const double model = lafortune_lobes(fits[c].parameters.data(), lobes, &light.x, &view.x);
        const auto data =
            static_cast<double>(reflectance.values[v * reflectance.lights.size() + l][static_cast<int>(c)]);
        error += weight * ((model - data) * (model - data));
        energy += weight * (data * data);
      }
    }
  }
  return {std::sqrt(error.x / energy.x), std::sqrt(error.y / energy.y)};
}

}  // namespace selvedge::test
