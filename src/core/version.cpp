#include "photosphere/core/version.h"

namespace photosphere {

std::string versionText() {
  return "photosphere " PHOTOSPHERE_VERSION;
}

namespace {

constexpr const char* kInstructions =
#if defined(__AVX512F__)
    "x86-64 avx512";
#elif defined(__AVX2__)
    "x86-64 avx2";
#elif defined(__x86_64__)
    "x86-64";
#elif defined(__aarch64__)
    "aarch64";
#else
    "other";
#endif

constexpr const char* kCompiler =
#if defined(__clang__)
    "clang ";
#else
    "gcc ";
#endif

}  // namespace

std::string buildText() {
  return versionText() + ", " + kCompiler + __VERSION__ + ", " + kInstructions;
}

}  // namespace photosphere
