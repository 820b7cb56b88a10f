// Letting cloth hang: position-based dynamics with small steps.
#pragma once

#include <functional>
#include <vector>

#include "format/base/vec.h"

namespace selvedge::samples {

/// Two points that want to be `length` metres apart.
struct Thread {
  int a = 0;
  int b = 0;
  double length = 0;
  double compliance = 0;  ///< metres per newton for points of 1 kg; 0: does not give
};

struct Cloth {
  std::vector<V3d> positions;  ///< metres, y up
  std::vector<bool> held;      ///< one per position: does not move
  std::vector<Thread> threads;
};

struct DrapeOptions {
  int steps = 900;
  double step = 1.0 / 900;  ///< seconds
  double gravity = 2.5;     ///< m/s^2; less than the earth's, so that few steps suffice
  double drag = 2.0;        ///< 1/s
  double margin = 0.004;    ///< metres between the cloth and the body
  double friction = 0.4;
};

/// Lets the cloth fall onto the body, given by its signed distance (metres, positive outside). The threads
/// are taken in their order, so that the same cloth gives the same bytes. (Macklin et al. 2019, "Small Steps
/// in Physics Simulation".)
std::vector<V3d> drape(const Cloth& cloth, const std::function<double(const V3d&)>& body,
                       const DrapeOptions& options = {});

/// The cloth without what is shorter than a fold: `rounds` of half a step towards the mean of the neighbours
/// along the threads that do not give, and `swell` of a step back: 0 smooths most and shrinks, 0.52 (Taubin's
/// filter) keeps the size. Points that are held stay.
std::vector<V3d> smooth(const Cloth& cloth, int rounds, double swell);

}  // namespace selvedge::samples
