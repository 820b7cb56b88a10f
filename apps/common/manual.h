// The manual page and the completion of bash, printed from the options that a program declares.
#pragma once

#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): that of CLI11
class App;
}

namespace selvedge {

/// roff with the macros of man(7): one page for a program and all its verbs.
std::string manual_page(const CLI::App& program);

/// A script for bash that completes verbs, options, the names that an option takes, and files. zsh reads it,
/// too, after `autoload bashcompinit && bashcompinit`.
std::string bash_completion(const CLI::App& program);

}  // namespace selvedge
