#include "apps/common/manual.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>

namespace selvedge {
namespace {

/// "-o, --output"; for an argument without a flag its own name.
std::string names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names.empty() ? option.get_name() : fmt::format("{}", fmt::join(names, ", "));
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

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
      if (takes_value(*option)) page += fmt::format(" \\fI{}\\fR", roff(option->get_type_name()));
      page += fmt::format(
          "\n{}{}\n", roff(option->get_description()),
          option->get_default_str().empty() ? "" : roff(fmt::format(" [{}]", option->get_default_str())));
    }
  }
  return page;
}

}  // namespace

std::string manual_page(const CLI::App& program) {
  const std::string& name = program.get_name();
  std::string page = fmt::format(
      ".TH {0} 1 \"\" \"Selvedge {1}\"\n.SH NAME\n{2} \\- {3}\n.SH SYNOPSIS\n.B {2}\n.I verb\n[option ...]\n"
      ".SH DESCRIPTION\n{4}\n.SH VERBS\n",
      CLI::detail::to_lower(name), SELVEDGE_VERSION, roff(name), roff(program.get_description()),
      roff(program.get_footer()));
  for (const CLI::App* verb : program.get_subcommands({})) {
    page += fmt::format(".SS {} {}\n{}.\n{}.PP\n.nf\n{}\n.fi\n", roff(name), roff(verb->get_name()),
                        roff(verb->get_description()), options_text(*verb), roff(verb->get_footer()));
  }
  return page;
}

}  // namespace selvedge
