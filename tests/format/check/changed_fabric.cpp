#include "tests/format/check/changed_fabric.h"

#include <algorithm>

#include "tests/format/fabrics.h"
#include "tests/require.h"

namespace selvedge::test {
namespace {

Fabric good_fabric() {
  Fabric fabric = random_fabric(4, 3, {2, 2}, 1, 7);
  // Random lobes reflect more than they receive; a tenth of them does not.
  for (FabricLevel& level : fabric.levels) {
    for (std::size_t i = 0; i < level.lobes().size(); i += 5) {
      float* p = &level.lobes()[i];
      *p *= 0.1F;
      for (int k = 1; k <= 3; ++k) p[k] *= 0.5F;
    }
  }
  return fabric;
}

void expect(const Change& change, const Lines& expected, bool refused) {
  Changed changed;
  change(changed.file);
  const Issues issues = changed.issues();
  CHECK(joined(lines_of(issues)) == joined(expected));
  const auto read = read_fabric(changed.folder / "changed.exr");
  CHECK(read.has_value() == !refused);
  if (read || !refused) return;
  const auto first = std::find_if(issues.begin(), issues.end(), [](const Error& issue) {
    return severity_of(issue.code) == Severity::error;
  });
  REQUIRE(first != issues.end());
  CHECK(to_line(read.error()) == to_line(*first));
}

}  // namespace

Lines lines_of(const Issues& issues) {
  Lines lines;
  for (const Error& issue : issues) lines.push_back(std::string(name_of(issue.code)) + " " + issue.place);
  return lines;
}

std::string joined(const Lines& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

Changed::Changed() {
  test::need(write_fabric(folder / "good.exr", good_fabric()));
  file = open_fabric(folder / "good.exr");
}

Issues Changed::issues() {
  save_fabric(folder / "changed.exr", file);
  return check_fabric(folder / "changed.exr");
}

bool Changed::is_read() const { return read_fabric(folder / "changed.exr").has_value(); }

void refused(const Change& change, const Lines& expected) { expect(change, expected, true); }
void accepted(const Change& change, const Lines& expected) { expect(change, expected, false); }

}  // namespace selvedge::test
