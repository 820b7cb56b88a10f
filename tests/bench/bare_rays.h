// Rays of a bake, taken to the ray tracer without the bake: what its rates are held against.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "converter/mesh/cell_mesh.h"

namespace selvedge {

/// 16 rays as the bake casts them: unit directions, origins in the cell in the middle of a block.
struct BareRays {
  std::array<float, 16> x, y, z, dx, dy, dz;
  std::uint32_t active = 0;  ///< bit i: lane i is a ray
};

/// A block of 3 x 3 cells in a tree of the same kind as RayScene's.
class BareTracer {
 public:
  explicit BareTracer(const CellMesh& cell);
  BareTracer(const BareTracer&) = delete;
  BareTracer& operator=(const BareTracer&) = delete;
  ~BareTracer();

  /// CPU seconds for all packets, on one thread: nearest hits, or whether anything is hit.
  double nearest(std::span<const BareRays> packets) const;
  double any(std::span<const BareRays> packets) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace selvedge
