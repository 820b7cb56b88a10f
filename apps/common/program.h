// A program with verbs: a function declares the options of each in a struct, another runs with it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/common/options.h"
#include "apps/common/report.h"
#include "format/base/error.h"

namespace selvedge {

/// The help of a verb.
struct VerbText {
  const char* name;
  const char* help;      ///< one line
  const char* examples;  ///< one per line
  const char* notes = "";
};

class Program {
 public:
  Program(const char* name, const char* help, const char* footer);
  ~Program();
  Program& operator=(Program&&) = delete;

  /// Command has a member `common`. `declare` adds the options of the verb to --json, --quiet and --threads;
  /// `work` returns the exit status, or an error.
  template <class Command>
  void add(const VerbText& text, void (*declare)(Options&, Command&), Result<int> (*work)(const Command&)) {
    auto command = std::make_shared<Command>();
    Verb& verb = add(text);
    verb.options->common(command->common);
    declare(*verb.options, *command);
    verb.work = [command, work] { return work(*command); };
  }

  /// Parses the command line, runs its verb, and returns the exit status: 0 good, 1 bad input or a failed
  /// check, 2 usage. With --json an error is a JSON report with a member "error" on standard output; else one
  /// line on standard error. Unfinished files are removed if a signal ends the program. Exceptions
  /// become errors of the first file that the verb is given (guard.h). `--man` without a verb prints the
  /// manual page.
  int run(int argc, const char* const* argv);

  /// Runs a verb, once for each Program, with its report as the result: as --json prints it, and `status`,
  /// the exit status. OPTION_OUT_OF_RANGE with the place "usage" for a wrong command line.
  Result<Json> call_verb(std::vector<std::string> words);

 private:
  struct Verb {
    std::unique_ptr<Options> options;
    std::function<Result<int>()> work;
  };
  Verb& add(const VerbText& text);
  int parse_and_run(int argc, const char* const* argv);
  Result<int> status_of(const Verb& verb);
  std::string usage_fault(std::string fault) const;

  std::unique_ptr<CLI::App> app_;
  std::vector<std::unique_ptr<Verb>> verbs_;
};

}  // namespace selvedge
