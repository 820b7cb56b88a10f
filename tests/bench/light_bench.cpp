// Random lights of path tracers: their noise beside that of lights drawn by the cosine, and their time.
// selvedge-bench-lights [--rows FILE] FABRIC.exr ...
//
// At random places and views 10 degrees and more above the cloth, one sample of the integral of f has the
// variance V, of the sampler and of the cosine; the row "noise" is the sum of V_cosine over the sum of V, by
// mean^2 of each place: so many lights of the cosine have the error of one light. Where light comes through,
// the cosine has one light of two on either side. "time" is that of a light of the sampler, made anew for
// each, over that of one of the cosine; both evaluate f.
#include <cmath>
#include <numbers>

#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/fabric/light_sampler.h"
#include "tests/bench/rows.h"

namespace {

using namespace selvedge;

constexpr int places = 400;
constexpr int lights = 2000;

double mean(const V3f& colour) { return (static_cast<double>(colour.x) + colour.y + colour.z) / 3; }

/// Relative variance of single values.
struct Noise {
  double sum = 0;
  double squares = 0;
  void add(double value) {
    sum += value;
    squares += value * value;
  }
  double variance() const { return sum > 0 ? squares * lights / (sum * sum) - 1 : 0; }
};

void compare(const std::string& name, const Fabric& fabric, double level, bench::Rows& rows) {
  const bool through = level < 0 ? !fabric.levels.front().yarns()->data().through.empty()
                                 : fabric.side_of(Side::through) != nullptr;
  const CosineLobe up;
  double by_cosine = 0;
  double by_sampler = 0;
  double seconds = 0;
  double cosine_seconds = 0;
  for (int place = 0; place < places; ++place) {
    Random random(1, place);
    const double z = 0.17 + 0.83 * random.uniform();
    const double angle = 2 * std::numbers::pi * random.uniform();
    const double r = std::sqrt(1 - z * z);
    const V3f view(V3d(r * std::cos(angle), r * std::sin(angle), z));
    const double u = random.uniform();
    const V2d uv(u, random.uniform());
    const auto number = [&] { return random.uniform(); };
    std::vector<V3d> numbers(lights);
    for (V3d& three : numbers) {
      for (int i = 0; i < 3; ++i) three[i] = number();
    }
    Noise cosine;
    Noise sampler;
    // As a path tracer does that needs one light of each place.
    const double begun = bench::cpu_seconds();
    for (const V3d& three : numbers)
      sampler.add(mean(LightSampler(fabric, level, uv, view).sample(three).weight));
    seconds += bench::cpu_seconds() - begun;
    const double between = bench::cpu_seconds();
    for (const V3d& three : numbers) {
      V3d light = up.sample({three.y, three.z});
      const double pdf = up.pdf(light) / (through ? 2 : 1);
      if (through && three.x < 0.5) light.z = -light.z;
      cosine.add(mean(evaluate(fabric, level, uv, V3f(light), view).radiance) / pdf);
    }
    cosine_seconds += bench::cpu_seconds() - between;
    by_cosine += cosine.variance();
    by_sampler += sampler.variance();
  }
  const std::string row = fmt::format("lights/{}/level_{}/", name, level);
  rows.add(row + "noise", by_cosine / by_sampler, "ratio");
  rows.add(row + "time", seconds / cosine_seconds, "ratio");
  fmt::print("{:26} level {:2}: variance {:6.3f} by the cosine, {:6.3f} by the sampler: {:5.2f} times less\n",
             name, level, by_cosine / places, by_sampler / places, by_cosine / by_sampler);
  fmt::print("{:36} {:5.0f} ns a light, {:.2f} times those of the cosine\n", "",
             seconds / (static_cast<double>(places) * lights) * 1e9, seconds / cosine_seconds);
}

}  // namespace

int main(int argc, char** argv) {
  bench::Rows rows(argc, argv);
  for (const std::string& path : rows.arguments()) {
    const Fabric fabric = bench::need(read_fabric(path));
    const std::string name = path.substr(path.find_last_of('/') + 1);
    if (fabric.levels.front().yarns()) compare(name, fabric, -1, rows);
    for (std::size_t k = 0; k < fabric.levels.size(); k += 2)
      compare(name, fabric, static_cast<double>(k), rows);
  }
  rows.write();
  return 0;
}
