#pragma once
// Text files of one particle a line.

#include <string>
#include <string_view>
#include <vector>

#include "byte_reader.h"
#include "photosphere/volume/particle_set.h"

namespace photosphere::caches {

/// What the first lines of a text table show.
struct TableStyle {
  char delimiter = ' ';              ///< `,`, `;`, tab, or a blank for any run of blanks
  std::vector<std::string> columns;  ///< names, from the header line or by position; "-" = not read
  bool header = false;               ///< the first line names the columns
};

/// Splits one line. A cell may be quoted (`"a ""b"" c"`).
std::vector<std::string> splitCells(std::string_view line, char delimiter);

/// Tab, semicolon, comma or blanks: what the line holds, in this order.
char sniffDelimiter(std::string_view line);

/// Reads the whole table.
/// @param names  column names by position; empty = from the header line, or by custom
/// @param pts    first line is a count; colours are bytes (Leica PTS)
/// @throws InputError with the line
volume::ParticleSet readTable(FileReader& file, const std::vector<std::string>& names, bool pts,
                              std::vector<std::string>& notes);

}  // namespace photosphere::caches
