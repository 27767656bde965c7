#pragma once
// Pieces of a self-contained HTML page. Every text goes through escape().

#include <string>
#include <vector>

namespace photosphere::study {

/// Text for element content and quoted attributes: & < > " ' as references, control characters as
/// spaces, bytes that are not UTF-8 as U+FFFD.
std::string escape(const std::string& text);

std::string base64(const std::string& bytes);

/// A picture inside the page. @param png  its bytes
std::string pictureTag(const std::string& png, const std::string& alternative, int width,
                       int height);

/// A table of texts, escaped here. The first row is the head; columns from `firstNumber` on are
/// aligned right. Rows listed in `marked` are set bold.
struct Table {
  std::string caption;
  std::vector<std::vector<std::string>> rows;
  std::size_t firstNumber = 1;
};
std::string tableTag(const Table& table);

/// An SVG from gnuplot made part of a page: no prolog, no name spaces, ids made unique by `prefix`.
/// @param description  for those who cannot see it
std::string inlineSvg(const std::string& svg, const std::string& prefix,
                      const std::string& description);

/// The page around a body. @param style  CSS
std::string pageText(const std::string& title, const std::string& body);

}  // namespace photosphere::study
