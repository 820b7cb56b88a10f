#include "format/library/selvedge.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "format/evaluate.h"
#include "format/fabric_check.h"
#include "format/fabric_exr.h"

namespace selvedge {

struct FabricFile::State {
  Fabric fabric;
  FabricFacts facts;
  int first_level = 0;
  int last_level = 0;
};

namespace {

FabricProblem problem_of(const Error& error) {
  return {std::string(name_of(error.code)), severity_of(error.code) == Severity::error, error.file,
          error.place, error.message};
}

FabricFacts facts_of(const Fabric& fabric) {
  return {{fabric.period_mm.x, fabric.period_mm.y}, fabric.reference_height, fabric.thickness_mm,
          static_cast<int>(fabric.levels.size()),   fabric.views.columns,    fabric.views.rows};
}

// Imath's vectors are three floats without padding.
std::span<const float> floats_of(const std::vector<V3f>& vectors) {
  static_assert(sizeof(V3f) == 3 * sizeof(float));
  return {reinterpret_cast<const float*>(vectors.data()), vectors.size() * 3};
}

V3f vector_of(const std::array<float, 3>& a) { return {a[0], a[1], a[2]}; }

FabricRadiance radiance_of(const Shading& s) { return {{s.radiance.x, s.radiance.y, s.radiance.z}, s.alpha}; }

bool is_finite(const std::array<float, 3>& a) {
  return std::all_of(a.begin(), a.end(), [](float x) { return std::isfinite(x); });
}

}  // namespace

FabricFile::FabricFile(std::shared_ptr<const State> state) : state_(std::move(state)) {}

std::optional<FabricFile> FabricFile::open(const std::string& path, FabricProblem* problem,
                                           const FabricReadOptions& /*options*/) {
  auto fabric = read_fabric(path);
  if (!fabric) {
    if (problem != nullptr) *problem = problem_of(fabric.error());
    return {};
  }
  auto state = std::make_shared<State>();
  state->facts = facts_of(*fabric);
  state->fabric = std::move(*fabric);
  return FabricFile(std::move(state));
}

const FabricFacts& FabricFile::facts() const { return state_->facts; }

bool FabricFile::has_level(int level) const {
  return level >= state_->first_level && level <= state_->last_level;
}

FabricLevelData FabricFile::level(int level) const {
  FabricLevelData data;
  if (!has_level(level)) return data;
  const FabricLevel& of = state_->fabric.levels[static_cast<std::size_t>(level)];
  data.width = of.width;
  data.height = of.height;
  if (of.lobes) {
    data.lobes = of.lobes->lobes;
    data.parameters = of.lobes->parameters;
  }
  if (of.frame) {
    data.normals = floats_of(of.frame->normal);
    data.tangents = floats_of(of.frame->tangent);
  }
  if (of.view_table) data.view_table = floats_of(of.view_table->colour);
  if (of.opacity) data.opacity = of.opacity->opacity;
  return data;
}

std::optional<FabricRadiance> FabricFile::evaluate(int level, int x, int y, const std::array<float, 3>& light,
                                                   const std::array<float, 3>& view) const {
  if (!has_level(level) || !is_finite(light) || !is_finite(view)) return {};
  const FabricLevel& of = state_->fabric.levels[static_cast<std::size_t>(level)];
  if (x < 0 || y < 0 || x >= of.width || y >= of.height) return {};
  return radiance_of(selvedge::evaluate(state_->fabric, level, x, y, vector_of(light), vector_of(view)));
}

std::optional<FabricRadiance> FabricFile::evaluate_at(double level, double u, double v,
                                                      const std::array<float, 3>& light,
                                                      const std::array<float, 3>& view) const {
  if (!std::isfinite(level) || !std::isfinite(u) || !std::isfinite(v)) return {};
  if (!is_finite(light) || !is_finite(view)) return {};
  const double clamped = std::clamp(level, 0.0, static_cast<double>(state_->facts.levels - 1));
  if (!has_level(static_cast<int>(std::floor(clamped))) || !has_level(static_cast<int>(std::ceil(clamped)))) {
    return {};
  }
  return radiance_of(
      selvedge::evaluate(state_->fabric, clamped, V2d(u, v), vector_of(light), vector_of(view)));
}

std::vector<FabricProblem> check_fabric_file(const std::string& path) {
  std::vector<FabricProblem> problems;
  for (const Error& issue : check_fabric(path)) problems.push_back(problem_of(issue));
  return problems;
}

}  // namespace selvedge
