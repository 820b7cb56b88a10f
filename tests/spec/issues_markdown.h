// spec/issues.md, made from the table of codes.
#pragma once

#include <string>

#include "format/base/error.h"

namespace selvedge::test {

inline std::string issues_markdown() {
  std::string text =
      "# Issues\n"
      "\n"
      "Every issue that a program reports has one of these codes. An error means that a file breaks a rule; "
      "a warning\n"
      "means that something in it is unwise, or will look different from what was meant. An issue is one "
      "line; parts\n"
      "that do not apply are absent:\n"
      "\n"
      "```text\n"
      "file: place: message [CODE]\n"
      "```\n"
      "\n"
      "`place` is the place in the file (a JSON pointer, a part with its level, channel or pixel, or a "
      "line) or the option.\n"
      "\n"
      "| code | severity | meaning |\n"
      "|---|---|---|\n";
  for (const CodeRow& row : code_table()) {
    text.append("| `")
        .append(row.name)
        .append("` | ")
        .append(name_of(row.severity))
        .append(" | ")
        .append(row.meaning)
        .append(" |\n");
  }
  text +=
      "\n"
      "This page is printed from the code; rebuild it with `build/release/bin/print_issues > "
      "spec/issues.md`.\n";
  return text;
}

}  // namespace selvedge::test
