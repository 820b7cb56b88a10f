#include "apps/selvedge/option_groups.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdint>

#include "format/base/option_text.h"

namespace selvedge {

std::vector<double> numbers(const std::string& option, const std::string& text, char separator,
                            std::size_t least, std::size_t most, const char* example) {
  const auto parsed = parse_numbers(text, separator, least, most);
  if (!parsed) throw CLI::ValidationError(option, fmt::format("\"{}\" is not of the form {}", text, example));
  return *parsed;
}

CLI::Option* add_text(CLI::App& app, const std::string& name, const std::string& form,
                      const std::string& help, std::function<void(const std::string&)> take) {
  return app
      .add_option_function<std::string>(
          name, [take = std::move(take)](const std::string& t) { take(t); }, help)
      ->type_name(form);
}

std::vector<int> whole_numbers(const std::string& option, const std::string& text, char separator,
                               std::size_t least, std::size_t most, const char* example) {
  std::vector<int> whole;
  for (const double n : numbers(option, text, separator, least, most, example)) {
    if (n != std::floor(n) || std::abs(n) > 1e9) {
      throw CLI::ValidationError(option, fmt::format("\"{}\" is not of the form {}", text, example));
    }
    whole.push_back(static_cast<int>(n));
  }
  return whole;
}

void add_common(CLI::App& app, CommonOptions& common, bool draws) {
  app.add_flag("--json", common.json, "The report as JSON on standard output");
  app.add_flag("--quiet", common.quiet, "No progress, no table");
  app.add_option("--threads", common.threads, "0: all cores; the bytes are the same for any number")
      ->check(CLI::Range(0, 1024));
  if (!draws) {
    app.add_option("--seed", common.seed, "Taken by every verb; this one draws no random numbers")
        ->type_name("N");
  }
}

CLI::Validator ends_in(std::vector<std::string> suffixes) {
  const std::string list = fmt::format("{}", fmt::join(suffixes, ", "));
  return {[suffixes = std::move(suffixes), list](const std::string& file) {
            for (const std::string& suffix : suffixes) {
              if (file.size() > suffix.size() && file.ends_with(suffix)) return std::string();
            }
            return fmt::format("\"{}\" ends in none of {}", file, list);
          },
          {}};
}

void take_settings(const std::vector<std::string>& texts, CellOptions& cell) {
  for (const std::string& text : texts) {
    const std::size_t before = cell.settings.size();
    if (!parse_setting(text, cell.settings))
      throw CLI::ValidationError("--set", fmt::format("\"{}\" is not of the form name=1.5", text));
    if (cell.settings.size() == before)
      throw CLI::ValidationError("--set", fmt::format("\"{}\" sets a parameter a second time", text));
  }
}

CLI::Validator seed_number() {
  return CLI::Validator(
      [](const std::string& text) {
        std::uint64_t number = 0;
        const char* end = text.data() + text.size();
        const auto [stop, error] = std::from_chars(text.data(), end, number);
        const bool good = error == std::errc() && stop == end;
        return good ? std::string() : fmt::format("\"{}\" is not a whole number from 0 to 2^64 - 1", text);
      },
      "");
}

CLI::Validator byte_count() {
  return CLI::Validator(
      [](std::string& text) {
        std::uint64_t number = 0;
        const char* end = text.data() + text.size();
        const auto [unit, error] = std::from_chars(text.data(), end, number);
        if (error == std::errc() && number > 0) {
          std::string size = std::to_string(number) + std::string(unit, end);
          try {
            if (CLI::AsSizeValue(false)(size).empty()) {
              text = size;
              return std::string();
            }
          } catch (const CLI::ValidationError&) {
            // An unknown unit, or too many bytes.
          }
        }
        return fmt::format("\"{}\" is not a number of bytes above 0, such as 60000 or 64K", text);
      },
      "");
}

void add_output(CLI::App& app, std::string& output, const char* what, bool required) {
  app.add_option("-o,--output", output, what)->required(required)->type_name("FILE");
}

void add_cell(CLI::App& app, std::string& input, CellOptions& cell) {
  app.add_option("input", input,
                 "A built-in stitch (selvedge stitch --list), a stitch description (.json), a weaving draft "
                 "(.wif), or "
                 "a mesh (.obj .ply .stl .off)")
      ->type_name("STITCH")
      ->required();
  app.add_option("--grid", cell.mesh.cells_across,
                 "Stitches: marching cubes along the longer period (as the yarns need)")
      ->type_name("N");
  app.add_option_function<std::vector<std::string>>(
         "--set", [&cell](const std::vector<std::string>& texts) { take_settings(texts, cell); },
         "Set a parameter of the stitch (selvedge stitch --list NAME); may be repeated")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  const char* group = "Meshes from files";
  MeshImportOptions& import = cell.import;
  add_text(app, "--period", "WxH", "Size of one repeat, mm, such as 5x4 (guessed)",
           [&import](const std::string& t) {
             const auto n = numbers("--period", t, 'x', 2, 2, "5x4");
             import.period = V2d(n[0], n[1]);
           })
      ->group(group);
  app.add_option("--unit", import.scale_to_mm, "Millimetres per unit of the file (guessed)")
      ->type_name("MM")
      ->group(group);
  add_text(app, "--up", "x|y|z", "The file's axis out of the cloth (guessed)",
           [&import](const std::string& t) {
             for (const UpAxis axis : {UpAxis::x, UpAxis::y, UpAxis::z}) {
               if (t == name_of(axis)) import.up_axis = axis;
             }
             if (t != "x" && t != "y" && t != "z") {
               throw CLI::ValidationError("--up", fmt::format("\"{}\" is none of x, y and z", t));
             }
           })
      ->group(group);
  add_text(app, "--albedo", "R,G,B", "Linear, where the file has no colours (0.5,0.5,0.5)",
           [&import](const std::string& t) {
             const auto n = numbers("--albedo", t, ',', 3, 3, "0.5,0.5,0.5");
             import.albedo = V3f(V3d(n[0], n[1], n[2]));
           })
      ->group(group);
}

void add_transport(CLI::App& app, BakeOptions& bake, const char* group) {
  add_text(app, "--bounces", "N|unlimited", "Indirect bounces of light (2)", [&bake](const std::string& t) {
    bake.bounces =
        t == "unlimited" ? unlimited_bounces : whole_numbers("--bounces", t, ',', 1, 1, "2 or unlimited")[0];
    if (t != "unlimited" && bake.bounces < 0) throw CLI::ValidationError("--bounces", "must not be negative");
  })->group(group);
  add_text(
      app, "--indirect", "cached|traced",
      "Indirect light once per point of the mesh, or along paths: slower, without approximation (cached)",
      [&bake](const std::string& t) {
        if (t != "cached" && t != "traced") {
          throw CLI::ValidationError("--indirect", fmt::format("\"{}\" is neither cached nor traced", t));
        }
        bake.indirect = t == "cached" ? IndirectLight::cached : IndirectLight::traced;
      })
      ->group(group);
  app.add_option("--ground", bake.ground, "Albedo of a plane that the cloth lies on; none: black")
      ->type_name("ALBEDO")
      ->group(group);
  add_text(app, "--reference-height", "top|mean|best|P%|MM",
           "Height of the texels' plane above the cell's lowest point (90% of the thickness)",
           [&bake](const std::string& t) {
             using Kind = ReferencePlane::Kind;
             if (t == "top" || t == "mean" || t == "best") {
               bake.reference = {t == "top" ? Kind::top : t == "mean" ? Kind::mean : Kind::best, 0};
               return;
             }
             const bool percent = t.ends_with('%');
             const double value = numbers("--reference-height", t.substr(0, t.size() - (percent ? 1 : 0)),
                                          ',', 1, 1, "best, 90% or 2.5")[0];
             bake.reference = {percent ? Kind::share : Kind::at, percent ? value / 100 : value};
           })
      ->group(group);
}

void add_bake(CLI::App& app, BakeOptions& bake, std::string& pairs_file) {
  const char* group = "Bake";
  add_text(app, "--texels", "N|WxH", fmt::format("Texels of one repeat ({}x{})", bake.width, bake.height),
           [&bake](const std::string& t) {
             const auto n = whole_numbers("--texels", t, 'x', 1, 2, "32 or 32x16");
             bake.width = n.front();
             bake.height = n.back();
           })
      ->group(group);
  const auto add = [&](const char* name, int& value, const char* help) {
    return app.add_option(name, value, help)->type_name("N")->capture_default_str()->group(group);
  };
  add("--views", bake.views, "View directions");
  add("--lights", bake.lights, "Light directions");
  auto* samples = add("--samples", bake.samples, "Rays per texel and view");
  auto* noise = app.add_option("--noise", bake.noise,
                               "As many samples as keep the samples' relative noise below this, such as 0.02")
                    ->type_name("X")
                    ->group(group)
                    ->excludes(samples);
  app.add_option("--time-budget", bake.time_budget, "As many samples as fit into so many seconds")
      ->type_name("S")
      ->group(group)
      ->excludes(samples)
      ->excludes(noise);
  add_transport(app, bake, group);
  auto* pairs = app.add_option("--pairs", pairs_file, "Pairs of directions from a file (JSON)")
                    ->type_name("FILE")
                    ->group(group);
  add("--validation-pairs", bake.validation_pairs, "Random pairs of directions to choose by")
      ->excludes(pairs);
  add("--held-out-pairs", bake.held_out_pairs, "Random pairs to judge by")->excludes(pairs);
  add("--rim-pairs", bake.rim_pairs, "Random pairs near the horizon, judged apart")->excludes(pairs);
  add("--slabs", bake.slabs, "Slabs of yarn whose heights are kept for a fit with a budget; 0: none");
  add("--cells", bake.cells, "Cells of the slabs along a side of a texel");
  add("--truth-samples", bake.truth_samples, "Rays per texel and pair, rounded down to even");
  app.add_option("--seed", bake.seed, "Same seed, same bytes")
      ->capture_default_str()
      ->check(seed_number())
      ->group(group);
}

void add_fit(CLI::App& app, MakeOptions& options, std::string& report) {
  const char* group = "Fit";
  app.add_option("--lobes", options.fit.lobes, "Lafortune lobes per texel")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(0, 16))
      ->group(group);
  app.add_flag_callback(
         "--no-table", [&options] { options.fit.view_table = false; }, "Leave the view table out")
      ->group(group);
  app.add_flag("--frames", options.fit.frames, "Fit normals and tangents too, rather than average them")
      ->group(group);
  app.add_flag("--light-table", options.fit.light_table, "A table over lights as well, fitted by turns")
      ->group(group);
  app.add_option("--starts", options.fit.starts, "Local minima looked at per texel and channel")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000))
      ->group(group);
  app.add_option("--iterations", options.fit.max_iterations, "At most so many steps of a search")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000))
      ->group(group);
  app.add_option("--tolerance", options.fit.tolerance, "Share of the cost below which a step counts as none")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  app.add_option("--damping", options.fit.table.damping,
                 "Pull of the table towards 1 where the lobes are dark")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  app.add_option("--smoothness", options.fit.table.smoothness,
                 "Pull of the table's neighbouring views towards each other")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  app.add_option(
         "--budget", options.budget,
         "Choose the layers of every level so that the file has at most so many bytes (K, M: KiB, MiB)")
      ->transform(byte_count())
      ->type_name("BYTES")
      ->group(group);
  app.add_option("--slab-lobes", options.fit.slab_lobes,
                 "With --budget: lobes of the slabs, tried beside slabs without; 0: none are tried")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(0, 16))
      ->group(group);
  app.add_flag("--glossy-slabs", options.fit.glossy_slabs,
               "With --budget: slabs with lobes at every level with cells enough, whatever they gain")
      ->group(group);
  app.add_option("--report", report,
                 "Errors, layers, bytes and convergence of every level: .json, or a table (.md, .txt)")
      ->check(ends_in({".json", ".md", ".txt"}))
      ->type_name("FILE")
      ->group(group);
  app.add_flag_callback(
         "--half-lobes", [&options] { options.write.half.insert(LayerKind::lobes); },
         "Lobes in 16 instead of 32 bits")
      ->group(group);
  app.add_flag_callback(
         "--float-tables", [&options] { options.write.half.erase(table_layers); },
         "Tables and frames in 32 instead of 16 bits")
      ->group(group);
}

}  // namespace selvedge
