// Prints the reflectance of the middle texel of each level of a fabric, lit from 45 degrees and seen from
// straight above, and the length of each of its yarns.
#include <selvedge/selvedge.h>

#include <cmath>
#include <cstdio>

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: evaluate FABRIC.exr\n"), 2;
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
    const auto f = fabric->evaluate(k, data.width / 2, data.height / 2, {slanted, 0, slanted}, {0, 0, 1});
    if (!f) return 1;
    std::printf("level %d, %dx%d texels, %d lobes: rgb %.6g %.6g %.6g, alpha %.6g\n", k, data.width,
                data.height, data.lobes, f->rgb[0], f->rgb[1], f->rgb[2], f->alpha);
  }
  const selvedge::FabricYarns yarns = fabric->yarns();
  const float* node = yarns.nodes.data();  // x, y and z in mm
  for (const selvedge::FabricYarnCurve& curve : yarns.curves) {
    double length = 0;
    for (int i = 1; i < curve.nodes; ++i, node += 3)
      length += std::hypot(node[3] - node[0], node[4] - node[1], node[5] - node[2]);
    node += 3;
    std::printf("yarn of radius %.6g mm: %d nodes over %.6g mm\n", curve.radius_mm, curve.nodes, length);
  }
}
