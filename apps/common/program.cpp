#include "apps/common/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <exception>
#include <utility>

#include "format/base/atomic_file.h"
#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/base/printable.h"

namespace selvedge {
namespace {

/// Flushes standard output: `status` if all could be written, else a line on standard error and 1.
int check_output(int status) {
  // Text that still is in the buffer is written here.
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return status;
  report_error({Code::file_unwritable, "standard output", "", std::strerror(errno)});
  return 1;
}

/// The first file, or other word, that a verb is given without a name of an option.
std::string first_file(const CLI::App& verb) {
  for (const CLI::Option* option : verb.get_options())
    if (option->get_positional() && !option->results().empty()) return option->results().front();
  return "";
}

/// "-o, --output"; for an argument without a flag its own name.
std::string names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names.empty() ? option.get_name() : fmt::format("{}", fmt::join(names, ", "));
}

/// Escapes text: a leading dot or quote would be a macro, and a typed dash is \-.
std::string roff(const std::string& text) {
  std::string page;
  for (const char c : text) {
    if ((c == '.' || c == '\'') && (page.empty() || page.back() == '\n')) page += "\\&";
    page += c == '\\' ? "\\e" : c == '-' ? "\\-" : std::string(1, c);
  }
  return page;
}

std::string options_text(const CLI::App& verb) {
  std::string page;
  for (const std::string& group : verb.get_groups()) {
    const auto options =
        verb.get_options([&](const CLI::Option* option) { return option->get_group() == group; });
    if (group.empty() || options.empty()) continue;
    page += fmt::format(".PP\n.I {}\n", roff(group));
    for (const CLI::Option* option : options) {
      page += fmt::format(".TP\n\\fB{}\\fR", roff(names_of(*option)));
      if (option->get_items_expected_max() > 0)
        page += fmt::format(" \\fI{}\\fR", roff(option->get_type_name()));
      page += fmt::format(
          "\n{}{}\n", roff(option->get_description()),
          option->get_default_str().empty() ? "" : roff(fmt::format(" [{}]", option->get_default_str())));
    }
  }
  return page;
}

/// The manual page of a program and all its verbs: roff with the macros of man(7).
std::string manual_page(const CLI::App& program) {
  const std::string& name = program.get_name();
  std::string page = fmt::format(
      ".TH {0} 1 \"\" \"Selvedge {1}\"\n.SH NAME\n{2} \\- {3}\n.SH SYNOPSIS\n.B {2}\n.I verb\n[option ...]\n"
      ".SH DESCRIPTION\n{4}\n.SH VERBS\n",
      CLI::detail::to_lower(name), SELVEDGE_VERSION, roff(name), roff(program.get_description()),
      roff(program.get_footer()));
  for (const CLI::App* verb : program.get_subcommands({}))
    page += fmt::format(".SS {} {}\n{}.\n{}.PP\n.nf\n{}\n.fi\n", roff(name), roff(verb->get_name()),
                        roff(verb->get_description()), options_text(*verb), roff(verb->get_footer()));
  return page;
}

/// Leaves out the further options, but for --help-all.
struct HelpText : CLI::Formatter {
  bool all = false;
  std::string make_group(std::string group, bool is_positional,
                         std::vector<const CLI::Option*> options) const override {
    if (group == advanced_heading && !all) return "";
    return CLI::Formatter::make_group(std::move(group), is_positional, std::move(options));
  }
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    std::string text = CLI::Formatter::make_help(app, std::move(name), mode);
    for (std::size_t at = 0; (at = text.find("\n\n\n")) != std::string::npos;) text.erase(at, 1);
    return text;
  }
};

}  // namespace

Program::Program(const char* name, const char* help, const char* footer)
    : app_(std::make_unique<CLI::App>(help, name)) {
  program_name = name;
  app_->set_version_flag("--version", fmt::format("{} " SELVEDGE_VERSION, name));
  app_->require_subcommand(1);
  app_->footer(footer);
  app_->formatter(std::make_shared<HelpText>());
  app_->set_help_all_flag("--help-all", "Print this message with further options and exit");
}

Program::~Program() = default;

Program::Verb& Program::add(const VerbText& text) {
  CLI::App* verb = app_->add_subcommand(text.name, text.help);
  std::string examples = "  ";
  for (const char* c = text.examples; *c != '\0'; ++c)
    examples += *c == '\n' ? std::string("\n  ") : std::string(1, *c);
  verb->footer(
      fmt::format("Example{}:\n{}\n\n{}Exit status: 0 good, 1 the input is bad or a check failed, 2 usage.",
                  examples.find('\n') == std::string::npos ? "" : "s", examples, text.notes));
  verbs_.push_back(std::make_unique<Verb>());
  verbs_.back()->options = std::make_unique<Options>(*verb);
  return *verbs_.back();
}

std::string Program::usage_fault(std::string fault) const {
  const auto verbs = app_->get_subcommands();
  const CLI::App& at = verbs.empty() ? *app_ : *verbs.front();
  for (const std::string& word : at.remaining()) {
    const bool is_option = word.starts_with('-');
    if (!is_option && !verbs.empty()) continue;
    fault = fmt::format("unknown {} {}", is_option ? "option" : "verb", word.substr(0, word.find('=')));
    break;
  }
  std::ranges::replace(fault, '\n', ' ');
  return fmt::format("{}; see {}--help", fault,
                     verbs.empty() ? "" : fmt::format("{} {} ", app_->get_name(), at.get_name()));
}

int Program::parse_and_run(int argc, const char* const* argv) {
  if (argc == 2 && std::string_view(argv[1]) == "--man") {
    fmt::print("{}", manual_page(*app_));
    return 0;
  }
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // CLI11 has its own statuses, above 100, and messages of several lines.
    if (dynamic_cast<const CLI::CallForAllHelp*>(&error) != nullptr) {
      static_cast<HelpText&>(*app_->get_formatter()).all = true;
      fmt::print("{}", app_->help());
      return 0;
    }
    if (error.get_exit_code() == 0) return app_->exit(error);
    const std::string fault = usage_fault(error.what());
    // Whether or not the word was parsed.
    if (std::any_of(argv + 1, argv + argc, [](std::string_view word) { return word == "--json"; })) {
      const auto verbs = app_->get_subcommands();
      fmt::print("{}", report_text(with_report_header(verbs.empty() ? "" : verbs.front()->get_name().c_str(),
                                                      {{"error",
                                                        {{"code", "USAGE"},
                                                         {"file", ""},
                                                         {"place", ""},
                                                         {"message", escape_invalid_utf8(fault)}}}})));
    } else {
      std::fputs(fmt::format("{}: {}\n", app_->get_name(), escape_unprintable(fault)).c_str(), stderr);
    }
    return 2;
  }
  for (const auto& verb : verbs_) {
    Options& options = *verb->options;
    if (!options.app().parsed()) continue;
    const Result<int> status = status_of(*verb);
    if (status) return *status;
    if (options.common().json)
      fmt::print("{}", report_text(with_report_header(options.app().get_name().c_str(),
                                                      {{"error", to_json(status.error())}})));
    else
      report_error(status.error());
    return 1;
  }
  return 2;
}

Result<int> Program::status_of(const Verb& verb) {
  set_thread_limit(verb.options->common().threads);
  return catch_exceptions(first_file(verb.options->app()), [&]() -> Result<int> {
    try {
      // An output that cannot be written is refused before the work.
      value_or_throw(verb.options->check_outputs());
      return verb.work();
    } catch (const std::exception&) {
      // No fault of the input: run() reports it.
      if (std::ferror(stdout) == 0) throw;
      return 1;
    }
  });
}

Result<Json> Program::call_verb(std::vector<std::string> words) {
  std::ranges::reverse(words);
  try {
    app_->parse(words);
  } catch (const CLI::ParseError& error) {
    return fail(Code::option_out_of_range, "", "usage", usage_fault(error.what()));
  }
  for (const auto& verb : verbs_) {
    if (!verb->options->app().parsed()) continue;
    Json said;
    verb->options->common().json = true;
    Json* const before = std::exchange(report_target, &said);
    const Result<int> status = status_of(*verb);
    report_target = before;
    if (!status) return tl::unexpected(status.error());
    said["status"] = *status;
    return said;
  }
  return Json();
}

int Program::run(int argc, const char* const* argv) {
  remove_unfinished_files_on_signal();
  // Else the first files that are opened would be standard output or error.
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0)
      static_cast<void>(open("/dev/null", stream == STDERR_FILENO ? O_WRONLY : O_RDONLY));
  try {
    return check_output(parse_and_run(argc, argv));
  } catch (...) {
    // Errors in writing texts larger than the buffer are found here.
    if (std::ferror(stdout) != 0) return check_output(1);
    report_error(thrown_error(""));
    return 1;
  }
}

}  // namespace selvedge
