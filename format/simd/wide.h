// Functions compiled for several vector extensions of x86-64, none with fused operations, so that the bits
// agree.
#pragma once

// Clang, of which the sanitizers' builds are, does not support target_clones as GCC does: it gets one body.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define SELVEDGE_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define SELVEDGE_WIDE
#endif

/// For functions that are inlined into several such bodies.
#define SELVEDGE_INLINE inline __attribute__((always_inline))

/// Instantiates the template `name<N>` for the vector widths of SSE, AVX2 and AVX-512, and defines
/// name##_for_this_processor(), which calls the widest one that the processor supports. Works under the
/// thread sanitizer, because nothing is resolved before main.
// NOLINTBEGIN(bugprone-macro-parentheses): parameters of functions, not expressions
#if defined(__x86_64__) && defined(__GNUC__)
#define SELVEDGE_THREE_BODIES(name, parameters, arguments)                                        \
  void name##_plain parameters { name<4> arguments; }                                             \
  __attribute__((target("avx2,fma"))) void name##_avx2 parameters { name<8> arguments; }          \
  __attribute__((target("avx512f,fma"))) void name##_avx512 parameters { name<16> arguments; }    \
  void name##_for_this_processor parameters {                                                     \
    static const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); \
    static const auto widest = __builtin_cpu_supports("avx512f") ? name##_avx512                  \
                               : has_avx2                        ? name##_avx2                    \
                                                                 : name##_plain;                                         \
    widest arguments;                                                                             \
  }
#else
#define SELVEDGE_THREE_BODIES(name, parameters, arguments) \
  void name##_for_this_processor parameters { name<4> arguments; }
#endif
// NOLINTEND(bugprone-macro-parentheses)
