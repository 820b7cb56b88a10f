// make --list: a text file with the words of one make on each line.
#include <fmt/format.h>

#include <map>
#include <sstream>

#include "apps/selvedge/make.h"
#include "converter/stitch/library.h"
#include "format/base/atomic_file.h"
#include "format/base/printable.h"

namespace selvedge {
namespace {

struct List {
  struct Line {
    int number = 0;  ///< from 1
    MakeCommand command;
  };
  std::vector<Line> lines;  ///< lines with a make
  int count = 0;            ///< of all lines
};

/// The words of a line as a shell splits them: blanks, quotes, backslashes; # begins a comment.
Result<std::vector<std::string>> words_of(const std::string& line, const std::string& file,
                                          const std::string& place) {
  std::vector<std::string> words;
  bool open = false;  // a word has begun
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    const bool blank = quote == 0 && (c == ' ' || c == '\t' || c == '\r');
    if (quote == 0 && !open && c == '#') break;
    if (blank) {
      open = false;
      continue;
    }
    if (!open) words.emplace_back();
    open = true;
    if (c == quote)
      quote = 0;
    else if (quote == 0 && (c == '\'' || c == '"'))
      quote = c;
    else if (c == '\\' && quote != '\'' && i + 1 < line.size())
      words.back() += line[++i];
    else
      words.back() += c;
  }
  if (quote != 0) return fail(Code::option_out_of_range, file, place, "a quote is not closed");
  return words;
}

/// Refuses a line whose stitch is unknown or broken, or whose mesh is not there.
void check_cell(const MakeCommand& command, int number, const std::string& list) {
  const auto fault = [&]() -> std::optional<Error> {
    if (is_stitch(command.input)) {
      // Charts and drafts are read, not drawn, which may take minutes.
      const bool is_file = !files_of_cell(command.input).empty();
      const Result<void> good =
          is_file ? describe_stitch(command.input).map([](const auto&) {})
                  : find_stitch(command.input, command.cell.settings).map([](const auto&) {});
      return good ? std::nullopt : std::optional(good.error());
    }
    if (file_size_or_zero(command.input) > 0) return std::nullopt;
    return Error{Code::file_missing, command.input, "", "is not there, or empty"};
  }();
  if (fault) throw Failure{{fault->code, list, fmt::format("line {}", number), to_line(*fault)}};
}

/// The makes of the list. All lines are parsed before the first is made: a fault in the last is reported at
/// once.
List read_list(const std::string& path, bool all_changed_only) {
  constexpr std::uintmax_t max_bytes = std::uintmax_t{64} << 20;
  const auto refuse = [&](int number, const std::string& why) {
    throw Failure{{Code::option_out_of_range, path, fmt::format("line {}", number), why}};
  };
  List list;
  std::map<std::string, int> outputs;         // numbers of lines, by the file that they write
  std::map<std::string, std::string> inputs;  // names, by the file
  inputs.emplace(file_identity(path), path);
  std::istringstream text(value_or_throw(read_file(path, max_bytes)));
  for (std::string line; std::getline(text, line);) {
    const std::string place = fmt::format("line {}", ++list.count);
    if (escape_unprintable(line) != line) refuse(list.count, "has a control character");
    auto words = value_or_throw(words_of(line, path, place));
    if (words.empty()) continue;
    if (all_changed_only) words.emplace_back("--if-changed");
    MakeCommand command = value_or_throw(make_command_of(words, path, place));
    if (!command.list_path.empty()) refuse(list.count, "--list has no place in a list");
    check_cell(command, list.count, path);
    for (const std::string& file : files_of_cell(command.input)) inputs.emplace(file_identity(file), file);
    for (const std::string& file : {command.output, command.samples_path}) {
      if (file.empty()) continue;
      const auto [before, is_new] = outputs.emplace(file_identity(file), list.count);
      if (!is_new) refuse(list.count, fmt::format("writes {}, as line {} does", file, before->second));
    }
    list.lines.push_back({list.count, std::move(command)});
  }
  for (const auto& [file, number] : outputs)
    if (const auto read = inputs.find(file); read != inputs.end())
      refuse(number, fmt::format("writes over {}, an input", read->second));
  return list;
}

}  // namespace

Result<int> make_from_list(const MakeCommand& command) {
  const CommonOptions& common = command.common;
  List list = read_list(command.list_path, command.key.is_given());
  if (command.list_line && *command.list_line > list.count)
    return fail(Code::option_out_of_range, command.list_path, fmt::format("line {}", *command.list_line),
                fmt::format("the list has {} lines", list.count));
  Json rows = Json::array();
  int made = 0;
  int kept = 0;
  int failed = 0;
  for (List::Line& line : list.lines) {
    if (command.list_line && line.number != *command.list_line) continue;
    line.command.common = common;
    const std::string& output = line.command.output;
    Json row = {{"line", line.number}, {"output", output}};
    const auto result = catch_exceptions(
        output, [&]() -> Result<std::optional<MadeFabric>> { return make_file(line.command); });
    if (result) {
      const auto& fabric = *result;
      ++(fabric ? made : kept);
      row.update({{"bytes", file_size_or_zero(output)},
                  {"seconds", fabric ? fabric->bake.seconds + fabric->fit.seconds : 0},
                  {"kept", !fabric}});
    } else {
      ++failed;
      row["error"] = to_json(result.error());
      if (!common.json) report_error(result.error());
    }
    rows.push_back(row);
    const char* pattern = result ? "{output}: {bytes} bytes, {seconds:.1f} s\n" : "{output}: failed\n";
    if (!common.json && !common.quiet) fmt::print("{}", escape_unprintable(fill_pattern(pattern, row)));
  }
  report(common, "make",
         {{"list", command.list_path}, {"made", made}, {"kept", kept}, {"failed", failed}, {"fabrics", rows}},
         fmt::format("{}: {} made, {} kept, {} failed\n", command.list_path, made, kept, failed));
  return failed > 0 ? 1 : 0;
}

}  // namespace selvedge
