#include "format/base/memory.h"

#include <fmt/format.h>

namespace selvedge {

Error beyond_memory(const std::string& file, const std::string& place, const std::string& what,
                    std::uint64_t limit) {
  return {Code::file_too_large, file, place,
          fmt::format("{} take more than {} MiB (--max-memory)", what, limit >> 20U)};
}

}  // namespace selvedge
