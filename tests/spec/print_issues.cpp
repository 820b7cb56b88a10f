// Prints spec/issues.md.
#include <iostream>

#include "tests/spec/issues_markdown.h"

int main() { std::cout << selvedge::test::issues_markdown(); }
