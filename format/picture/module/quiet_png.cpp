// libpng without its lines on standard error. OpenImageIO keeps a fault as its own error, but returns to
// libpng, which then prints it before it jumps. This definition of libpng's function is the one that
// OpenImageIO finds: the module comes before the libraries that it is loaded with.
#include <dlfcn.h>
#include <png.h>

namespace {

void jump_silently(png_structp png, png_const_charp why) {
  // OpenImageIO's own handler, which png_set_error_fn() below has put there.
  reinterpret_cast<png_error_ptr>(png_get_mem_ptr(png))(png, why);
  png_longjmp(png, 1);
}

}  // namespace

extern "C" __attribute__((visibility("default"))) void png_set_error_fn(png_structrp png, png_voidp input,
                                                                        png_error_ptr error,
                                                                        png_error_ptr warning) {
  static const auto original =
      reinterpret_cast<decltype(&png_set_error_fn)>(dlsym(RTLD_NEXT, "png_set_error_fn"));
  png_set_mem_fn(png, reinterpret_cast<png_voidp>(error), nullptr, nullptr);
  original(png, input, jump_silently, warning);
}
