#include "photosphere/core/hash.h"

#include <fmt/format.h>

#include <cstring>

namespace photosphere {

namespace {

std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

}  // namespace

void Hasher::word(std::uint64_t w) {
  m_state = mix(m_state ^ w);
}

void Hasher::bytes(const void* data, std::size_t size) {
  const char* p = static_cast<const char*>(data);
  m_length += size;
  while (size > 0) {
    std::uint64_t w = 0;
    const std::size_t n = size < 8 ? size : 8;
    std::memcpy(&w, p, n);
    word(w);
    p += n;
    size -= n;
  }
}

std::uint64_t Hasher::value() const {
  return mix(m_state ^ m_length);
}
std::string Hasher::hex() const {
  return fmt::format("{:016x}", value());
}

}  // namespace photosphere
