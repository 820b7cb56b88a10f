// Prints the manual page and the completion for bash from the options that a program declares.
#pragma once

#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): that of CLI11
class App;
}

namespace selvedge {

/// roff with the macros of man(7): one page for a program and all its verbs.
std::string manual_page(const CLI::App& program);

/// A script for bash that completes verbs, options, the values of an option, and files. It works in zsh after
/// `autoload bashcompinit && bashcompinit`.
std::string bash_completion(const CLI::App& program);

}  // namespace selvedge
