#pragma once
// Rows of a PLY element that are not an array of fixed-size records: text, and binary with lists.

#include "ply_header.h"

namespace photosphere::caches {

/// Refuses a count that the rest of the file cannot hold, before anything is allocated for it.
/// @throws InputError
void checkCount(const FileReader& file, const PlyElement& element, bool ascii);

/// Reads one line into `record`: the fixed properties one after another, little endian; lists are
/// passed over. @throws InputError with the line
void readTextRow(FileReader& file, const PlyElement& element, unsigned char* record);

/// The same for a binary row, in the byte order of the file. @throws InputError
void readBinaryRow(FileReader& file, const PlyElement& element, ByteOrder order,
                   unsigned char* record);

/// Passes over an element that is not wanted. @throws InputError
void skipElement(FileReader& file, const PlyElement& element, const PlyHeader& header);

/// After the last element only blanks may come: a count that a damaged header lowers, or a list
/// that is shorter than it was, leaves more. @throws InputError
void checkEnd(FileReader& file, const PlyHeader& header);

}  // namespace photosphere::caches
