// import: pictures of a sample -> samples.

#include "converter/measured/import.h"
#include "apps/selvedge/commands.h"

namespace selvedge {
namespace {

struct ImportCommand {
  CommonOptions common;
  std::string table;
  std::string output;
  ImportOptions import;
};

void declare(Options& options, ImportCommand& command) {
  ImportOptions& o = command.import;
  options
      .text("table", command.table, "TABLE|DIR",
            "A table of the pictures (CSV), or a folder of pictures with angles in their names, as "
            "tl030_pl180_tv000_pv000.png")
      .required()
      .reads();
  options.number("--width", o.width_mm, "MM", "Width of the sample that a picture shows")
      .required()
      .in_range(1e-3, 1e6);
  options.vector("--period", o.period_mm, "W,H", "Size of one repeat, mm (default: found in the pictures)");
  options.text("--texels", "N|WxH", "Texels of one repeat (default: its pixels, at most 32x32)",
               [&o](const std::string& t) {
                 const auto n = parse_integer_list("--texels", t, 'x', 1, 2, "32 or 32x16");
                 if (std::min(n.front(), n.back()) < 1 || std::max(n.front(), n.back()) > 4096)
                   refuse("--texels", "must be 1 to 4096 a side");
                 o.texels = V2i(n.front(), n.back());
               });
  options.number("--views", o.views, "N", "View directions of the samples").in_range(1, 4096);
  options.number("--lights", o.lights, "N", "Light directions of the samples").in_range(1, 4096);
  options.number("--thickness", o.thickness_mm, "MM", "Thickness of the cloth").in_range(0, 1e6);
  options.text("--opacity", o.opacity_path, "FILE", "A picture of the sample that is black in holes").reads();
  static constexpr std::string_view colours[] = {"srgb", "linear", "xyz"};
  options.choice("--colours", colours, o.colours,
                 "Colours of the pictures: whole numbers in sRGB, or linear, or linear CIE XYZ");
  options.number("--seed", o.seed, "N", "Seed of the choice of pictures to hold out");
  options.bytes("--max-memory", o.max_memory,
                "Refuse pictures that need more, themselves or their texels (K, M, G: KiB, MiB, GiB) [4G]");
  options.output(command.output, "The samples file").required();
}

Result<int> run(const ImportCommand& command) {
  const auto r = [&] {
    TerminalProgress progress("import", command.common.quiet);
    return value_or_throw(
        import_pictures(command.table, command.import, command.output, progress.callback()));
  }();
  const Json json = {{"output", command.output},
                     {"bytes", file_size_or_zero(command.output)},
                     {"seconds", r.seconds},
                     {"pictures", r.picture_count},
                     {"heldOut", r.held_out_count},
                     {"texels", r.texels},
                     {"mmPerRepeat", r.period_mm},
                     {"repeats", r.repeats},
                     {"irregularity", r.repeat_deviation},
                     {"leftOutError", r.leave_one_out_error}};
  report(command.common, "import", json,
         fill_pattern(
             "{pictures} pictures, {heldOut} of them held out, in {seconds:.1f} s -> {output} ({bytes} "
             "bytes)\n"
             "  a repeat has {mmPerRepeat:.4g} mm, {texels} texels; {repeats:.1f} in a picture, which differ "
             "by {irregularity:.2g}\n"
             "  error between the directions: {leftOutError:.2g}, relative\n",
             json));
  return 0;
}

}  // namespace

void add_import_verb(Program& program) {
  program.add<ImportCommand>({"import", "Measured pictures of a sample -> samples",
                              "selvedge import pictures.csv --width 40 -o k.samples.exr"},
                             declare, run);
}

}  // namespace selvedge
