#include "format/library/selvedge.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "format/check/fabric.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"

namespace selvedge {

struct FabricFile::State {
  Fabric fabric;  // its level 0 is first_level of the file
  FabricFacts facts;
  int first_level = 0;

  /// Null where the file is refused.
  static std::shared_ptr<const State> read(Result<FabricReader> reader, FabricProblem* problem,
                                           const FabricReadOptions& options);
};

namespace {

FabricProblem problem_of(const Error& error) {
  return {std::string(name_of(error.code)), severity_of(error.code) == Severity::error, error.file,
          error.place, error.message};
}

FabricFacts facts_of(const FabricHeader& header) {
  return {{header.period_mm.x, header.period_mm.y},
          header.reference_height,
          header.thickness_mm,
          header.levels,
          header.views.columns,
          header.views.rows,
          header.radiance_scale};
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

std::shared_ptr<const FabricFile::State> FabricFile::State::read(Result<FabricReader> reader,
                                                                 FabricProblem* problem,
                                                                 const FabricReadOptions& options) {
  const auto refuse = [&](const Error& error) {
    if (problem != nullptr) *problem = problem_of(error);
    return nullptr;
  };
  if (!reader) return refuse(reader.error());
  auto state = std::make_shared<State>();
  state->facts = facts_of(reader->header());
  state->first_level = std::max(options.first_level, 0);
  const int last = std::min(options.last_level, state->facts.levels - 1);
  if (state->first_level <= last) {
    auto fabric = reader->read_levels(state->first_level, last);
    if (!fabric) return refuse(fabric.error());
    state->fabric = std::move(*fabric);
  }
  return state;
}

namespace {

FabricLimits limits_of(const FabricReadOptions& options) {
  return {options.max_texels_per_side, options.max_directions, options.max_lobes};
}

}  // namespace

std::optional<FabricFile> FabricFile::open(const std::string& path, FabricProblem* problem,
                                           const FabricReadOptions& options) {
  auto state = State::read(FabricReader::open(path, limits_of(options)), problem, options);
  if (state == nullptr) return {};
  return FabricFile(std::move(state));
}

std::optional<FabricFile> FabricFile::open(std::span<const std::byte> bytes, const std::string& name,
                                           FabricProblem* problem, const FabricReadOptions& options) {
  const std::span unsigned_bytes(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  auto state = State::read(FabricReader::open(unsigned_bytes, name, limits_of(options)), problem, options);
  if (state == nullptr) return {};
  return FabricFile(std::move(state));
}

const FabricFacts& FabricFile::facts() const { return state_->facts; }

bool FabricFile::has_level(int level) const {
  const auto read = static_cast<std::ptrdiff_t>(state_->fabric.levels.size());
  return level >= state_->first_level && level - state_->first_level < read;
}

FabricLevelData FabricFile::level(int level) const {
  FabricLevelData data;
  if (!has_level(level)) return data;
  const FabricLevel& of = state_->fabric.levels[level - state_->first_level];
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
  const FabricLevel& of = state_->fabric.levels[level - state_->first_level];
  if (x < 0 || y < 0 || x >= of.width || y >= of.height) return {};
  return radiance_of(selvedge::evaluate(state_->fabric, level - state_->first_level, x, y, vector_of(light),
                                        vector_of(view)));
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
  return radiance_of(selvedge::evaluate(state_->fabric, clamped - state_->first_level, V2d(u, v),
                                        vector_of(light), vector_of(view)));
}

std::vector<FabricProblem> check_fabric_file(const std::string& path) {
  std::vector<FabricProblem> problems;
  for (const Error& issue : check_fabric(path)) problems.push_back(problem_of(issue));
  return problems;
}

}  // namespace selvedge
