#pragma once
// Content hashes: names for media, lights and scenes that change when the content does. Not for
// security.

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace photosphere {

/// 64-bit hash over bytes, eight at a time, with the mixing step of splitmix64 (Steele et al.
/// 2014).
class Hasher {
 public:
  void bytes(const void* data, std::size_t size);
  void text(std::string_view s) {
    number(s.size());
    bytes(s.data(), s.size());
  }
  template <class T>
  requires std::is_arithmetic_v<T>
  void number(T value) { bytes(&value, sizeof value); }
  template <class T>
  requires std::is_arithmetic_v<T>
  void numbers(const T* values, std::size_t count) { bytes(values, count * sizeof(T)); }
  std::uint64_t value() const;
  /// 16 hexadecimal digits.
  std::string hex() const;

 private:
  void word(std::uint64_t w);
  std::uint64_t m_state = 0x243f6a8885a308d3ull;
  std::uint64_t m_length = 0;
};

}  // namespace photosphere
