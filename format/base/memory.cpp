#include "format/base/memory.h"

#include <fmt/format.h>

namespace selvedge {

Error memory_limit_error(const std::string& file, const std::string& place, const std::string& what,
                         std::uint64_t limit) {
  const bool small = limit < std::uint64_t{1} << 24U;
  return {Code::file_too_large, file, place,
          fmt::format("{} take more than {} {} (--max-memory)", what, limit >> (small ? 10U : 20U),
                      small ? "KiB" : "MiB")};
}

}  // namespace selvedge
