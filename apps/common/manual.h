// Prints the manual page from the options that a program declares.
#pragma once

#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): that of CLI11
class App;
}

namespace selvedge {

/// roff with the macros of man(7): one page for a program and all its verbs.
std::string manual_page(const CLI::App& program);

}  // namespace selvedge
