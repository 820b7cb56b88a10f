#include "converter/bake/bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "converter/bake/journal.h"
#include "converter/bake/setup.h"
#include "converter/bake/slab_heights.h"
#include "converter/bake/texels.h"
#include "format/base/atomic_file.h"
#include "format/base/parallel.h"
#include "format/base/random.h"

namespace selvedge {
namespace {

// The seed's independent uses.
constexpr std::uint64_t stream_views = 1;
constexpr std::uint64_t stream_pairs = 2;
constexpr std::uint64_t stream_transport = 4;

/// Lights that are solved for at a time: more would not stay in the processor's caches.
constexpr std::size_t lights_at_once = 64;

std::uint64_t seed_of(const BakeOptions& o, std::uint64_t stream, std::uint64_t index) {
  return mix(mix(o.seed ^ mix(stream)) ^ mix(index));
}

std::uint64_t stream_of(PairKind kind) { return stream_pairs + 16 * (static_cast<std::uint64_t>(kind) + 1); }

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// A bake under way: the scene, the lights and what is computed once for all of them.
class Bake {
 public:
  /// `plane`: height of the texels, in units of the scene.
  Bake(const RayScene& scene, std::optional<LightTransport> transport, const BakeOptions& options,
       const SamplesHeader& header, double plane)
      : scene_(scene),
        options_(options),
        lights_(directions_of(header.lights)),
        views_(directions_of(header.views)),
        header_(header),
        transport_(std::move(transport)) {
    baker_.emplace(scene, transport_ ? &*transport_ : nullptr, options.bounces,
                   V2i(options.width, options.height), plane);
  }

  ViewSamples view(std::size_t index, int samples, NoiseSum& noise) {
    if (transport_ && indirect_.empty()) solve_for_views();
    return baker_->bake_view(views_[index], {lights_, indirect_}, samples,
                             seed_of(options_, stream_views, index), noise);
  }

  /// Pairs in any order; those of neighbouring indices are prepared together.
  PairSamples pair(PairKind kind, std::size_t index, int samples, NoiseSum& noise) {
    const auto& pairs = header_.pairs[static_cast<std::size_t>(kind)];
    const auto indirect = transport_ ? solved_for_pair(kind, index) : std::span<const float>();
    return baker_->bake_pair(pairs[index], {{&pairs[index].light, 1}, indirect, false}, samples,
                             seed_of(options_, stream_of(kind), index), noise);
  }

  /// Of the cell itself, whatever the light; `mm` per unit of the scene.
  HeightLayer heights(const SlabShape& shape, double mm) const {
    const HeightLayer of_scene = cell_heights(scene_, options_.width, options_.height, shape);
    const auto in_mm = [&](std::vector<float> heights) {
      for (float& height : heights) height *= static_cast<float>(mm);
      return heights;
    };
    return {shape, in_mm(of_scene.top()), in_mm(of_scene.bottom())};
  }

  /// What the grid's lights needed goes when the views are done.
  void end_views() { indirect_ = {}; }

  std::uint64_t rays() const { return baker_->rays() + (transport_ ? transport_->rays() : 0); }

 private:
  void solve_for_views() {
    const auto points = static_cast<std::size_t>(transport_->points());
    const std::size_t n = lights_.size();
    indirect_.resize(points * 3 * n);
    for (std::size_t first = 0; first < n; first += lights_at_once) {
      const auto some = std::span(lights_).subspan(first, std::min(lights_at_once, n - first));
      const std::vector<float> part = transport_->solve(scene_, some, options_.bounces);
      for (std::size_t row = 0; row < points * 3; ++row) {
        std::copy_n(&part[row * some.size()], some.size(), &indirect_[row * n + first]);
      }
    }
  }

  /// What reaches the points from the pair's light.
  std::span<const float> solved_for_pair(PairKind kind, std::size_t index) {
    const auto& pairs = header_.pairs[static_cast<std::size_t>(kind)];
    const std::size_t first = index / lights_at_once * lights_at_once;
    const std::size_t count = std::min(lights_at_once, pairs.size() - first);
    const auto points = static_cast<std::size_t>(transport_->points());
    if (solved_.empty() || solved_kind_ != kind || solved_first_ != first) {
      std::vector<V3f> lights;
      for (std::size_t p = first; p < first + count; ++p) lights.push_back(pairs[p].light);
      const std::vector<float> solved = transport_->solve(scene_, lights, options_.bounces);
      solved_.resize(solved.size());
      parallel_for(0, transport_->points(), [&](int point) {
        for (std::size_t i = static_cast<std::size_t>(point) * 3; i < static_cast<std::size_t>(point + 1) * 3;
             ++i) {
          for (std::size_t p = 0; p < count; ++p) solved_[p * points * 3 + i] = solved[i * count + p];
        }
      });
      solved_kind_ = kind;
      solved_first_ = first;
    }
    return std::span(solved_).subspan((index - first) * points * 3, points * 3);
  }

  const RayScene& scene_;
  const BakeOptions& options_;
  std::vector<V3f> lights_;
  std::vector<V3f> views_;
  const SamplesHeader& header_;
  std::optional<LightTransport> transport_;
  std::optional<TexelBaker> baker_;
  std::vector<float> indirect_;
  std::vector<float> solved_;  // pair by pair, from solved_first_ on
  PairKind solved_kind_ = PairKind::validation;
  std::size_t solved_first_ = 0;
};

/// The fewest samples that keep the noise of a few views below the target.
int samples_for_noise(Bake& bake, std::size_t views, double target) {
  constexpr std::size_t max_pilots = 8;
  constexpr int max_samples = 1 << 16;
  const std::size_t pilots = std::min(max_pilots, views);
  int samples = 2;
  for (; samples < max_samples; samples *= 2) {
    NoiseSum noise;
    for (std::size_t p = 0; p < pilots; ++p) bake.view((2 * p + 1) * views / (2 * pilots), samples, noise);
    if (noise.relative() <= target) break;
  }
  return samples;
}

/// Scales both counts of samples to the time that is left.
void scale_to_budget(Bake& bake, BakeOptions& o, const SamplesHeader& header,
                     std::chrono::steady_clock::time_point start) {
  constexpr int pilot_samples = 16;
  // Compressing and writing, per value; measured on one slow core.
  constexpr double seconds_per_value = 60e-9;
  NoiseSum ignored;
  const auto views = static_cast<std::size_t>(header.views.count());
  bake.view(views / 2, 1, ignored);  // what is computed once for all views is not the views' cost
  const auto before_view = std::chrono::steady_clock::now();
  bake.view(views / 2, pilot_samples, ignored);
  double seconds = seconds_since(before_view) / pilot_samples * o.samples * static_cast<double>(views);
  for (const PairKind kind : all_pair_kinds) {
    const auto& pairs = header.pairs[static_cast<std::size_t>(kind)];
    if (pairs.empty()) continue;
    bake.pair(kind, 0, 2, ignored);
    const auto before_pair = std::chrono::steady_clock::now();
    bake.pair(kind, 0, pilot_samples, ignored);
    seconds +=
        seconds_since(before_pair) / pilot_samples * o.truth_samples * static_cast<double>(pairs.size());
  }
  const double values = 3.0 * header.texels() * header.views.count() * header.lights.count();
  const double left = *o.time_budget * 0.95 - seconds_since(start) - values * seconds_per_value;
  const double scale = std::max(0.0, left / seconds);
  const auto scaled = [&](int count, int least) {
    return static_cast<int>(std::clamp(std::floor(count * scale), static_cast<double>(least), 65536.0));
  };
  o.samples = scaled(o.samples, 1);
  o.truth_samples = scaled(o.truth_samples, 2) / 2 * 2;
}

Result<BakeReport> assemble(std::span<BakeJournal> journals, const std::string& output) {
  SamplesHeader header = journals.front().header();
  const std::vector<BakeUnit> units = units_of(header);
  std::vector<BakeJournal*> holder(units.size(), nullptr);
  NoiseSum noise;
  NoiseSum truth_noise;
  for (std::size_t u = 0; u < units.size(); ++u) {
    for (BakeJournal& journal : journals) {
      if (journal.has(u)) holder[u] = &journal;
    }
    if (holder[u] == nullptr) {
      return fail(Code::samples_malformed, journals.front().path(), "journal",
                  fmt::format("unit {} of {} is in none of the shards", u, units.size()));
    }
    (units[u].is_view() ? noise : truth_noise) += holder[u]->noise(u);
  }
  nlohmann::json provenance = nlohmann::json::parse(header.provenance);
  provenance["bake"]["noise"] = {{"samples", noise.relative()}, {"truth", truth_noise.relative()}};
  header.provenance = provenance.dump();

  auto writer = SamplesWriter::create(output, header);
  if (!writer) return tl::unexpected(writer.error());
  BakeReport report;
  for (std::size_t u = 0; u < units.size(); ++u) {
    if (units[u].what == BakeUnit::What::heights) {
      const auto heights = holder[u]->read_heights(u);
      if (!heights) return tl::unexpected(heights.error());
      if (auto ok = writer->write_heights(*heights); !ok) return tl::unexpected(ok.error());
      continue;
    }
    if (units[u].is_view()) {
      const auto samples = holder[u]->read_view(u);
      if (!samples) return tl::unexpected(samples.error());
      for (const float alpha : samples->alpha) report.coverage += static_cast<double>(alpha);
      if (auto ok = writer->write_view(*samples); !ok) return tl::unexpected(ok.error());
      continue;
    }
    const auto& pairs = header.pairs[static_cast<std::size_t>(units[u].kind)];
    const auto samples = holder[u]->read_pair(u, pairs[units[u].index]);
    if (!samples) return tl::unexpected(samples.error());
    if (auto ok = writer->write_pairs(units[u].kind, *samples); !ok) return tl::unexpected(ok.error());
  }
  if (auto ok = writer->commit(); !ok) return tl::unexpected(ok.error());
  for (const Error& warning : writer->warnings()) report.remarks.push_back(to_line(warning));
  report.coverage /= static_cast<double>(header.views.count()) * header.texels();
  report.noise = noise.relative();
  report.truth_noise = truth_noise.relative();
  report.samples = header.samples_per_texel;
  report.truth_samples = header.truth_samples;
  report.reference_height = static_cast<double>(header.reference_height);
  return report;
}

/// Bakes the shard's units that `journal_path` does not have yet.
Result<BakeJournal> bake_units(const CellMesh& mesh, const std::string& name, BakeOptions o,
                               const std::string& provenance, const BakeShard& shard,
                               const std::string& journal_path, const BakeWatcher& watcher,
                               BakeReport& report) {
  const auto start = std::chrono::steady_clock::now();
  if (auto ok = check_options(o, name); !ok) return tl::unexpected(ok.error());
  if (auto ok = validate(mesh, name); !ok) return tl::unexpected(ok.error());
  const ScaledMesh scaled = scaled_to_unit(mesh);
  const auto ground = o.ground ? std::optional(static_cast<float>(*o.ground)) : std::nullopt;
  const auto scene = RayScene::create(scaled.mesh, name, ground);
  if (!scene) return tl::unexpected(scene.error());
  const auto plane = plane_of(mesh, *scene, name, o, scaled.mm);
  if (!plane) return tl::unexpected(plane.error());
  const double thickness = static_cast<double>(scene->bounds().max.z) * scaled.mm;

  std::optional<LightTransport> transport;
  if (o.indirect == IndirectLight::cached) {
    transport = LightTransport::build(*scene, seed_of(o, stream_transport, 0));
    if (!transport) {
      o.indirect = IndirectLight::traced;
      report.remarks.push_back(
          fmt::format("the mesh needs more than {} points for cached indirect light: paths are traced, which "
                      "takes longer and is noisier",
                      max_transport_points));
    }
  }
  report.indirect = o.indirect;
  SamplesHeader header = header_of(mesh, o, *plane, thickness, provenance);
  Bake bake(*scene, std::move(transport), o, header, *plane / scaled.mm);
  if (o.noise || o.time_budget) {
    // What a journal of the same bake was begun with counts, however fast the machine is now.
    const auto begun = BakeJournal::read_header(journal_path);
    if (begun) {
      o.samples = begun->samples_per_texel;
      o.truth_samples = begun->truth_samples;
    }
    if (!begun || text_of(header_of(mesh, o, *plane, thickness, provenance)) != text_of(*begun)) {
      if (o.noise) o.samples = samples_for_noise(bake, static_cast<std::size_t>(o.views), *o.noise);
      if (o.time_budget) scale_to_budget(bake, o, header, start);
    }
    header = header_of(mesh, o, *plane, thickness, provenance);
  }
  auto journal = BakeJournal::open(journal_path, header, shard, o.resumable);
  if (!journal) return journal;

  const std::vector<BakeUnit> units = units_of(header);
  // In rays of one light: what the bar of progress goes by.
  const auto cost = [&](const BakeUnit& unit) {
    if (unit.what == BakeUnit::What::heights) return 1.0;
    return unit.is_view() ? static_cast<double>(o.lights) * o.samples : static_cast<double>(o.truth_samples);
  };
  double total = 0;
  double done = 0;
  NoiseSum noise;
  for (std::size_t u = 0; u < units.size(); ++u) {
    if (static_cast<int>(u % static_cast<std::size_t>(shard.count)) != shard.index) continue;
    total += cost(units[u]);
    if (journal->has(u)) done += cost(units[u]);
  }
  for (std::size_t u = 0; u < units.size(); ++u) {
    if (static_cast<int>(u % static_cast<std::size_t>(shard.count)) != shard.index) continue;
    if (journal->has(u)) {
      ++report.resumed;
      if (units[u].is_view()) noise += journal->noise(u);
      continue;
    }
    if (!units[u].is_view()) bake.end_views();
    NoiseSum own;
    const auto bake_unit = [&](const BakeUnit& unit) -> Result<void> {
      switch (unit.what) {
        case BakeUnit::What::view:
          return journal->append(u, bake.view(unit.index, o.samples, own), own);
        case BakeUnit::What::pair:
          return journal->append(u, bake.pair(unit.kind, unit.index, header.truth_samples, own), own);
        case BakeUnit::What::heights:
          break;
      }
      return journal->append(u, bake.heights(*header.slabs, scaled.mm));
    };
    const auto added = bake_unit(units[u]);
    if (!added) return tl::unexpected(added.error());
    ++report.units;
    if (units[u].is_view()) noise += own;
    done += cost(units[u]);
    if (watcher) {
      watcher({done / total, static_cast<double>(bake.rays()) / seconds_since(start), noise.relative()});
    }
  }
  report.rays = bake.rays();
  report.seconds = seconds_since(start);
  report.noise = noise.relative();
  report.samples = header.samples_per_texel;
  report.truth_samples = header.truth_samples;
  report.reference_height = *plane;
  return journal;
}

std::string journal_of(const std::string& output) { return output + ".journal"; }

}  // namespace

Result<BakeReport> bake(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                        const std::string& provenance, const std::string& output,
                        const BakeWatcher& watcher) {
  const auto start = std::chrono::steady_clock::now();
  // Said before the work, not after it.
  if (const auto writable = AtomicFile::create(output); !writable) return tl::unexpected(writable.error());
  BakeReport run;
  auto journal = bake_units(mesh, name, options, provenance, {}, journal_of(output), watcher, run);
  if (!journal) return tl::unexpected(journal.error());
  auto report = assemble({&*journal, 1}, output);
  if (!report) return report;
  journal->remove();
  report->rays = run.rays;
  report->units = run.units;
  report->resumed = run.resumed;
  report->indirect = run.indirect;
  report->remarks = run.remarks;
  report->seconds = seconds_since(start);
  return report;
}

Result<BakeReport> bake_shard(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                              const std::string& provenance, const BakeShard& shard,
                              const std::string& output, const BakeWatcher& watcher) {
  if (shard.count < 1 || shard.index < 0 || shard.index >= shard.count) {
    return fail(Code::option_out_of_range, name, "shard",
                fmt::format("{}/{} is not one of its parts", shard.index, shard.count));
  }
  if (options.time_budget) {
    return fail(Code::option_out_of_range, name, "time-budget", "shards would differ in their samples");
  }
  if (const auto writable = AtomicFile::create(output); !writable) return tl::unexpected(writable.error());
  BakeReport report;
  auto journal = bake_units(mesh, name, options, provenance, shard, journal_of(output), watcher, report);
  if (!journal) return tl::unexpected(journal.error());
  if (auto ok = journal->rename(output); !ok) return tl::unexpected(ok.error());
  return report;
}

Result<BakeReport> merge_shards(std::span<const std::string> shards, const std::string& output) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<BakeJournal> journals;
  for (const std::string& path : shards) {
    auto journal = BakeJournal::read(path);
    if (!journal) return tl::unexpected(journal.error());
    if (!journals.empty() && text_of(journal->header()) != text_of(journals.front().header())) {
      return fail(Code::samples_malformed, path, "journal",
                  fmt::format("is of another bake than {}", journals.front().path()));
    }
    journals.push_back(std::move(*journal));
  }
  if (journals.empty()) return fail(Code::file_missing, {}, {}, "no shards are given");
  auto report = assemble(journals, output);
  if (report) report->seconds = seconds_since(start);
  return report;
}

}  // namespace selvedge
