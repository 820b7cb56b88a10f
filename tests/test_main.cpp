// The main of every test program. Exit status 77 where every test case that ran was skipped.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include "tests/shared_data.h"

namespace {

struct Count : doctest::IReporter {
  static inline unsigned cases = 0;

  explicit Count(const doctest::ContextOptions&) {}
  void test_case_start(const doctest::TestCaseData&) override { ++cases; }
  void report_query(const doctest::QueryData&) override {}
  void test_run_start() override {}
  void test_run_end(const doctest::TestRunStats&) override {}
  void test_case_reenter(const doctest::TestCaseData&) override {}
  void test_case_end(const doctest::CurrentTestCaseStats&) override {}
  void test_case_exception(const doctest::TestCaseException&) override {}
  void subcase_start(const doctest::SubcaseSignature&) override {}
  void subcase_end() override {}
  void log_assert(const doctest::AssertData&) override {}
  void log_message(const doctest::MessageData&) override {}
  void test_case_skipped(const doctest::TestCaseData&) override {}
};

REGISTER_LISTENER("count", 1, Count);

}  // namespace

int main(int argc, char** argv) {
  doctest::Context context(argc, argv);
  const int status = context.run();
  if (context.shouldExit()) return status;
  if (status == 0 && Count::cases == 0) return 1;  // a filter that finds no test case
  return status == 0 && selvedge::test::skipped_cases == Count::cases ? 77 : status;
}
