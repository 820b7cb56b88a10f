// check: lists every broken rule of files.
#include <fmt/format.h>

#include <algorithm>

#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/file_kind.h"
#include "format/base/guard.h"
#include "format/base/printable.h"

namespace selvedge {
namespace {

struct CheckCommand {
  CommonOptions common;
  std::vector<std::string> files;
  bool is_strict = false;
  SceneLimits limits;
};

void declare(Options& options, CheckCommand& command) {
  options.list("files", command.files, "FILE...", "Files").required();
  options.flag("--strict", command.is_strict, "Exit status 1 for a warning, too");
  add_limits(options, command.limits);
}

Result<int> run(const CheckCommand& command) {
  Json files = Json::array();
  std::string text;
  bool all_good = true;
  for (const std::string& path : command.files) {
    const Result<FileKind> kind = catch_exceptions(path, [&] { return kind_of(path); });
    // A failure in one file does not end the check of the others.
    const Result<Issues> found = catch_exceptions(path, [&]() -> Result<Issues> {
      return kind ? check_file(path, *kind, command.limits) : Issues{kind.error()};
    });
    const Issues issues = found ? *found : Issues{found.error()};
    const auto warnings = static_cast<std::size_t>(std::ranges::count_if(
        issues, [](const Error& e) { return severity_of(e.code) == Severity::warning; }));
    const bool good = command.is_strict ? issues.empty() : warnings == issues.size();
    all_good = all_good && good;
    Json list = Json::array();
    for (const Error& issue : issues) {
      list.push_back(to_json(issue));
      // With --json or --quiet, standard error has only issues that make the status 1.
      const bool failing = command.is_strict || severity_of(issue.code) == Severity::error;
      if (failing || !(command.common.quiet || command.common.json)) report_issue(issue);
    }
    Json entry = {{"file", escape_invalid_utf8(path)}, {"good", good}, {"issues", std::move(list)}};
    if (kind) entry["kind"] = name_of(*kind);
    files.push_back(std::move(entry));
    if (good) text += fmt::format("{}: {}, good", path, name_of(*kind));
    if (good && warnings > 0) text += fmt::format(", {} warning{}", warnings, warnings == 1 ? "" : "s");
    if (good) text += '\n';
  }
  report(command.common, "check", {{"good", all_good}, {"files", files}}, text);
  return all_good ? 0 : 1;
}

}  // namespace

void add_check_verb(Program& program) {
  program.add<CheckCommand>(
      {"check", "Check fabric, samples and glTF files", "selvedge check k.fabric.exr dressed.glb"}, declare,
      run);
}

}  // namespace selvedge
