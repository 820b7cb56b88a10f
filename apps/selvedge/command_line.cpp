#include "apps/selvedge/command_line.h"

#include <fmt/format.h>

#include <array>
#include <sstream>

#include "apps/selvedge/make_choice.h"
#include "apps/selvedge/option_groups.h"
#include "apps/selvedge/plan_options.h"
#include "apps/selvedge/slab_options.h"
#include "converter/presets/presets.h"

namespace selvedge {
namespace {

CLI::App* add_verb(CLI::App& app, const char* name, const char* what, const char* example) {
  CLI::App* verb = app.add_subcommand(name, what);
  verb->footer(fmt::format(
      "Example:\n  {}\n\nExit status: 0 good, 1 the input is bad or a check failed, 2 usage.", example));
  return verb;
}

/// All verbs with room for what they are told.
struct Verbs {
  StitchCommand stitch;
  BakeCommand bake;
  MergeCommand merge;
  FitCommand fit;
  MakeCommand make;
  DressCommand dress;
  ReattachCommand reattach;
  CheckCommand check;
  InfoCommand info;
  EvaluateCommand evaluate;
  AnswerCommand answer;
  RepackCommand repack;
  CompareCommand compare;
  SwatchCommand swatch;
  TradeCommand trade;
  PlanCommand plan;
};

void add_stitch_verb(CLI::App& app, StitchCommand& command) {
  CLI::App* verb = add_verb(app, "stitch", "Mesh one cell of a stitch, or tell what it is made of",
                            "selvedge stitch plain-knit -o plain-knit.ply");
  add_common(*verb, command.common);
  add_cell(*verb, command.input, command.cell);
  verb->get_option("input")->required(false);
  verb->add_flag("--list", command.list, "The built-in stitches, or the parameters of one");
  verb->add_flag("--show", command.show, "The stitch description (JSON) on standard output");
  add_output(*verb, command.output, "The cell's mesh (.obj .ply), or the stitch description (.json)", false);
}

void add_bake_verb(CLI::App& app, BakeCommand& command) {
  CLI::App* verb = add_verb(app, "bake", "Light a cell from all sides: stitch -> samples",
                            "selvedge bake plain-knit -o k.samples.exr");
  add_common(*verb, command.common, true);
  add_cell(*verb, command.input, command.cell);
  add_bake(*verb, command.bake, command.pairs);
  add_text(*verb, "--shard", "I/N", "Bake part I (from 0) of N, for selvedge merge",
           [&command](const std::string& t) {
             const auto n = whole_numbers("--shard", t, '/', 2, 2, "0/8");
             command.shard = BakeShard{n[0], n[1]};
           })
      ->group("Bake");
  add_output(*verb, command.output, "The samples file, or with --shard the part");
}

void add_merge_verb(CLI::App& app, MergeCommand& command) {
  CLI::App* verb = add_verb(app, "merge", "Join the parts of a bake: shards -> samples",
                            "selvedge merge k.0.shard k.1.shard -o k.samples.exr");
  add_common(*verb, command.common);
  verb->add_option("shards", command.shards, "What bake --shard wrote, in any order")
      ->required()
      ->type_name("SHARD...");
  add_output(*verb, command.output, "The samples file");
}

void add_fit_verb(CLI::App& app, FitCommand& command) {
  CLI::App* verb = add_verb(app, "fit", "Fit a fabric to samples: samples -> fabric",
                            "selvedge fit k.samples.exr -o k.fabric.exr");
  add_common(*verb, command.common);
  verb->add_option("samples", command.input, "The samples file")->required()->type_name("FILE");
  add_fit(*verb, command.options, command.report);
  add_output(*verb, command.output, "The fabric file");
}

void add_make_verb(CLI::App& app, MakeCommand& command) {
  CLI::App* verb = add_verb(app, "make", "Stitch, bake and fit in one: stitch -> fabric",
                            "selvedge make plain-weave -o weave.fabric.exr");
  add_common(*verb, command.common, true);
  add_cell(*verb, command.input, command.cell);
  add_bake(*verb, command.options.bake, command.pairs);
  add_fit(*verb, command.options, command.report);
  auto* plan =
      verb->add_option("--for", command.plan,
                       "Make no more than this plan needs (selvedge plan): coarser texels, fewer levels")
          ->type_name("PLAN");
  verb->add_option("--material", command.materials,
                   "Of the plan: name of a material, or #index; may be repeated (default: all of them)")
      ->type_name("NAME")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->needs(plan);
  verb->add_option("--keep-samples", command.samples, "Keep the samples in this file")->type_name("FILE");
  add_output(*verb, command.output, "The fabric file");
  add_choice(*verb, command);
}

void add_dress_verb(CLI::App& app, DressCommand& command) {
  CLI::App* verb = add_verb(app, "dress", "Put a fabric on materials of a glTF garment",
                            "selvedge dress shirt.glb k.fabric.exr -o dressed.glb --material Cotton");
  add_common(*verb, command.common);
  verb->add_option("garment", command.garment, "A glTF file (.gltf .glb)")->required()->type_name("FILE");
  verb->add_option("fabric", command.fabric, "The fabric file")->required()->type_name("FILE");
  add_output(*verb, command.output, "The dressed garment (.gltf .glb)");
  verb->add_option("--material", command.dress.materials, "Name of a material, or #index; may be repeated")
      ->type_name("NAME")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_flag("--all", command.dress.all, "Every material");
  add_text(*verb, "--repeats", "U,V",
           "Repeats per unit of the texture coordinates, instead of the physical size",
           [&command](const std::string& t) {
             const auto n = numbers("--repeats", t, ',', 2, 2, "100,120");
             command.dress.repeats = V2d(n[0], n[1]);
           });
  verb->add_option("--texcoord", command.dress.tex_coord, "Set of texture coordinates")
      ->check(CLI::Range(0, 1))
      ->capture_default_str();
  auto* embed = verb->add_flag_callback(
      "--embed", [&command] { command.dress.embed = true; },
      "The fabric inside of the glTF (default for .glb)");
  verb->add_flag_callback(
          "--external", [&command] { command.dress.embed = false; },
          "The fabric beside the glTF (default for .gltf)")
      ->excludes(embed);
  verb->add_flag_callback(
      "--no-fallback", [&command] { command.dress.fallback = false; }, "Leave the core material alone");
  verb->add_option("--usda", command.dress.usd,
                   "Also this USD layer (.usda): the garment, its fallback, and the fabric's name")
      ->type_name("FILE");
}

/// Where a swatch is seen from, how large the picture is, and its lights.
void add_shot(CLI::App& app, SwatchCommand& command) {
  add_text(app, "--view", "NAME", "near, middle, far or grazing (near)", [&command](const std::string& t) {
    const auto view = swatch_view_named(t);
    if (!view)
      throw CLI::ValidationError("--view", fmt::format("\"{}\" is none of near, middle, far, grazing", t));
    command.view = *view;
  });
  add_text(app, "--size", "WxH", "Of the picture, in pixels (320x240)", [&command](const std::string& t) {
    const auto n = whole_numbers("--size", t, 'x', 2, 2, "320x240");
    if (n[0] < 1 || n[1] < 1 || n[0] > 8192 || n[1] > 8192 || n[0] > 4 * n[1])
      throw CLI::ValidationError("--size", "must lie in 1 to 8192, at most four times as wide as high");
    command.size = V2i(n[0], n[1]);
  });
  app.add_option_function<std::vector<std::string>>(
         "--light",
         [&command](const std::vector<std::string>& texts) {
           for (const std::string& text : texts) {
             const auto n = numbers("--light", text, ',', 3, 4, "0,0.6,0.8 or 0,0.6,0.8,2");
             Light light;
             light.direction = V3d(n[0], n[1], n[2]);
             const double intensity = n.size() > 3 ? n[3] : 1;
             if (!(light.direction.length() > 0) || !(intensity >= 0 && intensity <= max_intensity))
               throw CLI::ValidationError("--light", "has no direction or no intensity in 0 to 1e12");
             light.direction.normalize();
             light.irradiance = V3f(static_cast<float>(intensity));
             command.lights.push_back(light);
           }
         },
         "Direction to a light in the cloth's frame, and its intensity; may be repeated (a key light of 1 "
         "and "
         "a fill light of 0.3)")
      ->type_name("X,Y,Z[,I]")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_swatch_verb(CLI::App& app, SwatchCommand& command, BakeOptions& transport) {
  CLI::App* verb =
      add_verb(app, "swatch", "Draw a flat swatch: of a fabric, or with --truth of the stitch itself",
               "selvedge swatch --truth plain-knit --view middle -o truth.exr");
  add_common(*verb, command.common, true);
  add_cell(*verb, command.input, command.cell);
  verb->get_option("input")->description("A fabric file; with --truth a stitch, as bake takes it");
  verb->add_flag("--truth", command.truth, "Trace the stitch's geometry, repeat beside repeat");
  add_output(*verb, command.output, "The picture: .png as people see it, .exr linear with opacity");
  verb->get_option("--output")->check(ends_in({".png", ".exr"}));
  add_shot(*verb, command);
  const char* group = "With --truth";
  verb->add_option("--samples", command.trace.samples, "Rays a pixel, an even number")
      ->type_name("N")
      ->capture_default_str()
      ->group(group);
  transport.bounces = command.trace.bounces;
  transport.indirect = command.trace.indirect;
  add_transport(*verb, transport, group);
  verb->get_option("--bounces")->description("Indirect bounces of light (unlimited)");
  verb->get_option("--indirect")->description("As of bake (traced)");
  verb->add_option("--seed", command.trace.seed, "Same seed, same picture")
      ->capture_default_str()
      ->check(seed_number())
      ->group(group);
}

/// What only the traced stitch has.
void check_swatch(const CLI::App& swatch, const SwatchCommand& command) {
  if (command.truth) return;
  for (const char* option : {"--set", "--grid", "--period", "--unit", "--up", "--albedo", "--samples",
                             "--bounces", "--indirect", "--ground", "--reference-height", "--seed"}) {
    if (swatch.count(option) > 0) throw CLI::ValidationError(option, "is for --truth, not for a fabric file");
  }
}

void add_trade_verb(CLI::App& app, TradeCommand& command) {
  CLI::App* verb = add_verb(app, "trade", "Measure what speed costs in accuracy: a sweep over the knobs",
                            "selvedge trade plain-knit -o trade-knit");
  add_common(*verb, command.common, true);
  command.common.seed = 1;
  verb->add_option("--seed", command.common.seed, "Of all bakes")
      ->capture_default_str()
      ->check(seed_number());
  verb->add_option("input", command.input, "As make takes it")->type_name("STITCH")->required();
  verb->add_option_function<std::vector<std::string>>(
          "--set",
          [&command](const std::vector<std::string>& texts) {
            command.settings = texts;
            take_settings(texts, command.cell);
          },
          "Set a parameter of the stitch; may be repeated")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_option("-o,--output", command.output,
                   "A folder for points, pictures, fabrics and the page; a sweep in it goes on")
      ->required()
      ->type_name("DIR");
  verb->add_option("--grid", command.grid,
                   "The points to measure (JSON, docs/trade.md), instead of those that the presets are among")
      ->type_name("FILE");
  const auto add = [&](const char* name, int& value, const char* help, int least, int most) {
    return verb->add_option(name, value, help)
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(least, most));
  };
  // Halves are compared: they tell the noise. Those of pictures have halves of their own.
  const auto is_multiple = [](int of) {
    return CLI::Validator(
        [of](const std::string& text) {
          int value = 0;
          const bool good = CLI::detail::lexical_cast(text, value) && value % of == 0;
          return good ? std::string() : fmt::format("{} is no multiple of {}", text, of);
        },
        "");
  };
  add("--repeats", command.repeats, "Times are medians of so many runs", 1, 99);
  add("--truth-samples", command.truth_samples, "Rays a pixel of the true pictures, a multiple of 4", 4,
      1 << 20)
      ->check(is_multiple(4));
  add("--held-out-pairs", command.held_out_pairs, "Pairs of directions to judge by", 1, 65536);
  add("--held-out-samples", command.held_out_samples, "Rays per texel and pair, an even number", 2, 1 << 20)
      ->check(is_multiple(2));
  add_text(*verb, "--size", "WxH", "Of the pictures (160x120)", [&command](const std::string& t) {
    const auto n = whole_numbers("--size", t, 'x', 2, 2, "160x120");
    if (n[0] < 22 || n[1] < 22 || n[0] > 2048 || n[1] > 2048 || n[0] > 4 * n[1])
      throw CLI::ValidationError("--size", "must lie in 22 to 2048, at most four times as wide as high");
    command.size = V2i(n[0], n[1]);
  });
  verb->add_flag("--keep-samples", command.keep_samples, "Keep the points' samples: large");
}

void add_plan_verb(CLI::App& app, PlanCommand& command) {
  CLI::App* verb =
      add_verb(app, "plan", "What a scene requires of its fabrics: levels, size of texels, backs, holes",
               "selvedge plan dressed.glb --distance 2 5 --fov 45 --size 1920x1080 -o plan.json");
  add_common(*verb, command.common);
  verb->add_option("scene", command.scene, "A dressed glTF file (.gltf .glb)")->required()->type_name("FILE");
  add_plan(*verb, command.plan);
  add_output(*verb, command.output, "The plan (.json), for selvedge make --for", false);
}

LayerSet layers_from(const std::string& text) {
  LayerSet layers;
  std::stringstream names(text);
  for (std::string name; std::getline(names, name, ',');) {
    const auto layer = layer_named(name);
    if (!layer) throw CLI::ValidationError("--layers", fmt::format("\"{}\" is not a layer", name));
    layers.insert(*layer);
  }
  return layers;
}

void add_repack_verb(CLI::App& app, RepackCommand& command) {
  CLI::App* verb =
      add_verb(app, "repack", "Write a fabric again: other precision, codec, levels or layers",
               "selvedge repack k.fabric.exr -o small.fabric.exr --levels 1-3 --layers lobes,opacity");
  add_common(*verb, command.common);
  verb->add_option("fabric", command.input, "The fabric file; what it has that is not known is left out")
      ->required()
      ->type_name("FILE");
  add_output(*verb, command.output, "The fabric file to write");
  const auto add_precision = [&](const char* half, const char* whole, const LayerSet& layers,
                                 const char* what) {
    auto* flag = verb->add_flag_callback(
        half, [&command, layers] { command.to_half.insert(layers); }, fmt::format("{} in 16 bits", what));
    verb->add_flag_callback(
            whole, [&command, layers] { command.to_float.insert(layers); },
            fmt::format("{} in 32 bits", what))
        ->excludes(flag);
  };
  add_precision("--half-lobes", "--float-lobes", {LayerKind::lobes}, "Lobes");
  add_precision("--half-tables", "--float-tables", table_layers, "Tables and frames");
  verb->add_option("--codec", command.codec, "none, rle, zips, zip or piz")
      ->type_name("NAME")
      ->capture_default_str();
  add_text(*verb, "--levels", "A-B", "Only these levels; A becomes level 0",
           [&command](const std::string& t) {
             const auto n = whole_numbers("--levels", t, '-', 1, 2, "1-3");
             command.levels = V2i(n.front(), n.back());
           });
  add_text(*verb, "--layers", "NAMES", "Only these layers: lobes,frame,table,opacity",
           [&command](const std::string& t) { command.layers = layers_from(t); });
}

void add_reattach_verb(CLI::App& app, ReattachCommand& command) {
  CLI::App* verb = add_verb(app, "reattach", "Restore the fabrics that an optimiser has dropped",
                            "selvedge reattach packed.glb -o restored.glb --fabric k.fabric.exr");
  add_common(*verb, command.common);
  verb->add_option("garment", command.input, "A glTF file (.gltf .glb) whose materials kept their extras")
      ->required()
      ->type_name("FILE");
  add_output(*verb, command.output, "The garment with its fabrics (.gltf .glb)");
  verb->add_option("--fabric", command.reattach.fabrics,
                   "A fabric file that is not where it was, such as one that was embedded; may be repeated")
      ->type_name("[NAME=]FILE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  auto* embed = verb->add_flag_callback(
      "--embed", [&command] { command.reattach.embed = true; },
      "The fabrics inside of the glTF (default for those that were)");
  verb->add_flag_callback(
          "--external", [&command] { command.reattach.embed = false; }, "The fabrics beside the glTF")
      ->excludes(embed);
}

void add_reading_verbs(CLI::App& app, Verbs& verbs) {
  CLI::App* check = add_verb(app, "check", "Check fabric, samples and glTF files",
                             "selvedge check k.fabric.exr dressed.glb");
  add_common(*check, verbs.check.common);
  check->add_option("files", verbs.check.files, "Files")->required()->type_name("FILE...");
  check->add_flag("--warnings-as-errors", verbs.check.warnings_as_errors, "Exit status 1 for a warning, too");

  CLI::App* info =
      add_verb(app, "info", "What is in a fabric, samples or glTF file", "selvedge info k.fabric.exr");
  add_common(*info, verbs.info.common);
  info->add_option("file", verbs.info.file, "A file")->required()->type_name("FILE");

  EvaluateCommand& e = verbs.evaluate;
  CLI::App* evaluate = add_verb(app, "evaluate", "Reflectance and opacity at a texel, as JSON",
                                "selvedge evaluate k.fabric.exr --texel 3,4 --light 0,0.6,0.8 --view 0,0,1");
  add_common(*evaluate, e.common);
  evaluate->add_option("fabric", e.fabric, "The fabric file")->required()->type_name("FILE");
  evaluate->add_option("--level", e.level, "Mip level; with --uv a fraction blends two")
      ->capture_default_str();
  auto* texel = add_text(*evaluate, "--texel", "X,Y", "Texel of the level, 0,0 at the top left",
                         [&e](const std::string& t) {
                           const auto n = whole_numbers("--texel", t, ',', 2, 2, "3,4");
                           e.texel = V2i(n[0], n[1]);
                         });
  add_text(*evaluate, "--uv", "U,V", "Texture coordinates; they repeat", [&e](const std::string& t) {
    const auto n = numbers("--uv", t, ',', 2, 2, "0.5,0.25");
    e.uv = V2d(n[0], n[1]);
  })->excludes(texel);
  const auto add_direction = [&](const char* name, V3d& direction, const char* help) {
    add_text(*evaluate, name, "X,Y,Z", help, [name, &direction](const std::string& t) {
      const auto n = numbers(name, t, ',', 3, 3, "0,0.6,0.8");
      direction = V3d(n[0], n[1], n[2]);
      if (!(direction.length() > 0)) throw CLI::ValidationError(name, "has no length");
    });
  };
  add_direction("--light", e.light, "Towards the light, in the fabric's frame (0,0,1); made a unit vector");
  add_direction("--view", e.view, "Towards the viewer (0,0,1)");

  CLI::App* answer = add_verb(app, "answer", "Answer queries on standard input, one JSON object per line",
                              "selvedge answer < queries.jsonl");
  add_common(*answer, verbs.answer.common);

  CLI::App* compare = add_verb(app, "compare", "Error of fabrics against held-out samples, per level",
                               "selvedge compare k.fabric.exr k.samples.exr");
  add_common(*compare, verbs.compare.common);
  compare->add_option("files", verbs.compare.files, "Fabric files, then the samples file")
      ->required()
      ->expected(2, 1000)
      ->type_name("FABRIC... SAMPLES");
  compare
      ->add_option("--plot", verbs.compare.plot,
                   "Draw truth, fit and difference, and the error over angles and levels (.png .svg)")
      ->check(ends_in({".png", ".svg"}))
      ->type_name("FILE");
}

}  // namespace

Command parse_command_line(int argc, const char* const* argv) {
  CLI::App app{"Selvedge makes fabric files from stitches and dresses glTF garments in them.", "selvedge"};
  app.set_version_flag("--version", "selvedge " SELVEDGE_VERSION);
  app.require_subcommand(1);
  app.footer("Each verb has its own --help with an example. Pictures are drawn by selvedge-view.");
  Verbs verbs;
  add_stitch_verb(app, verbs.stitch);
  add_bake_verb(app, verbs.bake);
  add_merge_verb(app, verbs.merge);
  add_fit_verb(app, verbs.fit);
  add_make_verb(app, verbs.make);
  add_plan_verb(app, verbs.plan);
  add_dress_verb(app, verbs.dress);
  add_repack_verb(app, verbs.repack);
  add_reattach_verb(app, verbs.reattach);
  add_reading_verbs(app, verbs);
  BakeOptions transport;
  add_swatch_verb(app, verbs.swatch, transport);
  add_trade_verb(app, verbs.trade);
  try {
    app.parse(argc, argv);
    apply_choice(*app.get_subcommand("make"), verbs.make);
    check_slabs(app, verbs.bake, verbs.fit, verbs.make);
    check_swatch(*app.get_subcommand("swatch"), verbs.swatch);
    if (app.got_subcommand("stitch") && !verbs.stitch.list && verbs.stitch.input.empty()) {
      throw CLI::RequiredError("stitch: a stitch or --list");
    }
    if (verbs.stitch.show && (verbs.stitch.list || verbs.stitch.input.empty())) {
      throw CLI::RequiredError("stitch --show: a stitch");
    }
    if (app.got_subcommand("evaluate") && !verbs.evaluate.texel && !verbs.evaluate.uv) {
      throw CLI::RequiredError("evaluate: --texel or --uv");
    }
    if (!verbs.compare.plot.empty() && verbs.compare.files.size() != 2) {
      throw CLI::ValidationError("--plot", "draws one fabric");
    }
    if (const CLI::App* plan = app.get_subcommand("plan"); plan->parsed()) check_plan_usage(*plan);
    if (app.got_subcommand("dress") && verbs.dress.dress.materials.empty() && !verbs.dress.dress.all) {
      throw CLI::RequiredError("dress: --material or --all");
    }
  } catch (const CLI::ParseError& error) {
    // CLI11 has its own statuses above 100; ours are 0 for help and version, 2 for the rest.
    return ExitNow{app.exit(error) == 0 ? 0 : 2};
  }
  const std::string verb = app.get_subcommands().front()->get_name();
  verbs.bake.texels_given = app.get_subcommand("bake")->count("--texels") > 0;
  verbs.make.texels_given = app.get_subcommand("make")->count("--texels") > 0;
  if (verb == "stitch") return verbs.stitch;
  if (verb == "bake") return verbs.bake;
  if (verb == "merge") return verbs.merge;
  if (verb == "fit") return verbs.fit;
  if (verb == "make") return verbs.make;
  if (verb == "dress") return verbs.dress;
  if (verb == "reattach") return verbs.reattach;
  if (verb == "check") return verbs.check;
  if (verb == "info") return verbs.info;
  if (verb == "evaluate") return verbs.evaluate;
  if (verb == "answer") return verbs.answer;
  if (verb == "repack") return verbs.repack;
  if (verb == "trade") return verbs.trade;
  if (verb == "swatch") {
    verbs.swatch.trace.bounces = transport.bounces;
    verbs.swatch.trace.indirect = transport.indirect;
    verbs.swatch.trace.ground = transport.ground;
    verbs.swatch.trace.reference = transport.reference;
    return verbs.swatch;
  }
  if (verb == "plan") return verbs.plan;
  return verbs.compare;
}

}  // namespace selvedge
