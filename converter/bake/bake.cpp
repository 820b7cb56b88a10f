#include "converter/bake/bake.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "converter/bake/journal.h"
#include "converter/bake/setup.h"
#include "converter/bake/unit_baker.h"
#include "converter/mesh/find_yarns.h"
#include "format/base/atomic_file.h"

namespace selvedge {
namespace {

/// Stream of random numbers; unit_baker.cpp has the others.
constexpr std::uint64_t stream_cache = 4;

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Writes the units of all journals of one bake into the samples file and adds their figures to the report.
Result<void> assemble(std::span<BakeJournal> journals, const std::string& output, BakeReport& report) {
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
    (units[u].kind == BakeUnit::Kind::view ? noise : truth_noise) += holder[u]->noise(u);
  }
  nlohmann::json provenance = nlohmann::json::parse(header.provenance);
  provenance["bake"]["noise"] = {{"samples", noise.relative()}, {"truth", truth_noise.relative()}};
  header.provenance = provenance.dump();

  auto writer = SamplesWriter::create(output, header);
  if (!writer) return tl::unexpected(writer.error());
  for (std::size_t u = 0; u < units.size(); ++u) {
    UnitSamples samples = blank_samples(header, units[u]);
    if (auto ok = holder[u]->read(u, planes_of(samples)); !ok) return ok;
    if (auto ok = write_unit(*writer, header, units[u], samples); !ok) {
      if (ok.error().file.empty()) ok.error().file = holder[u]->path();
      return ok;
    }
    if (const auto* view = std::get_if<ViewSamples>(&samples)) {
      for (const float alpha : view->alpha) report.coverage += static_cast<double>(alpha);
    }
  }
  if (auto ok = writer->commit(); !ok) return ok;
  for (const Error& warning : writer->warnings()) report.remarks.push_back(to_line(warning));
  report.coverage /= static_cast<double>(header.view_count()) * header.texels();
  report.noise = noise.relative();
  report.truth_noise = truth_noise.relative();
  report.samples = header.samples_per_texel;
  report.truth_samples = header.truth_samples;
  report.reference_height = static_cast<double>(header.reference_height);
  return {};
}

/// Bakes the units of the shard that are not in its journal.
Result<void> bake_missing(UnitBaker& baker, BakeJournal& journal, const BakeShard& shard,
                          Clock::time_point start, const BakeWatcher& watcher, BakeReport& report) {
  const SamplesHeader& header = journal.header();
  const std::vector<BakeUnit> units = units_of(header);
  const auto samples_of = [&](const BakeUnit& unit) {
    return unit.kind == BakeUnit::Kind::view ? header.samples_per_texel : header.truth_samples;
  };
  // Work is measured in rays times lights.
  const auto cost = [&](const BakeUnit& unit) {
    if (unit.kind == BakeUnit::Kind::yarns) return 1.0;
    return samples_of(unit) * (unit.kind == BakeUnit::Kind::view ? 1.0 * header.light_count() : 1.0);
  };
  double total = 0;
  for (std::size_t u = shard.index; u < units.size(); u += shard.count) total += cost(units[u]);
  double done = 0;
  NoiseSum noise;
  for (std::size_t u = shard.index; u < units.size(); u += shard.count) {
    const bool resumed = journal.has(u);
    if (!resumed) {
      NoiseSum unit_noise;
      UnitSamples samples = baker.bake(units[u], samples_of(units[u]), unit_noise);
      if (auto ok = journal.write(u, planes_of(samples), unit_noise); !ok) return ok;
    }
    ++(resumed ? report.resumed : report.units);
    if (units[u].kind == BakeUnit::Kind::view) noise += journal.noise(u);
    done += cost(units[u]);
    if (watcher && !resumed) {
      watcher({done / total, static_cast<double>(baker.rays()) / seconds_since(start), noise.relative()});
    }
  }
  report.noise = noise.relative();
  return {};
}

/// The yarns to store: those of the mesh, or else those that its surface shows. Heights are the mesh's;
/// a mesh whose surface is not almost all yarn gets none, since close by nothing else is seen.
/// Precondition: validate(mesh) holds.
YarnData stored_yarns(const CellMesh& mesh, BakeReport& report) {
  constexpr double min_share = 0.9;
  constexpr double share_without_remark = 0.99;
  if (!mesh.yarns.curves.empty()) return mesh.yarns;
  FoundYarns found = find_yarns(mesh);
  YarnData lit = found.yarns;
  lit.light.resize(std::size_t{light_values_per_station} * counts_of(lit).stations);
  const bool stored = found.share >= min_share && validate(lit, V2f(mesh.period)).has_value();
  if (!stored || found.share < share_without_remark) {
    report.remarks.push_back(fmt::format("{:.0f} % of the surface is not round yarn: {}",
                                         100 * (1 - found.share),
                                         stored ? "it is missing close by" : "no yarns are stored"));
  }
  return stored ? std::move(found.yarns) : YarnData();
}

/// A journal at `journal_path` with all units of the shard.
Result<BakeJournal> bake_units(const CellMesh& given, const std::string& name, BakeOptions o,
                               const std::string& provenance, const BakeShard& shard,
                               const std::string& journal_path, const BakeWatcher& watcher,
                               BakeReport& report) {
  const auto start = Clock::now();
  if (auto ok = check_options(o, name); !ok) return tl::unexpected(ok.error());
  const auto cell = trace_cell(given, name, o.ground);
  if (!cell) return tl::unexpected(cell.error());
  CellMesh mesh = given;
  if (o.yarns) mesh.yarns = stored_yarns(given, report);
  const auto plane = plane_of(mesh, *cell, name, o);
  if (!plane) return tl::unexpected(plane.error());

  std::optional<IrradianceCache> cache;
  if (o.indirect == IndirectLight::cached) {
    cache = IrradianceCache::build(cell->scene, seed_of(o.seed, stream_cache, 0), o.both_sides);
    if (!cache) {
      o.indirect = IndirectLight::traced;
      report.remarks.push_back(
          fmt::format("the mesh needs more than {} points for cached indirect light: paths are traced, which "
                      "takes longer and is noisier",
                      max_cache_points));
    }
  }
  const SamplesHeader header = samples_header(mesh, o, *plane, cell->thickness_mm(), provenance);
  YarnData yarns = mesh.yarns;
  const float lowest = bounds_of(mesh).min.z;
  for (V3f& node : yarns.nodes) node.z -= lowest;
  UnitBaker baker(*cell, yarns, std::move(cache), o, header, *plane);
  auto journal = BakeJournal::open(journal_path, header, shard, o.resumable);
  if (!journal) return journal;
  if (auto ok = bake_missing(baker, *journal, shard, start, watcher, report); !ok) {
    return tl::unexpected(ok.error());
  }
  report.rays = baker.rays();
  report.seconds = seconds_since(start);
  report.samples = journal->header().samples_per_texel;
  report.truth_samples = journal->header().truth_samples;
  report.reference_height = *plane;
  report.indirect = o.indirect;
  return journal;
}

/// The place of the journal. What a link there leads to is not of whoever names the output: it is refused.
Result<std::string> journal_of(const std::string& output) {
  std::string path = output + ".journal";
  std::error_code none;
  if (std::filesystem::is_symlink(path, none))
    return fail(Code::file_unwritable, path, {}, "is a link, where the journal of the bake belongs");
  return path;
}

}  // namespace

Result<BakeReport> bake(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                        const std::string& provenance, const std::string& output,
                        const BakeWatcher& watcher) {
  const auto start = Clock::now();
  // Report an unwritable output before the work, not after it.
  if (const auto writable = AtomicFile::create(output); !writable) return tl::unexpected(writable.error());
  const auto journal_path = journal_of(output);
  if (!journal_path) return tl::unexpected(journal_path.error());
  BakeReport report;
  auto journal = bake_units(mesh, name, options, provenance, {}, *journal_path, watcher, report);
  if (!journal) return tl::unexpected(journal.error());
  if (auto ok = assemble({&*journal, 1}, output, report); !ok) return tl::unexpected(ok.error());
  journal->remove();
  report.seconds = seconds_since(start);
  return report;
}

Result<BakeReport> bake_shard(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                              const std::string& provenance, const BakeShard& shard,
                              const std::string& output, const BakeWatcher& watcher) {
  if (shard.count < 1 || shard.index < 0 || shard.index >= shard.count) {
    return fail(Code::option_out_of_range, name, "shard",
                fmt::format("{}/{} is not one of its parts", shard.index, shard.count));
  }
  if (const auto writable = AtomicFile::create(output); !writable) return tl::unexpected(writable.error());
  const auto journal_path = journal_of(output);
  if (!journal_path) return tl::unexpected(journal_path.error());
  BakeReport report;
  // A finished part is read as a journal to go on from: a task that is run again repeats no units.
  std::error_code none;
  if (!std::filesystem::exists(*journal_path, none) && BakeJournal::read(output))
    std::filesystem::copy_file(output, *journal_path, none);
  auto journal = bake_units(mesh, name, options, provenance, shard, *journal_path, watcher, report);
  if (!journal) return tl::unexpected(journal.error());
  if (auto ok = journal->rename(output); !ok) return tl::unexpected(ok.error());
  return report;
}

Result<BakeReport> merge_shards(std::span<const std::string> shards, const std::string& output) {
  const auto start = Clock::now();
  std::vector<BakeJournal> journals;
  for (const std::string& path : shards) {
    auto journal = BakeJournal::read(path);
    if (!journal) return tl::unexpected(journal.error());
    if (!journals.empty() &&
        samples_header_to_json(journal->header()) != samples_header_to_json(journals.front().header())) {
      return fail(Code::samples_malformed, path, "journal",
                  fmt::format("is of another bake than {}", journals.front().path()));
    }
    journals.push_back(std::move(*journal));
  }
  if (journals.empty()) return fail(Code::file_missing, {}, {}, "no shards are given");
  BakeReport report;
  if (auto ok = assemble(journals, output, report); !ok) return tl::unexpected(ok.error());
  report.seconds = seconds_since(start);
  return report;
}

}  // namespace selvedge
