// In place of the C library's: the one module is linked (format/web/pictures.cpp).
#pragma once
constexpr int RTLD_NOW = 0;
constexpr int RTLD_LOCAL = 0;
void* dlopen(const char* name, int flags);
void* dlsym(void* module, const char* name);
const char* dlerror();
