#include "format/library/selvedge.h"

#include <algorithm>
#include <cmath>

#include "format/base/guard.h"
#include "format/check/fabric.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/fabric/level_values.h"
#include "format/fabric/light_sampler.h"

namespace selvedge {

namespace {

FabricProblem problem_of(const Error& error) {
  return {std::string(name_of(error.code)), severity_of(error.code) == Severity::error, error.file,
          error.place, error.message};
}

FabricFacts facts_of(const Fabric& fabric) {
  return {{fabric.period_mm.x, fabric.period_mm.y},
          fabric.reference_height,
          fabric.thickness_mm,
          static_cast<int>(fabric.levels.size()),
          fabric.views.columns,
          fabric.views.rows,
          fabric.lights.columns,
          fabric.lights.rows,
          fabric.radiance_scale};
}

std::vector<FabricYarnCurve> curves_of(const YarnData& data) {
  std::vector<FabricYarnCurve> curves;
  for (const YarnCurve& c : data.curves)
    curves.push_back({c.nodes,
                      c.stations,
                      {c.repeat_offset.x, c.repeat_offset.y},
                      c.radius,
                      {c.albedo.x, c.albedo.y, c.albedo.z},
                      c.gloss.weight,
                      c.gloss.roughness,
                      c.fibre_slope,
                      c.plies.count,
                      c.plies.divisions,
                      c.plies.shift,
                      c.plies.phase,
                      {c.plies.outward_gain.x, c.plies.outward_gain.y, c.plies.outward_gain.z},
                      c.plies.sides,
                      c.flattening});
  return curves;
}

FabricLimits limits_of(const FabricReadOptions& options) {
  return {.texels_per_side = options.max_texels_per_side,
          .directions = options.max_directions,
          .lobes = options.max_lobes,
          .memory = options.max_memory};
}

V3f vector_of(const std::array<float, 3>& a) { return {a[0], a[1], a[2]}; }

FabricRadiance radiance_of(const Shading& s) { return {{s.radiance.x, s.radiance.y, s.radiance.z}, s.alpha}; }

bool is_finite(const std::array<float, 3>& a) {
  return std::ranges::all_of(a, [](float x) { return std::isfinite(x); });
}

/// Sets out[i] to `answer` of lights[i], or random numbers, and views[i]; false, with nothing written, if
/// lengths differ or numbers are not finite, and false without memory.
template <class T, class Answer>
bool answer_all(std::span<const std::array<float, 3>> lights, std::span<const std::array<float, 3>> views,
                std::span<T> out, const Answer& answer) {
  if (lights.size() != out.size() || views.size() != out.size()) return false;
  if (!std::ranges::all_of(lights, is_finite)) return false;
  if (!std::ranges::all_of(views, is_finite)) return false;
  try {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = answer(vector_of(lights[i]), vector_of(views[i]));
  } catch (const std::exception&) {
    return false;
  }
  return true;
}

/// Samplers at one place, made anew where the view changes.
struct SamplersAt {
  const Fabric& fabric;
  double level;
  V2d uv;
  V3f view{0, 0, 0};
  std::optional<LightSampler> sampler = {};
  const LightSampler& seen_from(const V3f& other) {
    if (!sampler || other != view) sampler.emplace(fabric, level, uv, other);
    view = other;
    return *sampler;
  }
};

}  // namespace

struct FabricFile::State {
  Fabric fabric;
  FabricFacts facts;
  std::vector<FabricYarnCurve> curves;

  /// Null without yarn.
  const Yarns* yarns() const { return fabric.levels.front().yarns().get(); }

  /// Null if there is no such level.
  const FabricLevel* level(int level) const {
    return level >= 0 && level < facts.levels ? &fabric.levels[level] : nullptr;
  }
  /// The level, clamped, as one of `fabric`. Nothing if a number is not finite.
  std::optional<double> level_at(double wanted, double u, double v) const {
    if (!std::isfinite(wanted) || !std::isfinite(u) || !std::isfinite(v)) return {};
    return std::clamp(wanted, yarns() != nullptr ? -1.0 : 0.0, facts.levels - 1.0);
  }
  void set(Fabric read) {
    fabric = std::move(read);
    facts = facts_of(fabric);
    if (yarns() != nullptr) curves = curves_of(yarns()->data());
  }
  /// None, with `problem` set, if the file is refused.
  template <class Open>
  static std::optional<FabricFile> read(const std::string& name, const Open& open, FabricProblem* problem) {
    auto state = std::make_shared<State>();
    const Result<void> result = catch_exceptions(name, [&]() -> Result<void> {
      Result<FabricReader> reader = open();
      if (!reader) return tl::unexpected(reader.error());
      return reader->read().map([&](const Fabric& read) { state->set(arranged(read)); });
    });
    if (result) return FabricFile(std::move(state));
    if (problem != nullptr) *problem = problem_of(result.error());
    return {};
  }
};

FabricFile::FabricFile(std::shared_ptr<const State> state) : state_(std::move(state)) {}

std::optional<FabricFile> FabricFile::open(const std::string& path, FabricProblem* problem,
                                           const FabricReadOptions& options) {
  return State::read(
      path, [&] { return FabricReader::open(path, limits_of(options)); }, problem);
}

std::optional<FabricFile> FabricFile::open(std::span<const std::byte> bytes, const std::string& name,
                                           FabricProblem* problem, const FabricReadOptions& options) {
  const std::span unsigned_bytes(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  return State::read(
      name, [&] { return FabricReader::open(unsigned_bytes, name, limits_of(options)); }, problem);
}

const FabricFacts& FabricFile::facts() const { return state_->facts; }

FabricLevelData FabricFile::level(int level) const {
  FabricLevelData data;
  const FabricLevel* const source = state_->level(level);
  if (source == nullptr) return data;
  data.width = source->width;
  data.height = source->height;
  data.lobes = source->lobe_count();
  data.parameters = source->lobes();
  data.frames = (*source)[LayerKind::frame].values;
  data.view_table = (*source)[LayerKind::table].values;
  data.opacity = source->opacity();
  data.light_table = (*source)[LayerKind::light].values;
  if (!source->has(LayerKind::products)) return data;
  data.products = static_cast<int>(source->pairs.size());
  data.pairs = {&source->pairs.front().x, 2 * source->pairs.size()};
  data.coefficients = source->coefficients();
  data.view_basis = source->bases->view;
  data.light_basis = floats_of(source->bases->light);
  return data;
}

FabricYarns FabricFile::yarns() const {
  const Yarns* const yarns = state_->yarns();
  if (yarns == nullptr) return {};
  return {state_->curves, floats_of(yarns->data().nodes), yarns->data().station_light};
}

std::optional<FabricRadiance> FabricFile::evaluate(int level, int x, int y, const std::array<float, 3>& light,
                                                   const std::array<float, 3>& view) const {
  FabricRadiance result;
  return evaluate(level, x, y, {&light, 1}, {&view, 1}, {&result, 1}) ? std::optional(result) : std::nullopt;
}

bool FabricFile::evaluate(int level, int x, int y, std::span<const std::array<float, 3>> lights,
                          std::span<const std::array<float, 3>> views, std::span<FabricRadiance> out) const {
  const FabricLevel* const source = state_->level(level);
  if (source == nullptr || x < 0 || y < 0 || x >= source->width || y >= source->height) return false;
  return answer_all(lights, views, out, [&](const V3f& light, const V3f& view) {
    return radiance_of(selvedge::evaluate(*source, state_->fabric, x, y, light, view));
  });
}

std::optional<FabricRadiance> FabricFile::evaluate_at(double level, double u, double v,
                                                      const std::array<float, 3>& light,
                                                      const std::array<float, 3>& view) const {
  FabricRadiance result;
  return evaluate_at(level, u, v, {&light, 1}, {&view, 1}, {&result, 1}) ? std::optional(result)
                                                                         : std::nullopt;
}

bool FabricFile::evaluate_at(double level, double u, double v, std::span<const std::array<float, 3>> lights,
                             std::span<const std::array<float, 3>> views,
                             std::span<FabricRadiance> out) const {
  const auto at = state_->level_at(level, u, v);
  return at && answer_all(lights, views, out, [&](const V3f& light, const V3f& view) {
           return radiance_of(selvedge::evaluate(state_->fabric, *at, V2d(u, v), light, view));
         });
}

std::optional<FabricLightSample> FabricFile::sample_at(double level, double u, double v,
                                                       const std::array<float, 3>& view,
                                                       const std::array<float, 3>& random) const {
  FabricLightSample result;
  return sample_at(level, u, v, {&view, 1}, {&random, 1}, {&result, 1}) ? std::optional(result)
                                                                        : std::nullopt;
}

bool FabricFile::sample_at(double level, double u, double v, std::span<const std::array<float, 3>> views,
                           std::span<const std::array<float, 3>> randoms,
                           std::span<FabricLightSample> out) const {
  const auto at = state_->level_at(level, u, v);
  if (!at) return false;
  for (const std::array<float, 3>& random : randoms)
    if (!std::ranges::all_of(random, [](float x) { return x >= 0 && x <= 1; })) return false;
  SamplersAt samplers{state_->fabric, *at, V2d(u, v)};
  return answer_all(randoms, views, out, [&](const V3f& random, const V3f& view) {
    V3d below_one(random);
    for (int i = 0; i < 3; ++i) below_one[i] = std::min(below_one[i], 1 - 0x1p-24);
    const LightSample s = samplers.seen_from(view).sample(below_one);
    return FabricLightSample{
        {s.light.x, s.light.y, s.light.z}, s.pdf, {s.weight.x, s.weight.y, s.weight.z}, s.alpha};
  });
}

std::optional<float> FabricFile::pdf_at(double level, double u, double v, const std::array<float, 3>& light,
                                        const std::array<float, 3>& view) const {
  float result = 0;
  return pdf_at(level, u, v, {&light, 1}, {&view, 1}, {&result, 1}) ? std::optional(result) : std::nullopt;
}

bool FabricFile::pdf_at(double level, double u, double v, std::span<const std::array<float, 3>> lights,
                        std::span<const std::array<float, 3>> views, std::span<float> out) const {
  const auto at = state_->level_at(level, u, v);
  if (!at) return false;
  SamplersAt samplers{state_->fabric, *at, V2d(u, v)};
  return answer_all(lights, views, out,
                    [&](const V3f& light, const V3f& view) { return samplers.seen_from(view).pdf(light); });
}

std::optional<FabricFile> FabricFile::turned_over() const {
  const Fabric& front = state_->fabric;
  if (front.find_side(Side::back) == nullptr) return *this;
  try {
    auto state = std::make_shared<State>();
    state->set(selvedge::turned_over(front));
    return FabricFile(std::move(state));
  } catch (const std::exception&) {
    return {};
  }
}

std::vector<FabricProblem> check_fabric_file(const std::string& path) {
  std::vector<FabricProblem> problems;
  const auto issues = catch_exceptions(path, [&]() -> Result<Issues> { return check_fabric(path).issues; });
  if (!issues) return {problem_of(issues.error())};
  for (const Error& issue : *issues) problems.push_back(problem_of(issue));
  return problems;
}

}  // namespace selvedge
