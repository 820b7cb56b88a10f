// compare: the differences between two pictures.
#include <fmt/format.h>

#include <cmath>

#include "apps/selvedge-view/commands.h"
#include "format/picture/image.h"
#include "format/quality/ssim.h"

namespace selvedge {
namespace {

struct CompareCommand {
  CommonOptions common;
  std::string first;
  std::string second;
  std::optional<double> max;  ///< largest difference that passes
};

void declare(Options& options, CompareCommand& command) {
  options.common(command.common);
  options.text("first", command.first, "FILE", "A picture").required();
  options.text("second", command.second, "FILE", "Another picture of the same size").required();
  options.number("--max", command.max, "BOUND", "Largest absolute difference of a value that passes")
      .in(0, 1e30);
}

Result<int> run(const CompareCommand& command) {
  // Values as stored, so that differences are in steps of the displayed picture.
  const auto first = must(read_image(command.first, Transfer::keep));
  const auto second = must(read_image(command.second, Transfer::keep, default_memory - memory_of(first)));
  const auto of_second = [&](Error error) {
    if (error.file.empty()) error.file = command.second;
    return error;
  };
  const ImageDifference d = must(compare_images(first, second).map_error(of_second));
  const auto similarity = must(structural_similarity(first, second));
  // The similarity is undefined for pictures that are too small, and NaN for pictures with NaN.
  const bool similar = similarity && std::isfinite(*similarity);
  report(
      command.common, "compare",
      {{"maxAbsolute", d.max_absolute},
       {"x", d.x},
       {"y", d.y},
       {"channel", d.channel},
       {"rmse", d.rmse},
       {"psnr", d.psnr},
       {"ssim", similar ? Json(*similarity) : Json(nullptr)}},
      fmt::format("max {:.6g} at ({}, {}) channel {}, RMSE {:.6g}, PSNR {:.2f} dB{}\n", d.max_absolute, d.x,
                  d.y, d.channel, d.rmse, d.psnr, similar ? fmt::format(", SSIM {:.4f}", *similarity) : ""));
  if (!command.max || d.max_absolute <= *command.max) return 0;
  // The report is the result; this line explains the exit status.
  report_error({Code::image_mismatch, command.second, fmt::format("pixel ({}, {})", d.x, d.y),
                fmt::format("differs from {} by {:.6g}, more than {:.6g}", command.first, d.max_absolute,
                            *command.max)});
  return 1;
}

}  // namespace

void add_compare_verb(Program& program) {
  program.add<CompareCommand>(
      {"compare", "Report how far two pictures are apart",
       "selvedge-view compare before.png after.png --max 0.02",
       "PNG values are compared as stored (sRGB-encoded, 1 is white), EXR values as they are. PSNR and SSIM\n"
       "are of the colours, the largest difference and RMSE of opacity, too.\n"},
      declare, run);
}

}  // namespace selvedge
