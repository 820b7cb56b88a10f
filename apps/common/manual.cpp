#include "apps/common/manual.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>

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

/// The values of an option separated by spaces, from the names of a type such as on|off.
std::string values_of(const CLI::Option& option) {
  std::string type = option.get_type_name();
  const bool are_names = type.find('|') != std::string::npos &&
                         std::none_of(type.begin(), type.end(), [](char c) { return c >= 'A' && c <= 'Z'; });
  std::replace(type.begin(), type.end(), '|', ' ');
  return are_names ? type : "";
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

std::string bash_completion(const CLI::App& program) {
  std::string verbs;
  std::string options;
  std::string values;
  for (const CLI::App* verb : program.get_subcommands({})) {
    verbs += verb->get_name() + " ";
    options += fmt::format("    {}) words=\"", verb->get_name());
    for (const CLI::Option* option : verb->get_options()) {
      for (const std::string& long_name : option->get_lnames()) {
        options += fmt::format("--{} ", long_name);
        if (const std::string names = values_of(*option); !names.empty())
          values += fmt::format("    {}:--{}) words=\"{}\" ;;\n", verb->get_name(), long_name, names);
      }
    }
    options += "\" ;;\n";
  }
  const std::string& name = program.get_name();
  std::string function = name;
  std::replace(function.begin(), function.end(), '-', '_');
  return fmt::format(R"(# Completion of {0} for bash.
_{1}() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} words=
  COMPREPLY=()
  if [ "$COMP_CWORD" = 1 ]; then
    COMPREPLY=($(compgen -W "{2}--help --version" -- "$word"))
    return
  fi
  case ${{COMP_WORDS[1]}}:${{COMP_WORDS[COMP_CWORD - 1]}} in
{4}  esac
  [ -n "$words" ] || [[ $word != -* ]] || case ${{COMP_WORDS[1]}} in
{3}  esac
  [ -z "$words" ] || COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _{1} {0}
)",
                     name, function, verbs, options, values);
}

}  // namespace selvedge
