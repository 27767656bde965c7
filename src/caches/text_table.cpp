#include "text_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "photosphere/core/error.h"
#include "table_columns.h"
#include "text_number.h"

namespace photosphere::caches {

namespace {

constexpr std::size_t kMaxColumns = 4096;

bool isComment(std::string_view line) {
  return line.starts_with('#') || line.starts_with("//");
}

bool isNumber(std::string_view cell) {
  double unused = 0;
  return parseReal(cell, unused);
}

/// Takes the next cell off a line. @return false at the end of the line
/// @param more  true when a delimiter followed, so that one more cell comes, if only an empty one
bool nextCell(std::string_view& line, char delimiter, std::string& scratch, std::string_view& cell,
              bool& more) {
  if (delimiter == ' ') {
    cell = nextWord(line);
    return !cell.empty();
  }
  if (line.empty() && !more) return false;
  while (!line.empty() && line.front() == ' ')
    line.remove_prefix(1);
  if (!line.empty() && line.front() == '"') {
    scratch.clear();
    std::size_t at = 1;
    for (; at < line.size(); ++at) {
      if (line[at] == '"') {
        if (at + 1 == line.size() || line[at + 1] != '"') break;
        ++at;
      }
      scratch += line[at];
    }
    const std::size_t end = std::min(line.find(delimiter, at), line.size());
    more = end < line.size();
    line.remove_prefix(std::min(end + 1, line.size()));
    cell = scratch;
    return true;
  }
  const std::size_t end = std::min(line.find(delimiter), line.size());
  cell = trimmed(line.substr(0, end));
  more = end < line.size();
  line.remove_prefix(std::min(end + 1, line.size()));
  return true;
}

/// Names that custom gives to the columns of a file without a header.
std::vector<std::string> customNames(std::size_t count, bool pts) {
  std::vector<std::string> names = {"x", "y", "z"};
  if (pts && (count == 4 || count == 7)) names.push_back("intensity");
  if (pts && count >= 6)
    for (const char* colour : {"red", "green", "blue"})
      names.emplace_back(colour);
  for (std::size_t i = names.size(); i < count; ++i)
    names.push_back(fmt::format("column{}", i + 1));
  names.resize(count);
  return names;
}

bool holdPositions(const std::vector<ColumnGroup>& groups) {
  return std::any_of(groups.begin(), groups.end(),
                     [](const ColumnGroup& group) { return group.name == "P"; });
}

class TableReader {
 public:
  TableReader(FileReader& file, bool pts, std::vector<std::string>& notes)
      : m_file(file), m_pts(pts), m_notes(notes) {}

  volume::ParticleSet read(const std::vector<std::string>& names) {
    std::string first;
    if (!firstLine(first)) return withoutRows(names);
    m_delimiter = sniffDelimiter(first);
    std::vector<std::string> cells = splitCells(first, m_delimiter);
    std::uint64_t count = 0;
    // A scan of no points is followed by the count of the next one, or by nothing.
    while (m_pts && cells.size() == 1 && parseInteger(cells[0], count)) {
      expect(count);
      if (!firstLine(first)) return finish();
      m_delimiter = sniffDelimiter(first);
      cells = splitCells(first, m_delimiter);
    }
    if (cells.size() > kMaxColumns) fail("has more than 4096 columns");
    const bool header = std::none_of(cells.begin(), cells.end(), isNumber);
    m_names = chooseNames(names, cells, header);
    if (!header) {
      makeColumns(cells);
      row(first);
    } else {
      std::string second;
      const bool any = firstLine(second);
      makeColumns(any ? splitCells(second, m_delimiter) : std::vector<std::string>());
      if (any) row(second);
    }
    std::string_view line;
    while (m_file.nextLine(line))
      if (!trimmed(line).empty() && !isComment(trimmed(line)) && !isBlockCount(line)) row(line);
    return finish();
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw InputError(m_file.path(), reason);
  }
  [[noreturn]] void failLine(const std::string& reason) const {
    fail(fmt::format("line {}: {}", m_file.lineNumber(), reason));
  }

  /// The next line that is neither blank nor comment, copied. The last comment may name the
  /// columns.
  bool firstLine(std::string& copy) {
    std::string_view line;
    while (m_file.nextLine(line)) {
      if (m_file.lineNumber() == 1 && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
      if (line.find('\0') != line.npos) fail("is not text; name its format by its extension");
      const std::string_view text = trimmed(line);
      if (isComment(text))
        m_comment = text.substr(text.find_first_not_of("#/ \t") == text.npos
                                    ? text.size()
                                    : text.find_first_not_of("#/ \t"));
      if (text.find('\r') != text.npos)
        fail("its lines end in CR alone, as on old Macs; save it with LF or CRLF line ends");
      if (text.empty() || isComment(text)) continue;
      copy = text;
      return true;
    }
    return false;
  }

  /// A frame without particles, which only a comment that names the columns tells from a file that
  /// broke off. @throws InputError without one
  volume::ParticleSet withoutRows(const std::vector<std::string>& given) {
    const std::vector<std::string> named = splitCells(m_comment, sniffDelimiter(m_comment));
    if (named.size() > kMaxColumns || !holdPositions(groupColumns(named)))
      fail("has no row of numbers; export it again");
    m_names = given.empty() ? named : given;
    makeColumns({});
    return finish();
  }

  std::vector<std::string> chooseNames(const std::vector<std::string>& given,
                                       const std::vector<std::string>& cells, bool header) {
    std::vector<std::string> names = given;
    if (!names.empty()) {
      if (names.size() > cells.size())
        throw ConfigError(fmt::format("{}: option 'columns' names {} columns, the file has {}",
                                      m_file.path(), names.size(), cells.size()));
      names.resize(cells.size(), "-");
      return names;
    }
    if (header) {
      // A word before the name is Krakatoa's type: `float16 Position`.
      for (const std::string& cell : cells) {
        const std::size_t space = cell.rfind(' ');
        const bool typed =
            space != cell.npos &&
            (cell.starts_with("float") || cell.starts_with("int") || cell.starts_with("uint"));
        names.push_back(typed ? cell.substr(space + 1) : cell);
      }
      return names;
    }
    names = splitCells(m_comment, sniffDelimiter(m_comment));
    if (names.size() == cells.size() && std::none_of(names.begin(), names.end(), isNumber))
      return names;
    names = customNames(cells.size(), m_pts);
    if (!m_pts && cells.size() > 3)
      m_notes.push_back(
          "no line names the columns: the first three are x y z, the others column4 and "
          "so on; name them by option 'columns'");
    return names;
  }

  void makeColumns(const std::vector<std::string>& firstRow) {
    m_target.assign(m_names.size(), {nullptr, 0});
    std::vector<std::string> kept;
    std::vector<std::size_t> origin;
    for (std::size_t i = 0; i < m_names.size(); ++i)
      if (m_names[i] != "-" && !m_names[i].empty()) {
        kept.push_back(m_names[i]);
        origin.push_back(i);
      }
    std::vector<ColumnGroup> groups = groupColumns(kept);
    if (!holdPositions(groups))
      fail(fmt::format("has no columns x, y, z (it has: {}); name them by option 'columns'",
                       fmt::join(m_names.begin(),
                                 m_names.begin() + static_cast<std::ptrdiff_t>(
                                                       std::min<std::size_t>(m_names.size(), 12)),
                                 ", ")));
    if (const std::string name = repeatedColumn(kept, groups); !name.empty())
      fail(
          fmt::format("has several columns '{}'; rename all but one, or leave them out by '-' in "
                      "option 'columns'",
                      name));
    m_columns.reserve(groups.size());
    for (ColumnGroup& group : groups) {
      bool text = false;
      for (std::size_t& column : group.columns) {
        column = origin[column];
        text = text || (column < firstRow.size() && !firstRow[column].empty() &&
                        !isNumber(firstRow[column]));
      }
      m_columns.emplace_back(std::move(group), text && group.name != "P");
    }
    for (TableColumn& column : m_columns)
      for (int c = 0; c < column.arity(); ++c)
        m_target[column.group().columns[static_cast<std::size_t>(c)]] = {&column, c};
  }

  /// Adds a count to the points that are to come. @throws InputError for more than there is room
  /// for
  void expect(std::uint64_t points) {
    if (points <= m_file.size()) m_expected = m_expected.value_or(0) + points;
    if (points > m_file.size() || *m_expected > m_file.size())
      failLine(
          fmt::format("says {} points, which {} bytes cannot hold: the file is truncated or "
                      "damaged; write it again",
                      points, m_file.size()));
  }

  /// PTS files hold several scans, each with its own count.
  bool isBlockCount(std::string_view line) {
    std::uint64_t count = 0;
    if (!m_expected || m_names.size() < 3 || !parseInteger(trimmed(line), count)) return false;
    expect(count);
    return true;
  }

  void row(std::string_view line) {
    line = trimmed(line);
    std::string_view cell;
    std::size_t column = 0;
    bool more = false;
    for (; nextCell(line, m_delimiter, m_scratch, cell, more); ++column) {
      if (column >= m_target.size()) {
        if (cell.empty()) continue;  // a delimiter at the end of the line
        failLine(fmt::format("more than the {} columns of the first line", m_target.size()));
      }
      const Target& target = m_target[column];
      if (target.column && !target.column->store(m_rows, target.component, cell))
        failLine(fmt::format(
            "'{}' in column '{}' is not a number{}", shown(cell), m_names[column],
            cell.find(',') != cell.npos ? " (decimal commas: export with points)" : ""));
    }
    if (column < m_target.size())
      failLine(
          fmt::format("{} columns where the first line has {}: the file is truncated or damaged",
                      column, m_target.size()));
    ++m_rows;
  }

  volume::ParticleSet finish() {
    if (m_expected && m_rows != *m_expected)
      fail(fmt::format("says {} points and holds {}: the file is {}; write it again", *m_expected,
                       m_rows, m_rows < *m_expected ? "truncated" : "damaged"));
    volume::ParticleSet set;
    std::uint64_t empty = 0;
    for (TableColumn& column : m_columns) {
      empty += column.emptyCells();
      if (column.group().name == "P")
        set.positions = column.takePositions(m_rows);
      else
        set.attributes.push_back(column.takeAttribute(m_rows));
    }
    if (empty > 0) m_notes.push_back(fmt::format("{} empty cells read as NaN", empty));
    if (volume::Attribute* colour = set.find("Cd")) scaleColour(*colour);
    return set;
  }

  /// Colours as whole numbers are bytes.
  void scaleColour(volume::Attribute& colour) {
    const auto* bytes = std::get_if<std::vector<std::int32_t>>(&colour.data);
    if (!bytes || bytes->empty()) return;
    const auto [low, high] = std::minmax_element(bytes->begin(), bytes->end());
    if (*low < 0 || *high <= 1 || *high > 255) return;
    std::vector<float> scaled;
    scaled.reserve(bytes->size());
    for (const std::int32_t value : *bytes)
      scaled.push_back(static_cast<float>(value / 255.0));
    colour.data = std::move(scaled);
    m_notes.push_back("colours of 0 to 255 scaled to 0 to 1");
  }

  struct Target {
    TableColumn* column;
    int component;
  };
  FileReader& m_file;
  bool m_pts;
  std::vector<std::string>& m_notes;
  char m_delimiter = ' ';
  std::string m_comment, m_scratch;
  std::vector<std::string> m_names;
  std::vector<TableColumn> m_columns;
  std::vector<Target> m_target;
  std::optional<std::uint64_t> m_expected;
  std::size_t m_rows = 0;
};

}  // namespace

std::vector<std::string> splitCells(std::string_view line, char delimiter) {
  std::vector<std::string> cells;
  std::string scratch;
  std::string_view cell;
  bool more = false;
  line = trimmed(line);
  while (nextCell(line, delimiter, scratch, cell, more))
    cells.emplace_back(cell);
  while (cells.size() > 1 && cells.back().empty())
    cells.pop_back();
  return cells;
}

char sniffDelimiter(std::string_view line) {
  for (const char delimiter : {'\t', ';', ','})
    if (line.find(delimiter) != line.npos) return delimiter;
  return ' ';
}

volume::ParticleSet readTable(FileReader& file, const std::vector<std::string>& names, bool pts,
                              std::vector<std::string>& notes) {
  return TableReader(file, pts, notes).read(names);
}

}  // namespace photosphere::caches
