// Exceptions in WebAssembly, which Debian's libc++abi lacks: enough of the Itanium C++ ABI for one thread.
// An exception's header lies before it; what is caught of a landing pad follows from its table (LSDA).
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string_view>
#include <typeinfo>
#include <utility>

namespace {

struct alignas(16) Header {
  const std::type_info* type;
  void* (*destroy)(void*);
  void* adjusted;  ///< the part of it that is caught
  Header* before;  ///< the one that was caught before
  int handlers;    ///< which run; negative: it is thrown again
};

/// The virtual functions of libc++abi's type_info, as far as the one that is called.
struct CatchType : std::type_info {
  virtual void unused_1() const = 0;
  virtual void unused_2() const = 0;
  virtual bool can_catch(const CatchType* thrown, void*& object) const = 0;
};

struct LandingPad {
  std::size_t index;
  const std::uint8_t* table;
  std::size_t selector;
};

Header* caught = nullptr;

Header& header_of(void* exception) { return static_cast<Header*>(exception)[-1]; }

std::size_t read_number(const std::uint8_t*& at) {
  std::size_t number = 0;
  for (unsigned shift = 0;; shift += 7) {
    number |= std::size_t{*at & 0x7FU} << shift;
    if ((*at++ & 0x80U) == 0) return number;
  }
}
int read_signed(const std::uint8_t*& at) {
  const std::uint8_t* const begin = at;
  const std::size_t number = read_number(at);
  const unsigned unused = 32 - 7 * std::min<std::ptrdiff_t>(at - begin, 4);
  return static_cast<int>(number << unused) >> unused;
}

}  // namespace

extern "C" {
LandingPad __wasm_lpad_context;
int __gxx_wasm_personality_v0() { std::abort(); }  // the compiler's name for the function below

/// Sets the selector: the first type of the landing pad that catches the exception; 0: none.
int _Unwind_CallPersonality(void* exception) {
  LandingPad& pad = __wasm_lpad_context;
  pad.selector = 0;
  const std::uint8_t* at = pad.table + 2;
  const std::size_t to_types = read_number(at);
  const auto* const types = reinterpret_cast<const CatchType* const*>(at + to_types);
  const std::size_t size = read_number(++at);
  const std::uint8_t* const actions = at + size;
  std::size_t action = 0;
  for (std::size_t i = 0; i <= pad.index; ++i) {
    read_number(at);
    action = read_number(at);
  }
  if (action == 0) return 0;
  Header& header = header_of(exception);
  at = actions + action - 1;
  for (;;) {
    const int type = read_signed(at);
    header.adjusted = exception;
    if (type > 0 && (types[-type] == nullptr ||
                     types[-type]->can_catch(static_cast<const CatchType*>(header.type), header.adjusted))) {
      pad.selector = static_cast<std::size_t>(type);
      return 0;
    }
    const std::uint8_t* const place = at;
    const int next = read_signed(at);
    if (next == 0) return 0;
    at = place + next;
  }
}

void* __cxa_allocate_exception(std::size_t size) {
  return static_cast<Header*>(std::calloc(1, sizeof(Header) + size)) + 1;
}
void __cxa_free_exception(void* exception) { std::free(&header_of(exception)); }
void __cxa_throw(void* exception, std::type_info* type, void* (*destroy)(void*)) {
  header_of(exception) = {type, destroy, exception, nullptr, 0};
  __builtin_wasm_throw(0, exception);
}
void* __cxa_get_exception_ptr(void* exception) { return header_of(exception).adjusted; }
void* __cxa_begin_catch(void* exception) {
  Header& header = header_of(exception);
  header.handlers = std::abs(header.handlers) + 1;
  if (caught != &header) header.before = std::exchange(caught, &header);
  return header.adjusted;
}
void __cxa_end_catch() {
  Header* const header = caught;
  const bool goes_on = header->handlers < 0;
  header->handlers += goes_on ? 1 : -1;
  if (header->handlers != 0) return;
  caught = header->before;
  if (goes_on) return;
  if (header->destroy != nullptr) header->destroy(header + 1);
  std::free(header);
}
void __cxa_rethrow() {
  caught->handlers = -caught->handlers;
  __builtin_wasm_throw(0, caught + 1);
}
int __cxa_thread_atexit(void (*)(void*), void*, void*) { return 0; }
int __cxa_atexit(void (*)(void*), void*, void*) { return 0; }
}

void* operator new(std::size_t size) {
  if (void* const memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  if (void* const memory = std::aligned_alloc(static_cast<std::size_t>(alignment), size)) return memory;
  throw std::bad_alloc();
}

/// Debian's libc++, built without exceptions, ends in messages such as "length_error was thrown ...".
void std::__2::__libcpp_verbose_abort(const char* format, ...) {
  const std::string_view message = format;
  if (message.starts_with("length_error")) throw std::length_error(format);
  if (message.starts_with("bad_alloc")) throw std::bad_alloc();
  throw std::runtime_error(format);
}
