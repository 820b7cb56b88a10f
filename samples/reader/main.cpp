// Reads a fabric file and prints the reflectance of the middle texel of each level, lit from 45 degrees and
// seen from straight above; what it reflects of light from everywhere, as path tracers find it; and how long
// each of its yarns is.
#include <selvedge/selvedge.h>

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <random>

/// The mean weight of random lights, of green, and its standard error.
static void print_white(const selvedge::FabricFile& fabric, int level, double u, double v) {
  constexpr int lights = 20000;
  std::mt19937 engine(1);
  std::uniform_real_distribution<float> number(0, 1);
  double sum = 0;
  double squares = 0;
  for (int i = 0; i < lights; ++i) {
    // A path goes on towards drawn->light with its throughput times the weight, or straight on through a hole
    // with the probability 1 - drawn->alpha.
    const auto drawn =
        fabric.sample_at(level, u, v, {0, 0, 1}, {number(engine), number(engine), number(engine)});
    if (!drawn) return;
    sum += static_cast<double>(drawn->weight[1]);
    squares += std::pow(static_cast<double>(drawn->weight[1]), 2);
  }
  const double mean = sum / lights;
  std::printf("level %d reflects %.6g +- %.2g of green light from everywhere\n", level, mean,
              std::sqrt((squares / lights - mean * mean) / lights));
}

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: fabric-reader FABRIC.exr\n");
    return 2;
  }
  selvedge::FabricProblem problem;
  const auto fabric = selvedge::FabricFile::open(argv[1], &problem);
  if (!fabric) {
    std::fprintf(stderr, "%s: %s: %s [%s]\n", problem.file.c_str(), problem.place.c_str(),
                 problem.message.c_str(), problem.code.c_str());
    return 1;
  }
  const float slanted = std::sqrt(0.5F);
  for (int k = 0; k < fabric->facts().levels; ++k) {
    const auto data = fabric->level(k);
    const auto answer =
        fabric->evaluate(k, data.width / 2, data.height / 2, {slanted, 0, slanted}, {0, 0, 1});
    if (!answer) return 1;
    std::printf("level %d, %dx%d texels, %d lobes: rgb %.6g %.6g %.6g, alpha %.6g\n", k, data.width,
                data.height, data.lobes, static_cast<double>(answer->rgb[0]),
                static_cast<double>(answer->rgb[1]), static_cast<double>(answer->rgb[2]),
                static_cast<double>(answer->alpha));
  }
  for (int k = 0; k < fabric->facts().levels; ++k) {
    const auto data = fabric->level(k);
    print_white(*fabric, k, (data.width / 2 + 0.5) / data.width, (data.height / 2 + 0.5) / data.height);
  }
  const selvedge::FabricYarns yarns = fabric->yarns();
  std::size_t first = 0;
  for (const selvedge::FabricYarnCurve& curve : yarns.curves) {
    double length = 0;
    for (int i = 0; i + 1 < curve.nodes; ++i) {
      const float* node = &yarns.nodes[3 * (first + i)];
      length += std::hypot(node[3] - node[0], node[4] - node[1], node[5] - node[2]);
    }
    std::printf("yarn of radius %.6g mm: %d nodes over %.6g mm\n", static_cast<double>(curve.radius_mm),
                curve.nodes, length);
    first += curve.nodes;
  }
  return 0;
}
