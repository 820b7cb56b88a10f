#include "apps/selvedge-view/commands.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "format/picture/image.h"
#include "format/quality/ssim.h"

namespace selvedge {
namespace {

using Json = nlohmann::ordered_json;

int report(const Error& error) {
  fmt::print(stderr, "selvedge-view: {}\n", to_line(error));
  return 1;
}

}  // namespace

void limit_mesa_threads(int threads) {
  if (threads > 0) setenv("LP_NUM_THREADS", fmt::format("{}", threads).c_str(), 0);
}

int run(const CompareCommand& command) {
  // As stored: differences are then told in steps of the picture that people see.
  const Result<Image> first = read_image(command.first, Transfer::keep);
  if (!first) return report(first.error());
  const Result<Image> second = read_image(command.second, Transfer::keep);
  if (!second) return report(second.error());
  const Result<ImageDifference> difference = compare_images(*first, *second);
  if (!difference) {
    Error error = difference.error();
    if (error.file.empty()) error.file = command.second;
    return report(error);
  }
  const auto similarity = structural_similarity(*first, *second);
  if (!similarity) return report(similarity.error());
  // Too small a picture has none, NaN has no likeness.
  const bool similar = *similarity && std::isfinite(**similarity);
  const ImageDifference& d = *difference;
  if (command.json) {
    const Json all = {{"program", "selvedge-view"},
                      {"version", SELVEDGE_VERSION},
                      {"report", 1},
                      {"verb", "compare"},
                      {"maxAbsolute", std::isfinite(d.max_absolute) ? Json(d.max_absolute) : Json(nullptr)},
                      {"x", d.x},
                      {"y", d.y},
                      {"channel", d.channel},
                      {"rmse", std::isfinite(d.rmse) ? Json(d.rmse) : Json(nullptr)},
                      {"psnr", std::isfinite(d.psnr) ? Json(d.psnr) : Json(nullptr)},
                      {"ssim", similar ? Json(**similarity) : Json(nullptr)}};
    fmt::print("{}\n", all.dump(2));
  } else {
    fmt::print("max {:.6g} at ({}, {}) channel {}, RMSE {:.6g}, PSNR {:.2f} dB{}\n", d.max_absolute, d.x, d.y,
               d.channel, d.rmse, d.psnr, similar ? fmt::format(", SSIM {:.4f}", **similarity) : "");
  }
  if (command.max && !(d.max_absolute <= *command.max)) {
    return report({Code::image_mismatch, command.second, fmt::format("pixel ({}, {})", d.x, d.y),
                   fmt::format("differs from {} by {:.6g}, more than {:.6g}", command.first, d.max_absolute,
                               *command.max)});
  }
  return 0;
}

}  // namespace selvedge
