// Garments for tests, written by our own writer.
#pragma once

#include <string>

#include "samples/gltf_writer.h"

namespace selvedge::test {

/// A square of one metre with one unit of UV, all of it once per primitive, in the materials "cloth 0",
/// "cloth 1"...
inline Garment square(int primitives = 1) {
  Garment garment;
  garment.name = "square";
  for (int i = 0; i < primitives; ++i) {
    garment.materials.push_back(GarmentMaterial{.name = "cloth " + std::to_string(i)});
    GarmentPrimitive primitive;
    primitive.material = i;
    primitive.positions = {V3f(0, 0, 0), V3f(1, 0, 0), V3f(1, 1, 0), V3f(0, 1, 0)};
    primitive.normals.assign(4, V3f(0, 0, 1));
    primitive.tex_coords = {V2f(0, 1), V2f(1, 1), V2f(1, 0), V2f(0, 0)};
    primitive.indices = {0, 1, 2, 0, 2, 3};
    garment.primitives.push_back(primitive);
  }
  return garment;
}

}  // namespace selvedge::test
