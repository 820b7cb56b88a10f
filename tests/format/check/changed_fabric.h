// A good fabric after one change, for the tests of its rules.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "format/check/fabric.h"
#include "tests/format/fabric_files.h"
#include "tests/format/files.h"

namespace selvedge::test {

using Lines = std::vector<std::string>;

/// "CODE place" each.
Lines lines_of(const Issues& issues);

/// One line each, to be compared: the difference is then shown.
std::string joined(const Lines& lines);

/// A good fabric, good.exr, to be changed: all layers on all three levels of 4 x 3 texels, one lobe, four
/// views.
class Changed {
 public:
  Changed();
  /// Writes changed.exr: check's issues with it.
  Issues issues();
  bool is_read() const;

  Folder folder;
  OpenedFabric file;
};

using Change = std::function<void(OpenedFabric&)>;

/// The change gives exactly these issues, "CODE place" each, and the reader refuses the file with the first
/// error of them.
void refused(const Change& change, const Lines& expected);

/// The same of a file that is read.
void accepted(const Change& change, const Lines& expected);

}  // namespace selvedge::test
