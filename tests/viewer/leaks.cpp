// Read by LeakSanitizer where it is linked in, unused elsewhere: Mesa's OSMesaMakeCurrent never frees some
// 160 bytes of each context that was made current.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libOSMesa"; }
