// A path tracer's loop: prints the mean radiance of a sheet of fabric over a grey floor under a white sky.
#include <selvedge/selvedge.h>

#include <cmath>
#include <cstdio>
#include <random>

int main(int argc, char** argv) {
  const auto front = argc == 2 ? selvedge::FabricFile::open(argv[1]) : std::nullopt;
  const auto back = front ? front->turned_over() : std::nullopt;
  if (!back) return std::fprintf(stderr, "usage: path_tracer FABRIC.exr\n"), 2;
  std::mt19937 engine(1);
  std::uniform_real_distribution<float> random(0, 1);
  constexpr int paths = 20000;
  double sum = 0, squares = 0;
  for (int i = 0; i < paths; ++i) {
    const double u = random(engine), v = random(engine);
    std::array<float, 3> view{0.6F, 0, 0.8F};  // in the frame of the side that it is on
    double throughput = 1;
    bool above = true;
    do {
      const auto& side = above ? front : back;
      const auto drawn = side->sample_at(0, u, v, view, {random(engine), random(engine), random(engine)});
      if (random(engine) >= drawn->alpha) {
        above = !above;  // through a hole, straight on
      } else {
        throughput *= drawn->pdf > 0 ? static_cast<double>(drawn->weight[1]) : 0;
        above = above == (drawn->light[2] > 0);  // a light of z < 0 comes through the cloth
      }
      if (above || throughput == 0) break;          // the sky has radiance 1
      throughput *= random(engine) < 0.5F ? 1 : 0;  // the floor absorbs half of the paths
      const float r2 = random(engine), angle = 6.2831853F * random(engine);
      view = {std::sqrt(r2) * std::cos(angle), std::sqrt(r2) * std::sin(angle), std::sqrt(1 - r2)};
    } while (throughput > 0);
    sum += throughput, squares += throughput * throughput;
  }
  std::printf("radiance %.6g +- %.2g\n", sum / paths, std::sqrt(squares - sum * sum / paths) / paths);
}
