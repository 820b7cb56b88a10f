// Half of the mutations keep the text JSON.
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/target.h"

using namespace selvedge::fuzz;

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  Choice choice(seed);
  if (choice.one_in(2)) return LLVMFuzzerMutate(data, size, max_size);
  return give(mutate_json({reinterpret_cast<const char*>(data), size}, choice), data, size, max_size);
}
