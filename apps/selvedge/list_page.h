// The page of a list of fabrics.
#pragma once

#include <string>

#include "apps/common/report.h"

namespace selvedge {

/// Writes FOLDER/index.html with a row for each of the report's fabrics, and a picture of each file that is
/// there under FOLDER/pictures: two repeats from near. A picture is drawn anew where its fabric has changed.
/// Precondition: FOLDER/pictures is there.
Result<void> write_list_page(const std::string& folder, const std::string& list, const Json& rows);

}  // namespace selvedge
