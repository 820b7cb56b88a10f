#include "apps/npm/yarn_memory.h"

#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

#include "format/base/digest.h"
#include "format/web/host.h"

namespace selvedge {

/// Writes the shape of this key (key_of()) to host_input(), if there is one; whether there is.
SELVEDGE_HOST(recall) bool host_recall(const char* key);
/// Takes the shape of a key.
SELVEDGE_HOST(keep) void host_keep(const char* key, const char* bytes, std::size_t count);

namespace {

/// Numbers one after the other, which are written, or read again.
class Numbers {
 public:
  Numbers() = default;
  explicit Numbers(std::string_view bytes) : all_(bytes.size() / sizeof(double)), reads_(true) {
    std::memcpy(all_.data(), bytes.data(), bytes.size());
  }
  void pass(auto&... values) { (one(values), ...); }
  void pass_all(auto& list) {
    std::size_t count = list.size();
    pass(count);
    list.resize(count);
    auto* const first = reinterpret_cast<double*>(list.data());
    for (std::size_t i = 0; i < count * sizeof list[0] / sizeof(double); ++i) pass(first[i]);
  }
  std::string bytes() const {
    return {reinterpret_cast<const char*>(all_.data()), all_.size() * sizeof(double)};
  }

 private:
  void one(auto& value) {
    if (reads_)
      value = static_cast<std::remove_reference_t<decltype(value)>>(all_[at_++]);
    else
      all_.push_back(static_cast<double>(value));
  }
  std::vector<double> all_;
  std::size_t at_ = 0;
  bool reads_ = false;
};

/// Passes what knits have in common that differ in some stitches.
void pass_common(RelaxOptions& o, StitchPattern& pattern, Numbers& all) {
  all.pass(o.bending_length_radii, o.gap_radii, o.start_fraction, o.max_thickness_radii, o.in_plane_restoring,
           o.may_thin, o.steps, o.is_rough, pattern.period_mm.x, pattern.period_mm.y);
  all.pass(o.gauge_mm.x, o.gauge_mm.y, o.blocked_mm.x, o.blocked_mm.y);
}

/// Digest of all that relax() reads.
std::string key_of(StitchPattern pattern, RelaxOptions o) {
  Numbers all;
  pass_common(o, pattern, all);
  for (auto& parts : o.parts)
    for (KnitPart& part : parts) all.pass(part.is_loop, part.length_mm, part.segments);
  for (Yarn& yarn : pattern.yarns) {
    bool soft = yarn.fibre_kind != 0;
    all.pass(yarn.radius_mm, yarn.flattening, soft);
    all.pass_all(yarn.segments);
  }
  return digest_of(all.bytes());
}

/// Passes all that relax() changes.
void pass(RelaxResult& relaxed, Numbers& all) {
  all.pass(relaxed.radius_fraction, relaxed.has_settled, relaxed.pattern.period_mm.x,
           relaxed.pattern.period_mm.y, relaxed.free_mm.x, relaxed.free_mm.y, relaxed.stretch, relaxed.steps,
           relaxed.residual);
  for (Yarn& yarn : relaxed.pattern.yarns) {
    all.pass(yarn.radius_mm, yarn.flattening);
    all.pass_all(yarn.segments);
    all.pass_all(yarn.squeezes);
  }
}

void pass(RestedKnit& knit, Numbers& all) {
  std::size_t count = knit.parts.size();
  all.pass(count, knit.drawn.period_mm.x, knit.drawn.period_mm.y);
  knit.drawn.yarns.resize(count);
  knit.relaxed.pattern.yarns.resize(count);
  for (Yarn& yarn : knit.drawn.yarns) {
    all.pass(yarn.flattening);
    all.pass_all(yarn.segments);
  }
  for (auto* parts : {&knit.parts, &knit.relaxed.parts}) {
    parts->resize(count);
    for (auto& chain : *parts) {
      std::size_t of_chain = chain.size();
      all.pass(of_chain);
      chain.resize(of_chain);
      for (KnitPart& part : chain) all.pass(part.is_loop, part.length_mm, part.segments);
    }
  }
  pass(knit.relaxed, all);
}

/// relax(); of many stitches and roughly from the last knit of the same kind, if there is one, which this is
/// then.
RelaxResult relax_from_last(const StitchPattern& pattern, RelaxOptions options) {
  constexpr std::size_t many_stitches = 100;
  std::size_t stitches = 0;
  for (const auto& parts : options.parts) stitches += parts.size();
  if (stitches < many_stitches) return relax(pattern, options);
  RelaxOptions fine = options;
  fine.is_rough = false;
  StitchPattern common = pattern;
  Numbers kind;
  pass_common(fine, common, kind);
  const std::string key = digest_of(kind.bytes());
  RestedKnit last;
  if (options.is_rough && host_recall(key.data())) {
    Numbers all(host_input());
    pass(last, all);
    options.last = &last;
  }
  RelaxResult relaxed = relax(pattern, options);
  if (options.is_rough && !relaxed.is_edit) return relaxed;
  RestedKnit next{pattern, options.parts, relaxed};
  Numbers all;
  pass(next, all);
  const std::string bytes = all.bytes();
  host_keep(key.data(), bytes.data(), bytes.size());
  return relaxed;
}

}  // namespace

RelaxResult relaxed_once(const StitchPattern& pattern, const RelaxOptions& options) {
  const std::string key = key_of(pattern, options);
  if (host_recall(key.data())) {
    RelaxResult relaxed{pattern};
    Numbers all(host_input());
    pass(relaxed, all);
    return relaxed;
  }
  RelaxResult relaxed = relax_from_last(pattern, options);
  Numbers all;
  pass(relaxed, all);
  const std::string bytes = all.bytes();
  host_keep(key.data(), bytes.data(), bytes.size());
  return relaxed;
}

RelaxResult relaxed_roughly(const StitchPattern& pattern, const RelaxOptions& given) {
  RelaxOptions options = given;
  if (options.is_rough || host_recall(key_of(pattern, options).data())) return relaxed_once(pattern, options);
  options.is_rough = true;
  RelaxResult relaxed = relaxed_once(pattern, options);
  relaxed.radius_fraction = 1;
  relaxed.has_settled = true;
  relaxed.stretch = 0;
  relaxed.residual = 0;
  return relaxed;
}

}  // namespace selvedge
