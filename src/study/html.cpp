#include "html.h"

#include <fmt/format.h>

#include <cstdint>
#include <string_view>

namespace photosphere::study {

namespace {

// Length of the UTF-8 character that begins here; 0 where none does.
std::size_t utf8Length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(at);
  const std::size_t length = lead < 0x80                   ? 1
                             : lead >= 0xc2 && lead < 0xe0 ? 2
                             : lead >= 0xe0 && lead < 0xf0 ? 3
                             : lead >= 0xf0 && lead < 0xf5 ? 4
                                                           : 0;
  if (length == 0 || at + length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(at + i) & 0xc0) != 0x80) return 0;
  if (length < 3) return length;
  const unsigned char second = byte(at + 1);
  // Overlong forms, surrogates, beyond U+10FFFF.
  const bool wrong = (lead == 0xe0 && second < 0xa0) || (lead == 0xed && second >= 0xa0) ||
                     (lead == 0xf0 && second < 0x90) || (lead == 0xf4 && second >= 0x90);
  return wrong ? 0 : length;
}

void replaceAll(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at)) {
    text.replace(at, from.size(), to);
    at += to.size();
  }
}

// Removes ` name="..."` wherever it stands.
void dropAttribute(std::string& text, const std::string& name) {
  const std::string start = " " + name + "=\"";
  for (std::size_t at = text.find(start); at != std::string::npos; at = text.find(start, at)) {
    const std::size_t end = text.find('"', at + start.size());
    if (end == std::string::npos) return;
    text.erase(at, end + 1 - at);
  }
}

constexpr const char* kStyle = R"(
body { font: 16px/1.5 sans-serif; color: #111; background: #fff; max-width: 76rem; margin: 2rem auto;
       padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.3rem; margin-top: 2.5rem; }
h3 { font-size: 1.1rem; margin-top: 1.8rem; }
table { border-collapse: collapse; margin: 0 0 1rem; font-size: 0.85rem; }
.caption { font-weight: bold; font-size: 0.9rem; margin: 1rem 0 0.3rem; }
th, td { border-bottom: 1px solid #bbb; padding: 0.2rem 0.6rem; text-align: left;
         vertical-align: top; }
th { border-bottom: 2px solid #111; vertical-align: bottom; }
td:first-child { min-width: 15rem; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
figure { margin: 1rem 0; } figcaption { font-size: 0.9rem; max-width: 60rem; }
.wide { overflow-x: auto; }
.pictures { display: flex; flex-wrap: wrap; gap: 1rem; } .pictures figure { margin: 0; }
.pictures img { image-rendering: pixelated; display: block; }
.pictures figcaption { max-width: 20rem; font-size: 0.8rem; }
svg { max-width: 100%; height: auto; }
p, li { max-width: 60rem; }
)";

}  // namespace

std::string escape(const std::string& text) {
  std::string safe;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8Length(text, i);
    const char c = text[i];
    if (length == 0)
      safe += "\xef\xbf\xbd";
    else if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else if (c == '>')
      safe += "&gt;";
    else if (c == '"')
      safe += "&quot;";
    else if (c == '\'')
      safe += "&#39;";
    else if (length == 1 && (static_cast<unsigned char>(c) < 0x20 || c == 0x7f))
      safe += ' ';
    else
      safe += text.substr(i, length);
    i += length ? length : 1;
  }
  return safe;
}

std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t j = 0; j < 3; ++j)
      group = group << 8 | (i + j < bytes.size() ? static_cast<unsigned char>(bytes[i + j]) : 0u);
    for (std::size_t j = 0; j < 4; ++j)
      text += i + j > bytes.size() ? '=' : kDigits[group >> (18 - 6 * j) & 63];
  }
  return text;
}

std::string pictureTag(const std::string& png, const std::string& alternative, int width,
                       int height) {
  return fmt::format("<img src=\"data:image/png;base64,{}\" alt=\"{}\" width=\"{}\" height=\"{}\">",
                     base64(png), escape(alternative), width, height);
}

std::string tableTag(const Table& table) {
  // A caption of the table's own would be as narrow as a narrow table.
  std::string text;
  if (!table.caption.empty()) text += "<p class=\"caption\">" + escape(table.caption) + "</p>\n";
  text += "<div class=\"wide\"><table>\n";
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    const char* tag = r == 0 ? "th" : "td";
    text += "<tr>";
    for (std::size_t c = 0; c < table.rows[r].size(); ++c)
      text += fmt::format("<{}{}>{}</{}>", tag, c >= table.firstNumber ? " class=\"n\"" : "",
                          escape(table.rows[r][c]), tag);
    text += "</tr>\n";
  }
  return text + "</table></div>\n";
}

std::string inlineSvg(const std::string& svg, const std::string& prefix,
                      const std::string& description) {
  const std::size_t start = svg.find("<svg");
  const std::size_t end = svg.rfind("</svg>");
  if (start == std::string::npos || end == std::string::npos) return {};
  std::string text = svg.substr(start, end + 6 - start);
  dropAttribute(text, "xmlns");
  dropAttribute(text, "xmlns:xlink");
  replaceAll(text, "xlink:href", "href");
  for (const char quote : {'"', '\''}) {
    const std::string id = fmt::format(" id={}", quote);
    replaceAll(text, id, id + prefix);
    const std::string link = fmt::format("href={}#", quote);
    replaceAll(text, link, link + prefix);
  }
  replaceAll(text, "url(#", "url(#" + prefix);
  text.insert(4, fmt::format(" role=\"img\" aria-label=\"{}\"", escape(description)));
  return text + "\n";
}

std::string pageText(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
      escape(title), kStyle, body);
}

}  // namespace photosphere::study
