#pragma once
// Keeps a damaged file from taking all memory inside a library.

#include <cstdint>

namespace photosphere::volume {

/// While one lives, the process may reserve so many bytes of addresses more than it had, and what
/// asks for more gets std::bad_alloc. Several may live at a time, on any threads: their rooms add
/// up. Does nothing where a sanitizer has reserved terabytes, or a tighter limit holds already.
class AddressRoom {
 public:
  explicit AddressRoom(std::uint64_t bytes);
  ~AddressRoom();
  AddressRoom(const AddressRoom&) = delete;
  AddressRoom& operator=(const AddressRoom&) = delete;
};

}  // namespace photosphere::volume
